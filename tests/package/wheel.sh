#!/usr/bin/env bash
# The wheel, made from the module that was built, installs without network and gives a first array.
set -euo pipefail
source_folder=$1 build_folder=$2 python=$3
"$python" -c 'import numpy, pip, setuptools, venv, wheel' 2>/dev/null ||
  { echo "skipped: $python has no pip, setuptools, venv, wheel or numpy"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

mkdir -p "$work/source/engine"  # what setup.py writes stays here
cp "$source_folder"/{pyproject.toml,setup.py,CMakeLists.txt,README.md} "$work/source"
cp -r "$source_folder/engine/python" "$work/source/engine"
ENSONIFY_BUILD=$build_folder "$python" -m pip wheel -q --no-build-isolation --no-deps --no-index \
  -w "$work" "$work/source"
"$python" -m venv --system-site-packages "$work/venv"
"$work/venv/bin/pip" install -q --no-deps --no-index "$work"/ensonify-*.whl
cd "$work"
"$work/venv/bin/python" -c "
import ensonify, sys
assert ensonify.__file__.startswith(sys.argv[1]), ensonify.__file__
image = ensonify.simulate(sys.argv[2] + '/scenes/ripples.toml', keys={'track.pings': 3})
assert image.shape == (3, 2000) and image.max() > 0" "$work/venv" "$source_folder"
