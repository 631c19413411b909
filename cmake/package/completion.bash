# Completion of `ensonify` in bash: its commands, and the options that a command's --help lists.
_ensonify() {
  local current=${COMP_WORDS[COMP_CWORD]} command=() words
  if ((COMP_CWORD > 1)); then
    command=("${COMP_WORDS[1]}")
    if [[ $current != -* ]]; then return; fi  # a file, by -o default
  fi
  words=$("${COMP_WORDS[0]}" "${command[@]}" --help 2>/dev/null | sed -nE \
    -e '/^  -/{s/^  ([^ ]+).*/\1/;s/,/\n/g;p}' \
    -e '/^Subcommands:/,$s/^  ([a-z][a-z-]+).*/\1/p')
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
}
complete -o default -F _ensonify ensonify
