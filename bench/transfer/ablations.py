#!/usr/bin/env python3
"""Makes the datasets of bench/transfer/README.md, trains on each and writes the table of results.

    ablations.py PROGRAM OUT --real FOLDER [--real FOLDER] [--samples 320] [--few 150]
                 [--only ROW...]

PROGRAM is `ensonify`; OUT receives a dataset per recipe (a repeat resumes) and results.json, which
keeps the rows of earlier calls. FOLDER is as for transfer.py. Each row adds one thing to the row
before, up to `more samples`; the last one takes one thing away from `chips`.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

from transfer import line, run

SCENES = Path(__file__).resolve().parents[2] / "scenes"
SHORT, LONG = 200, 800  # batches of 32 pictures

# Two forms of each shape, always of one size.
FEW_SHAPES = {
    "objects.0.shape_seed": "{ choice = [1, 2] }",
    "objects.0.length_m": '{ by = "objects.0.shape", '
                          "table = { wreck = 40, aircraft = 14, boat = 6 } }",
}

# What an image has that a plain rendering of the same geometry has not.
NO_PHYSICS = {
    "speckle": "false", "texture": "false", "arrivals.surface": "false", "artefacts.lost": "0",
    "artefacts.gain_step_db": "0", "artefacts.automatic_gain": "0", "sonar.sidescan.noise": "false",
    "sonar.sidescan.output_noise_db": "{ unset = true }", "sonar.sidescan.focused": "true",
    "sonar.sidescan.array_length_m": "4", "sonar.sidescan.bandwidth_hz": "100e3",
    "motion.roll.wander_deg": "0", "motion.heading.wander_deg": "0", "motion.heave.wander_m": "0",
    "display.smoothing_px": "0",
}

# The datasets and what each changes in the recipe.
DATASETS = {"all": {}, "few_shapes": FEW_SHAPES, "without_physics": NO_PHYSICS}

# A row's dataset, its crops, its batches, and whether it has all samples.
ROWS = {
    "few shapes": ("few_shapes", "whole", SHORT, False),
    "shapes": ("all", "whole", SHORT, False),
    "chips": ("all", "body", SHORT, False),
    "long training": ("all", "body", LONG, False),
    "more samples": ("all", "body", LONG, True),
    "without physics": ("without_physics", "body", SHORT, False),
}


def made(program, out, name, samples):
    """The folder of the dataset, made if it is not there."""
    folder = out / name
    if len(list(folder.glob("samples/*/sample.json"))) >= samples:
        return folder
    settings = {"dataset.samples": samples, "dataset.seafloors": samples, **DATASETS[name]}
    recipe = str(SCENES / "transfer_targets.toml")
    command = [program, "generate", recipe, "-o", str(folder), "--quiet"]
    for key, value in settings.items():
        command += ["-D", f"{key}={value}"]
    done = subprocess.run(command)
    if done.returncode not in (0, 3):  # 3: some samples failed
        sys.exit(f"{' '.join(command)}\nfailed with exit code {done.returncode}")
    return folder


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("out", type=Path)
    parser.add_argument("--real", action="append", type=Path, required=True)
    parser.add_argument("--samples", type=int, default=320)
    parser.add_argument("--few", type=int, default=150, help="samples of all rows but one")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--only", nargs="+", choices=list(ROWS), default=list(ROWS))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    results = options.out / "results.json"
    for name in options.only:
        dataset, crop, steps, all_samples = ROWS[name]
        most = options.samples if all_samples else options.few
        folder = made(options.program, options.out, dataset,
                      options.samples if dataset == "all" else most)
        found = run([folder], options.real, ["aircraft", "wreck"], {"boat": "wreck"}, options.seeds,
                    steps, crop, most)
        found["samples"] = most
        every = json.loads(results.read_text()) if results.exists() else {}
        every[name] = found
        results.write_text(json.dumps(every, indent=1) + "\n")
        for judge in ("network", "statistics"):
            for where, its in found[judge].items():
                print(line(f"{name}, {judge}, {where}", its), flush=True)


if __name__ == "__main__":
    main()
