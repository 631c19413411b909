#!/usr/bin/env python3
"""Cuts pictures with YOLO boxes into the folders per class that transfer.py reads.

    cut_boxes.py IMAGES LABELS OUT NUMBER=CLASS... [--margin 0.15] [--seabed 0] [--not-in DIR]

IMAGES has the pictures, LABELS a text file of the same name for each: lines of class number,
middle and size of a box, as shares of the picture. Each box becomes a square about it,
OUT/CLASS/NAME_0.png, with `margin` of its longer side on each side, shifted into the picture where
it sticks out. With `--seabed N` up to N squares per picture that meet no box go to OUT/seabed. A
square that looks the same as one in OUT, or as one in a folder of `--not-in`, is left out.
"""

import argparse
import random
import sys
from pathlib import Path

import numpy
from PIL import Image

SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")


def look_of(picture):
    """16 x 16 pixels with mean 0 and length 1."""
    small = numpy.asarray(picture.resize((16, 16), Image.BOX), dtype=float)
    small -= small.mean()
    return small / max(float(numpy.sqrt((small**2).sum())), 1e-9)


class Folder:
    """Where squares are written; knows those that it has."""

    def __init__(self, out, others):
        self.out, self.repeats = out, 0
        known = [path for folder in (out, *others) for path in sorted(folder.glob("*/*.png"))]
        self.looks = [look_of(Image.open(path).convert("L")) for path in known]

    def add(self, square, name, file):
        look = look_of(square)
        if any(float((look * other).sum()) > 0.75 for other in self.looks):
            self.repeats += 1
            return
        self.looks.append(look)
        (self.out / name).mkdir(parents=True, exist_ok=True)
        square.save(self.out / name / file)


def square_about(x, y, side, width, height):
    """Left, top, right and bottom of a square within the picture."""
    side = min(side, width, height)
    left = min(max(x - side / 2, 0), width - side)
    top = min(max(y - side / 2, 0), height - side)
    return [round(v) for v in (left, top, left + side, top + side)]


def free_squares(boxes, width, height, most, draw):
    """Squares of a fifth to two fifths of the picture that meet no box."""
    found = []
    for _ in range(40):
        side = draw.uniform(0.2, 0.4) * min(width, height)
        x, y = draw.uniform(side / 2, width - side / 2), draw.uniform(side / 2, height - side / 2)
        square = square_about(x, y, side, width, height)
        meets = any(square[0] < box[2] and box[0] < square[2] and
                    square[1] < box[3] and box[1] < square[3] for box in boxes + found)
        if not meets and len(found) < most:
            found.append(square)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("images", type=Path)
    parser.add_argument("labels", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("classes", nargs="+")
    parser.add_argument("--margin", type=float, default=0.15)
    parser.add_argument("--seabed", type=int, default=0)
    parser.add_argument("--not-in", type=Path, action="append", default=[])
    options = parser.parse_args()
    for given in options.classes:
        if "=" not in given:
            sys.exit(f"{given}: give the class as NUMBER=CLASS, such as 10=wreck")
    names = dict(given.split("=", 1) for given in options.classes)
    pictures = [p for p in sorted(options.images.glob("*")) if p.suffix.lower() in SUFFIXES]
    if not pictures:
        sys.exit(f"{options.images}: has no pictures ({' '.join(SUFFIXES)})")
    folder, draw = Folder(options.out, options.not_in), random.Random(1)
    for path in pictures:
        picture = Image.open(path).convert("L")
        width, height = picture.size
        labels = options.labels / (path.stem + ".txt")
        lines = labels.read_text().splitlines() if labels.exists() else []
        boxes = []
        for k, line in enumerate(lines):
            number, *place = line.split()[:5]
            x, y, wide, high = (float(v) for v in place)
            x, y, wide, high = x * width, y * height, wide * width, high * height
            boxes.append((x - wide / 2, y - high / 2, x + wide / 2, y + high / 2))
            if number in names:
                side = max(wide, high) * (1 + 2 * options.margin)
                square = picture.crop(square_about(x, y, side, width, height))
                folder.add(square, names[number], f"{path.stem}_{k}.png")
        for k, square in enumerate(free_squares(boxes, width, height, options.seabed, draw)):
            crop = picture.crop(square)
            if numpy.asarray(crop).std() > 4:  # neither blank nor water
                folder.add(crop, "seabed", f"{path.stem}_seabed_{k}.png")
    for name in sorted(p.name for p in options.out.glob("*") if p.is_dir()):
        print(f"{name}: {len(list((options.out / name).glob('*.png')))} pictures")
    print(f"left out as repeats: {folder.repeats}")


if __name__ == "__main__":
    main()
