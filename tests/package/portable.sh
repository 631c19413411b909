#!/usr/bin/env bash
# The plain CMake build on systems that are not Debian: HDF5 is found by each of its names, a
# header that is missing is named, and a user chooses the folder of the Python module.
set -euo pipefail
source_folder=$1 build_folder=$2 compiler=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "$*"; exit 1; }

cat >"$work/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.25)
project(finds_hdf5 LANGUAGES CXX)
find_package(PkgConfig REQUIRED)
include($source_folder/cmake/find_hdf5.cmake)
add_executable(opens hdf5.cpp)
target_link_libraries(opens PRIVATE PkgConfig::ENSONIFY_HDF5)
END
printf '#include <hdf5.h>\nint main() { return H5open(); }\n' >"$work/hdf5.cpp"
debian=$(pkg-config --path hdf5-serial 2>/dev/null || pkg-config --path hdf5)
for name in hdf5-serial hdf5 none; do
  mkdir "$work/$name"
  if [[ $name != none ]]; then cp "$(realpath "$debian")" "$work/$name/$name.pc"; fi
  PKG_CONFIG_LIBDIR=$work/$name PKG_CONFIG_PATH='' cmake -S "$work" -B "$work/$name/build" -G Ninja \
    -D CMAKE_CXX_COMPILER="$compiler" >"$work/log" 2>&1 || { cat "$work/log"; fail "HDF5 is not found as $name"; }
  cmake --build "$work/$name/build" >"$work/log" 2>&1 || { cat "$work/log"; fail "HDF5 is not used as $name"; }
  "$work/$name/build/opens" || fail "HDF5, found as $name, does not open"
done

# configure FOLDER OPTIONS...: the whole tree, without building it.
configure() {
  cmake -S "$source_folder" -B "$work/$1" -G Ninja -D CMAKE_CXX_COMPILER="$compiler" -D BUILD_TESTING=OFF \
    -D CMAKE_BUILD_TYPE=Release "${@:2}" >"$work/log" 2>&1
}
if configure without -D CMAKE_SYSTEM_IGNORE_PATH=/usr/include; then fail "a missing header is not noticed"; fi
tr -s ' \n' ' ' <"$work/log" | grep -q 'Random123/philox.h is missing: install Random123 (Debian: librandom123-dev)' ||
  { cat "$work/log"; fail "the missing header is not named"; }

module=("$build_folder"/python/ensonify/_ensonify*.so)
[[ -f ${module[0]} ]] || exit 0  # built without it
configure chosen -D ENSONIFY_PYTHON_FOLDER=lib64/own || { cat "$work/log"; fail "the tree is not configured"; }
cp "${module[0]}" "$work/chosen/python/ensonify"
cmake -D CMAKE_INSTALL_PREFIX="$work/prefix" -D CMAKE_INSTALL_COMPONENT=program \
  -P "$work/chosen/engine/python/cmake_install.cmake" >"$work/log" 2>&1 || { cat "$work/log"; fail "nothing is installed"; }
[[ -s $work/prefix/lib64/own/ensonify/__init__.py ]] || { find "$work/prefix"; fail "the folder is not the chosen one"; }
