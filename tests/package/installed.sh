#!/usr/bin/env bash
# The README's first program, the page's added object and the documented back-end are short, and they
# build against the installed libraries; all commands of the program know the back-end.
set -euo pipefail
source_folder=$1 build_folder=$2 compiler=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "$*"; exit 1; }

# block PAGE LANGUAGE WORD FILE LINES: a page's block, as a file of at most so many lines.
block() {
  local lines
  awk -v language="$2" -v word="$3" -f "$source_folder/tests/package/blocks.awk" "$source_folder/$1" >"$work/$4"
  lines=$(grep -c . "$work/$4") || true
  ((lines > 0 && lines <= $5)) || fail "$1: $4 has $lines lines, expected 1 to $5"
}

cmake --install "$build_folder" --prefix "$work/prefix" >"$work/log" || { cat "$work/log"; exit 1; }
cp "$source_folder/tests/package/"{CMakeLists.txt,back_end_main.cpp} "$work"
block README.md cpp 'int main' first_program.cpp 15
block doc/start/library.md cpp object_of added_object.cpp 20
block engine/README.md cpp RayByRay every_face.cpp 50
block engine/README.md cpp program_main main.cpp 5
block engine/README.md cmake my_ensonify documented.cmake 8
sed 's/"every-face"/"fan-scan"/' "$work/every_face.cpp" >"$work/name_taken.cpp"
(cd "$work/prefix/include" && find ensonify -name '*.h' | sort | sed 's/.*/#include <&>/') >"$work/all_headers.cpp"
headers=$(wc -l <"$work/all_headers.cpp")
listed=$(grep -c '^  .*\.h$' "$source_folder/cmake/public_headers.cmake")
((headers == listed)) || fail "$headers headers are installed, and $listed are listed"
cmake -S "$work" -B "$work/build" -G Ninja -D CMAKE_PREFIX_PATH="$work/prefix" \
  -D CMAKE_CXX_COMPILER="$compiler" >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }
cmake --build "$work/build" >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }

cd "$source_folder"  # the programs name scenes/ripples.toml
"$work/build/first_program" | tee "$work/out"
grep -q 'bin' "$work/out"
"$work/build/added_object" | tee "$work/out"
[[ $(head -n 1 "$work/out") == "drum in 0 bins" ]]  # to port
sed -n 2p "$work/out" | grep -q '^drum in [1-9][0-9]* bins$'

cd "$work"
cat >small.toml <<'END'
version = 1
[seafloor]
extent_east_m = 20
extent_north_m = 12
cell_m = 1
[sonar.sidescan]
range_m = 15
bins = 100
elevations = 32
planes = 2
[track]
pings = 2
END
build/back_end run
prefix/bin/ensonify intersectors >out
build/my_ensonify intersectors | grep '^every-face '  >row
build/my_ensonify intersectors | diff - <(cat out row)
# It decides edges by rounding: rays that are aimed at them leak, or find the next face. It does so in the same way on
# each face source, whatever the order of their faces.
build/my_ensonify check small.toml --quiet --rays 2000 --intersector every-face >table 2>err || (($? == 1))
awk -F, 'NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
         $column["source"] ~ /^(scene|bodies)$/ { rays += $column["rays"]; others += $column["unexplained"] }
         NR > 1 { others += $column["unlike_static"] }
         END { exit !(rays > 5000 && others == 0) }' table || { cat table; exit 1; }
build/my_ensonify run small.toml -o run2 --quiet --intersector every-face
grep -q '"intersector": "every-face"' run2/manifest.json
# It is compiled with optimisation, as the page's lines ask; a program that is not says so.
build/my_ensonify intersectors 2>err >/dev/null
[[ ! -s err ]] || { cat err; exit 1; }
build/unoptimised intersectors 2>err | diff - <(cat out row)
grep -q '^ensonify: warning: this program is compiled without optimisation' err || { cat err; exit 1; }
for command in intersectors "run small.toml -o run3" "check small.toml"; do
  # shellcheck disable=SC2086
  build/name_taken $command 2>err && fail "a name that is taken is not refused"
  (($(grep -c . err) == 1)) || { cat err; exit 1; }
  grep -q "^ensonify: program_intersector_kinds: the name 'fan-scan' is taken by the intersector 'fan_scan'" err
done
