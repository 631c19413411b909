#!/usr/bin/env python3
"""A blind judgement: crops of real and simulated pictures, mixed, and the score of one who judges.

    blind.py make DATA FOLDER RUN...     writes 60 crops, half of them real, sheets and a key
    blind.py match FOLDER (RECORDING IMITATED)...
                                         the same, of recorded samples and of their imitation
    blind.py objects FOLDER REAL DATASET the same, of pictures of objects
    blind.py score FOLDER                reads FOLDER/answers.txt and prints the accuracy

DATA is the folder of real images, as for judge.py; each RUN the folder of a run, whose first
picture is taken. A crop has 256 x 256 pixels, is grey, reduced to half its size, so that enlarged
or smoothed pixels of a display give less hint, and stretched from its 1st to its 99th percentile, so that
palette and gain give no hint. It may have objects, shadows and some water column. Sources have equal numbers of crops. key.json is not to be opened before answers.txt is
written: a line per crop, its number and `real`, `simulated` or how surely it is real, in percent.
The interval is Wilson's, of 95 %. A judge who sees whole sheets finds groups of real crops with the
same display; one who sees single crops (NN.png) does not.

`match` takes recordings and the XTF files of runs of what `ensonify imitate` made of them. Both have
the same pings and samples, and a crop has the same 128 x 128 of them in either. Only bed without
objects and shadows counts, because these are not imitated. It needs the Python module.

`objects` takes REAL, which has one folder of pictures per class (bench/transfer/cut_boxes.py cuts them
from pictures with boxes), and a DATASET with chips of these classes, as scenes/transfer_targets.toml
makes. Classes have equal numbers of crops. All are reduced to 128 x 128 pixels and stretched as above.
"""

import json
import math
import random
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from judge import real_sources

CROPS, SIDE, SEED = 60, 256, 30
MOST_FAILED = 20  # draws without bed, after which a source is left out
MATCHED = 128  # pings and samples of a crop
PER_SHEET, PER_ROW, SHOWN_PX = 20, 5, 256


def stretched(values):
    """A grey picture from the 1st percentile of the values to the 99th."""
    low, high = np.percentile(values, [1, 99])
    scaled = np.clip((values - low) / max(high - low, 1e-9), 0.0, 1.0)
    return Image.fromarray((255.0 * scaled).astype(np.uint8))


