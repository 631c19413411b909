#!/usr/bin/env python3
"""How bright targets and their shadows are in pictures of objects, real and simulated.

    levels.py REAL DATASET

REAL and DATASET are as for `blind.py objects`. A picture is reduced to 128 x 128 pixels. Its border,
24 pixels wide, counts as bed, and its middle, 64 x 64, as target. The script prints for each
class the quartiles over the real and over the simulated pictures of

    bed       the border's median brightness, of 255
    bed_95    the border's 95th percentile over that median
    target_90 the middle's 90th percentile over it
    target_97 the middle's 97th percentile over it
    shadow_5  the middle's 5th percentile over it
    black     the share of pixels that are at most 8 of 255
"""

import sys
from pathlib import Path

import numpy as np

from blind import MATCHED, objects_of, reduced

BORDER, BLACK = 24, 8


def levels(path):
    picture = reduced(path)
    border = np.ones(picture.shape, dtype=bool)
    border[BORDER:-BORDER, BORDER:-BORDER] = False
    quarter = MATCHED // 4
    middle = picture[quarter:-quarter, quarter:-quarter]
    bed = max(np.median(picture[border]), 1.0)
    return {"bed": bed, "bed_95": np.percentile(picture[border], 95) / bed,
            "target_90": np.percentile(middle, 90) / bed,
            "target_97": np.percentile(middle, 97) / bed,
            "shadow_5": np.percentile(middle, 5) / bed, "black": (picture <= BLACK).mean()}


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    print("class,level,real_25,real_50,real_75,ours_25,ours_50,ours_75")
    pictures = objects_of(Path(sys.argv[1]), Path(sys.argv[2]))
    for name in pictures["real"]:
        found = {}
        for kind, by_class in pictures.items():
            if not by_class[name]:
                sys.exit(f"no {kind} pictures of class {name}")
            found[kind] = [levels(path) for path in by_class[name]]
        for level in found["real"][0]:
            quartiles = [f"{value:.3g}" for its in found.values()
                         for value in np.percentile([one[level] for one in its], [25, 50, 75])]
            print(name, level, *quartiles, sep=",")


if __name__ == "__main__":
    main()
