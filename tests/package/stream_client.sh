#!/usr/bin/env bash
# Runs the two clients of `ensonify stream` in engine/README.md, in Python and in C++.
set -euo pipefail
source_folder=$1 build_folder=$2 compiler=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export PATH=$build_folder/bin:$PATH ENSONIFY_CACHE=$work/cache
cd "$source_folder"  # the clients name scenes/ripples.toml

block() { awk -v language="$1" -v word="$2" -f tests/package/blocks.awk engine/README.md; }
block python '"stream"' >"$work/client.py"
block cpp 'ensonify stream' >"$work/client.cpp"
for file in client.py client.cpp; do
  lines=$(grep -c . "$work/$file")
  ((lines > 0 && lines <= 20)) || { echo "$file has $lines lines, expected 1 to 20"; exit 1; }
done
/usr/bin/python3 "$work/client.py" >"$work/python"
"$compiler" -std=c++20 -o "$work/client" "$work/client.cpp"
"$work/client" >"$work/cpp"
cat "$work/python"
(($(grep -c 'sidescan port' "$work/python") == 10))
diff "$work/python" "$work/cpp"
