#!/usr/bin/env python3
"""Compares the files that two builds of the program make of scenes and recipes, byte by byte.

usage: same_bytes.py OLD NEW FOLDER [SCENES]

OLD and NEW are programs, for example build/bin/ensonify. SCENES are scenes and recipes (default: all
of scenes/, and those beside this file). A scene is run as a whole, and writes every format. Of a recipe one sample is made. Where
files differ, the table names them, and the layers that differ in a NumPy archive with the number of
their values that differ. FOLDER keeps the files of these scenes only. The exit code is 1 if files
differ or a program failed, 2 if nothing was compared.
"""

import argparse
import io
import json
import os
import pathlib
import shutil
import subprocess
import sys
import zipfile

import numpy

PROJECT = pathlib.Path(__file__).resolve().parents[2]
FORMATS = ("npz", "xtf", "jsf", "truth")
# What the manifest says of the program itself: it may differ between two builds.
OF_THE_PROGRAM = ("program", "version", "libraries", "code_path", "files")


def is_recipe(scene):
    return "\n[dataset]" in scene.read_text()


def make(program, scene, folder):
    """Runs the program; returns the message of its failure, or None."""
    arguments = ["generate", scene, "-D", "dataset.samples=1", "-D", "dataset.seafloors=0"] if is_recipe(scene) else ["run", scene]
    for name in FORMATS:
        arguments += ["-D", f"output.{name}=true"]
    done = subprocess.run([program, *arguments, "--quiet", "-o", folder, "--cache", folder.parent / "cache"],
                          stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace",
                          check=False)
    return f"exit code {done.returncode}: {done.stderr.strip()}" if done.returncode else None


def files_of(folder):
    return {str(file.relative_to(folder)): file for file in sorted(folder.rglob("*")) if file.is_file()}


def manifest(data):
    """A manifest without what differs between builds; its hashes are those of files that are compared."""
    return {key: value for key, value in json.loads(data).items() if key not in OF_THE_PROGRAM}


def changed_layers(old, new):
    """The layers that differ between two NumPy archives, each with what differs."""
    with zipfile.ZipFile(io.BytesIO(old)) as a, zipfile.ZipFile(io.BytesIO(new)) as b:
        for name in sorted({*a.namelist(), *b.namelist()}):
            layer = name.removesuffix(".npy")
            if name not in a.namelist() or name not in b.namelist():
                yield f"{layer} (only one has it)"
                continue
            old_bytes, new_bytes = a.read(name), b.read(name)
            if old_bytes == new_bytes:
                continue
            before, after = (numpy.load(io.BytesIO(data), allow_pickle=False) for data in (old_bytes, new_bytes))
            if before.shape != after.shape or before.dtype != after.dtype or not before.ndim:
                yield f"{layer} ({before.dtype}{before.shape} became {after.dtype}{after.shape})"
            else:
                # Compared as bytes, so that NaN equals NaN and -0 differs from 0.
                pair = [numpy.ascontiguousarray(x).view(numpy.uint8).reshape(before.size, -1) for x in (before, after)]
                yield f"{layer} ({numpy.count_nonzero((pair[0] != pair[1]).any(axis=1))} of {before.size} values)"


def differences(old, new):
    """The names of files that differ between two folders, each with what differs."""
    old, new = files_of(old), files_of(new)
    for name in sorted(old.keys() | new.keys()):
        if name not in old or name not in new:
            yield f"{name} (only {'old' if name in old else 'new'} has it)"
            continue
        before, after = old[name].read_bytes(), new[name].read_bytes()
        if before == after:
            continue
        if pathlib.Path(name).name in ("manifest.json", "dataset.json"):
            if manifest(before) == manifest(after):
                continue
        if name.endswith(".npz"):
            layers = list(changed_layers(before, after))
            yield f"{name}: {', '.join(layers) if layers else 'the same layers in other bytes'}"
        else:
            yield name


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("old", type=pathlib.Path)
    parser.add_argument("new", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("scenes", nargs="*", type=pathlib.Path)
    options = parser.parse_args()
    programs = {"old": options.old.resolve(), "new": options.new.resolve()}
    for program in programs.values():
        if not os.access(program, os.X_OK) or program.is_dir():
            parser.error(f"{program} is no program; give the path of a build's bin/ensonify")
    scenes = options.scenes or sorted([*(PROJECT / "scenes").glob("*.toml"),
                                       *pathlib.Path(__file__).parent.glob("*.toml")])
    compared, changed, left_out = 0, [], []
    for scene in scenes:
        if "data:" in scene.read_text() and not os.environ.get("ENSONIFY_DATA"):
            left_out.append(scene.stem)
            continue
        folder = options.folder.resolve() / scene.stem
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        failures = [f"{which}: {message}" for which, program in programs.items()
                    if (message := make(program, scene, folder / which))]
        found = failures or list(differences(folder / "old", folder / "new"))
        count = len(files_of(folder / "old"))
        compared += count
        print(f"{scene.stem:24} {count:4} files  {'; '.join(found) if found else 'same'}", flush=True)
        if found:
            changed.append(scene.stem)
        else:
            shutil.rmtree(folder)
    if left_out:
        print(f"left out, because ENSONIFY_DATA names no folder with their data: {', '.join(left_out)}")
    if not compared:
        print("nothing was compared", file=sys.stderr)
        return 2
    return 1 if changed else 0


if __name__ == "__main__":
    sys.exit(main())