def crop_of(path, draw):
    """A crop that is bed for the most part; None if ten places have none, or the picture is too small."""
    picture = np.asarray(Image.open(path).convert("L"), dtype=float)
    height, width = picture.shape
    height = int(0.75 * height) if "garmin" in str(path) else height  # lettering below
    if min(height, width) < SIDE:
        return None
    for _ in range(10):
        top, left = draw.randrange(height - SIDE + 1), draw.randrange(width - SIDE + 1)
        crop = picture[top:top + SIDE, left:left + SIDE]
        blobs = crop.reshape(SIDE // 8, 8, SIDE // 8, 8).mean((1, 3))
        bright = max(20.0, 0.5 * np.percentile(picture, 75))  # not the water column
        if np.median(crop) > bright and (blobs < 0.3 * np.median(blobs)).mean() < 0.25:
            half = crop.reshape(SIDE // 2, 2, SIDE // 2, 2).mean((1, 3))
            return stretched(half)
    return None


def crops_of(sources, count, draw):
    """Crops with their sources' names, in turns, without the sources whose pictures show too little bed."""
    found, names, failed = [], sorted(sources), dict.fromkeys(sources, 0)
    while names and len(found) < count:
        name = names[len(found) % len(names)]
        crop = crop_of(draw.choice(sources[name]), draw)
        if crop:
            found.append((name, crop))
            continue
        failed[name] += 1
        if failed[name] == MOST_FAILED:
            names.remove(name)
    if len(found) < count:
        sys.exit(f"only {len(found)} of {count} crops show bed; give more pictures")
    return found


def make(data, folder, runs):
    simulated = {}
    for run in runs:
        pictures = [path for path in sorted(Path(run).glob("*.png")) if "truth" not in path.name]
        if not pictures:
            sys.exit(f"{run}: has no picture; give folders that `ensonify run` wrote")
        simulated[run] = pictures[:1]
    real = real_sources(data)
    if not real:
        sys.exit(f"{data}: has no real_images and sidescan/*.png; name the folder that holds them")
    draw = random.Random(SEED)
    order = list(simulated)
    draw.shuffle(order)  # so that not only the first runs by name are shown
    simulated = {f"{i:03}": simulated[run] for i, run in enumerate(order)}
    crops = [("real", *one) for one in crops_of(real, CROPS // 2, draw)]
    crops += [("simulated", order[int(name)], crop)
              for name, crop in crops_of(simulated, CROPS // 2, draw)]
    draw.shuffle(crops)
    write(folder, crops)


def sides_of(path):
    """The samples of a recording, by side, pings x samples, with the far edge left to port."""
    import ensonify
    line = ensonify.read_recording(str(path))[0]
    return {"port": np.asarray(line.port, dtype=float)[:, ::-1],
            "starboard": np.asarray(line.starboard, dtype=float)}


def plain_bed(samples):
    """Whether blobs differ little from the others at their range."""
    blobs = samples.reshape(MATCHED // 8, 8, MATCHED // 8, 8).mean((1, 3))
    over = blobs / np.median(blobs, axis=0)
    levels = np.median(blobs, axis=0)
    return over.min() > 0.3 and over.max() < 2.5 and levels.min() > 0.1 * levels.max()


def match(folder, pairs):
    lines = [{"real": sides_of(real), "simulated": sides_of(made), "name": real}
             for real, made in pairs]
    for line in lines:
        shapes = {kind: line[kind]["port"].shape for kind in ("real", "simulated")}
        if shapes["real"] != shapes["simulated"]:
            sys.exit(f"{line['name']}: its imitation has other pings or samples: {shapes}")
    draw = random.Random(SEED)
    kinds = CROPS // 2 * ["real", "simulated"]
    draw.shuffle(kinds)
    crops = []
    for _ in range(100 * CROPS):
        line, side = lines[len(crops) % len(lines)], draw.choice(["port", "starboard"])
        pings, samples = line["real"][side].shape
        top, left = draw.randrange(pings - MATCHED + 1), draw.randrange(samples - MATCHED + 1)
        both = {kind: line[kind][side][top:top + MATCHED, left:left + MATCHED]
                for kind in ("real", "simulated")}
        if all(map(plain_bed, both.values())):
            crops.append((kinds[len(crops)], f"{line['name']} {side} {top} {left}",
                          stretched(np.sqrt(both[kinds[len(crops)]]))))
        if len(crops) == CROPS:
            return write(folder, crops)
    sys.exit(f"only {len(crops)} of {CROPS} crops show plain bed; give more recordings")


def reduced(path):
    """The brightness of a picture of an object, MATCHED x MATCHED pixels."""
    picture = Image.open(path).convert("L").resize((MATCHED, MATCHED), Image.BOX)
    return np.asarray(picture, dtype=float)


def objects_of(real, dataset):
    """Pictures of objects by kind, "real" or "simulated", and class."""
    pictures = {"real": {}, "simulated": {}}
    for kind in sorted(path for path in real.iterdir() if path.is_dir()):
        pictures["real"][kind.name] = sorted(kind.glob("*.png"))
        pictures["simulated"][kind.name] = []
    for file in sorted(dataset.glob("samples/*/chips/*.json")):
        of = json.loads(file.read_text())["of"]
        if of in pictures["simulated"]:
            pictures["simulated"][of].append(file.with_suffix(".png"))
    return pictures


def objects(folder, real, dataset):
    pictures = objects_of(real, dataset)
    draw, crops = random.Random(SEED), []
    for kind, by_class in pictures.items():
        each = CROPS // 2 // max(len(by_class), 1)
        for name, paths in by_class.items():
            if len(paths) < each:
                sys.exit(f"{len(paths)} {kind} pictures of class {name}, {each} are needed")
            crops += [(kind, str(path), stretched(reduced(path)))
                      for path in draw.sample(paths, each)]
    draw.shuffle(crops)
    write(folder, crops)


def write(folder, crops):
    """The crops, each with its kind and source, their sheets and the key."""
    folder.mkdir(parents=True, exist_ok=True)
    key = {}
    for begin in range(0, CROPS, PER_SHEET):
        sheet = Image.new("L", (PER_ROW * (SHOWN_PX + 8),
                                PER_SHEET // PER_ROW * (SHOWN_PX + 20)), 255)
        for i, (kind, source, crop) in enumerate(crops[begin:begin + PER_SHEET]):
            number = f"{begin + i + 1:02}"
            key[number] = {"kind": kind, "source": source}
            crop.save(folder / f"{number}.png")
            left, top = i % PER_ROW * (SHOWN_PX + 8), i // PER_ROW * (SHOWN_PX + 20)
            sheet.paste(crop.resize((SHOWN_PX, SHOWN_PX), Image.NEAREST), (left, top + 14))
            ImageDraw.Draw(sheet).text((left, top), number, fill=0)
        sheet.save(folder / f"sheet_{begin // PER_SHEET + 1}.png")
    (folder / "key.json").write_text(json.dumps(key, indent=1) + "\n")
    print(f"{folder}: {CROPS} crops; look at sheet_*.png and write answers.txt")


def wilson(right, count, z=1.96):
    """Wilson's interval of a share, from which `right` of `count` were drawn."""
    share, spread = right / count, z * z / count
    middle = (share + spread / 2) / (1 + spread)
    half = z / (1 + spread) * math.sqrt(share * (1 - share) / count + spread / (4 * count))
    return middle - half, middle + half


def score(folder):
    key = json.loads((folder / "key.json").read_text())
    words = {"real": 100.0, "simulated": 0.0}
    lines = (folder / "answers.txt").read_text().splitlines()
    try:  # how surely each crop is real, in percent
        answers = {number: words[answer] if answer in words else float(answer)
                   for number, answer in map(str.split, lines)}
    except ValueError:
        answers = {}
    if set(answers) != set(key) or not all(0.0 <= value <= 100.0 for value in answers.values()):
        sys.exit(f"{folder}/answers.txt: expected a line with `real`, `simulated` or a percentage "
                 f"for each of the numbers 01 to {len(key)}")

    def right(number):  # 50 percent is half right
        real = key[number]["kind"] == "real"
        sure = answers[number] if real else 100.0 - answers[number]
        return float(sure > 50.0) + 0.5 * float(sure == 50.0)

    total = sum(map(right, key))
    low, high = wilson(total, len(key))
    print(f"accuracy {total / len(key):.3f} ({total:g} of {len(key)}), 95 % interval {low:.3f} to "
          f"{high:.3f}")
    sure = {kind: [answers[n] for n in key if key[n]["kind"] == kind]
            for kind in ("real", "simulated")}
    for kind, its in sure.items():
        print(f"{kind}: {sum(right(n) for n in key if key[n]['kind'] == kind):g} of {len(its)} "
              "right")
    pairs = [(real > ours) + 0.5 * (real == ours)
             for real in sure["real"] for ours in sure["simulated"]]
    print(f"area under the curve {sum(pairs) / len(pairs):.3f}")
    for number, one in key.items():
        if right(number) < 1.0:
            print(f"wrong: {number}, {one['kind']}, {Path(one['source']).name}, "
                  f"{answers[number]:g} % real")


def main():
    arguments = sys.argv[1:]
    if len(arguments) >= 4 and arguments[0] == "make":
        make(Path(arguments[1]), Path(arguments[2]), arguments[3:])
    elif len(arguments) >= 4 and len(arguments) % 2 == 0 and arguments[0] == "match":
        match(Path(arguments[1]), list(zip(arguments[2::2], arguments[3::2])))
    elif len(arguments) == 4 and arguments[0] == "objects":
        objects(*map(Path, arguments[1:]))
    elif len(arguments) == 2 and arguments[0] == "score":
        score(Path(arguments[1]))
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
