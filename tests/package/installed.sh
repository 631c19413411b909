#!/usr/bin/env bash
# The README's first program and the documented back-end are short, and they build against the
# installed libraries.
set -euo pipefail
source_folder=$1 build_folder=$2 compiler=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cmake --install "$build_folder" --prefix "$work/prefix" >"$work/log" || { cat "$work/log"; exit 1; }
cp "$source_folder/tests/package/"{CMakeLists.txt,back_end_main.cpp} "$work"
awk -v language=cpp -v word='int main' -f "$source_folder/tests/package/blocks.awk" \
  "$source_folder/README.md" >"$work/first_program.cpp"
lines=$(grep -c . "$work/first_program.cpp")
((lines > 0 && lines <= 15)) || { echo "the first program has $lines lines, expected 1 to 15"; exit 1; }
awk -v language=cpp -v word=RayByRay -f "$source_folder/tests/package/blocks.awk" \
  "$source_folder/engine/README.md" >"$work/back_end.cpp"
lines=$(grep -c . "$work/back_end.cpp")
((lines > 0 && lines <= 40)) || { echo "the back-end has $lines lines, expected 1 to 40"; exit 1; }
(cd "$work/prefix/include" && find ensonify -name '*.h' | sort | sed 's/.*/#include <&>/') >"$work/all_headers.cpp"
headers=$(wc -l <"$work/all_headers.cpp")
listed=$(grep -c '^  .*\.h$' "$source_folder/cmake/public_headers.cmake")
((headers == listed)) || { echo "$headers headers are installed, and $listed are listed"; exit 1; }
cmake -S "$work" -B "$work/build" -G Ninja -D CMAKE_PREFIX_PATH="$work/prefix" \
  -D CMAKE_CXX_COMPILER="$compiler" >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }
cmake --build "$work/build" >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }
cd "$source_folder"  # the program names scenes/ripples.toml
"$work/build/first_program" | tee "$work/out"
grep -q 'bin' "$work/out"
"$work/build/back_end"
"$work/prefix/bin/ensonify" intersectors | grep -q embree
