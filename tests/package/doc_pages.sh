#!/usr/bin/env bash
# Does what the pages in doc/start and doc/tutorials say, in a folder that has only the scenes and what was
# built.
set -euo pipefail
source_folder=$1 build_folder=$2 python=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export ENSONIFY_CACHE=$work/cache
cd "$work"
ln -s "$source_folder/scenes" scenes
ln -s "$build_folder" build

export PATH=$build_folder/bin:$PATH PYTHONPATH=$build_folder/python

block() { awk -v language="$2" -v word="$3" -f "$source_folder/tests/package/blocks.awk" "$source_folder/doc/$1.md"; }
carry_out() {
  local page=$1 name
  name=$(basename "$page")
  block "$page" sh ' ' >commands
  (($(grep -c . commands) > 0)) || { echo "$page.md has no commands"; exit 1; }
  bash -euo pipefail commands >"$name.out" 2>"$name.err" || { cat "$name.out" "$name.err"; exit 1; }
}
block start/library cpp 'first echo' >first.cpp
block start/library cmake find_package >CMakeLists.txt
block tutorials/survey toml version >harbour.toml
block tutorials/detection toml version >litter.toml
for page in start/datasets start/intersectors start/library tutorials/survey tutorials/detection tutorials/imitation; do
  carry_out "$page"
done

test -s sheet.png
# The files that the page names.
grep -oE '^[|] .targets/[A-Za-z0-9_/.]+' "$source_folder/doc/start/datasets.md" | cut -c4- | while read -r file; do
  test -e "$file" || { echo "datasets.md: there is no $file"; exit 1; }
done
awk -F, '/^0,1,0,5,/ { hit = 1 } /^1,0,/ { miss = 1 } END { exit !(hit && miss) }' intersectors.out ||
  { cat intersectors.out; exit 1; }
grep -q '^the first echo is in bin [1-9]' library.out || { cat library.out; exit 1; }
test -s harbour/sidescan.png -a -s harbour.tif
grep -q ' 401 pings' survey.err || { cat survey.err; exit 1; }
test -s imitation/report.html -a -s comparison.html -a -s like_mine/samples/000001/sidescan.png
if "$python" -c 'import ensonify, PIL' 2>/dev/null; then
  block tutorials/detection python PIL >boxes.py
  "$python" boxes.py | grep -q '^[1-9][0-9]* images with [1-9]'
  test -s boxes.png
  block tutorials/vehicle python Simulator >vehicle.py
  "$python" vehicle.py | grep -q 'the other vehicle was in [1-9][0-9]* of 50 pings'
fi
