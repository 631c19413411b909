# The README's code blocks in `language` that contain `word`, without their fences.
/^```/ {
  if (inside) { if (wanted && index(block, word)) printf "%s", block; inside = 0 }
  else { inside = 1; wanted = ($0 == "```" language); block = "" }
  next
}
inside { block = block $0 "\n" }
