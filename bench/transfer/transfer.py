#!/usr/bin/env python3
"""Trains a small network on our images alone and tests it on real ones.

    transfer.py DATASET... --real FOLDER [--real FOLDER] [OPTIONS]

DATASET is what `ensonify generate` wrote, with chips or tiles. FOLDER has one folder of pictures
per class, named as in the dataset; `seabed` stands for pictures without a target. Each FOLDER is
reported separately. Nothing is fitted to real pictures: the network sees them once, at the end.
Prints, as the mean over the network's seeds, the balanced accuracy (the mean over the classes of
the share that is named correctly) and the area under the curve (each class against the others,
averaged). Both are 0.5 by chance with two classes. Then prints the same for a linear discriminant
of simple statistics, on the same pictures.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy
from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "realism"))
from judge import judged, statistics  # noqa: E402

try:
    import torch
    from torch import nn
    from torch.nn import functional
except ImportError:
    sys.exit("transfer.py needs PyTorch: apt install --no-install-recommends python3-torch")

SIDE = 64  # of the pictures that the network sees, in pixels
CHIP = 96  # of those that it is trained on, before they are cropped
SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")


# ---- Our images.

def ours(datasets, classes, same, samples=None):
    """Pictures (CHIP x CHIP bytes), numbers of their classes, boxes of their targets as shares of
    the picture (left, top, width, height; the whole one for seabed), and whether they are for
    training."""
    pictures, labels, boxes, for_training = [], [], [], []
    for dataset in datasets:
        folders = sorted(file.parent for file in dataset.glob("samples/*/sample.json"))[:samples]
        if not folders:
            sys.exit(f"{dataset}: has no samples/*/sample.json; name a folder that "
                     "`ensonify generate` wrote, without samples_per_tar")
        for file in (f for folder in folders for f in sorted(folder.glob("[ct]*s/*.json"))):
            image = json.loads(file.read_text())
            found = what(image, same)
            if found is None or found[0] not in classes:
                continue
            for name in image["pictures"]:
                picture = Image.open(file.parents[1] / name).convert("L")
                pictures.append(numpy.asarray(picture.resize((CHIP, CHIP), Image.BOX)))
                labels.append(classes.index(found[0]))
                boxes.append(found[1])
                for_training.append(image["split"] == "train")
    for number, name in enumerate(classes):
        if (number, True) not in zip(labels, for_training):
            sys.exit(f"the datasets have no chips of class {name} for training, but the real "
                     "folders have it; --classes names those to compare, and --same OTHER=CLASS "
                     "renames one")
    return (torch.from_numpy(numpy.stack(pictures)), torch.tensor(labels),
            torch.tensor(boxes, dtype=torch.float32), torch.tensor(for_training))


def what(image, same):
    """The class and the box of an image of a dataset, or None if it is of no use."""
    whole = [0.0, 0.0, 1.0, 1.0]
    if image["kind"] != "chip":
        return None if image["targets"] else ("seabed", whole)
    of = [t for t in image["targets"] if t["class"] == image["of"] and "body" in t]
    if not of:
        return None
    left, top, width, height = max((t["body"]["box"] for t in of), key=lambda box: box[2] * box[3])
    box = [left / image["width"], top / image["height"],
           width / image["width"], height / image["height"]]
    return same.get(image["of"], image["of"]), box


def even(pictures):
    """Every picture with mean 0 and deviation 1, cut off at 2.5 deviations and made even again:
    ours and real ones in the same way."""
    flat = pictures.flatten(1)
    for most in (2.5, None):
        flat = (flat - flat.mean(1, keepdim=True)) / (flat.std(1, keepdim=True) + 1e-3)
        flat = flat if most is None else flat.clamp(-most, most)
    return flat.view_as(pictures)


def between(low, high, count, draw):
    return low + (high - low) * torch.rand(count, generator=draw)


def varied(pictures, boxes, draw, crop="body"):
    """SIDE x SIDE crops about the targets (or of whole chips): turned by quarters and a little
    more, mirrored, stretched, and with another brightness, sharpness and noise."""
    n = len(pictures)
    images = pictures[:, None].float() / 255.0
    wide = boxes[:, 2:].max(1).values
    side = (wide * between(1.0, 2.0, n, draw)).clamp(0.15, 1.0)
    middle = boxes[:, :2] + 0.5 * boxes[:, 2:]
    if crop == "whole":
        side, middle = torch.ones(n), torch.full((n, 2), 0.5)
    loose = (side - wide).clamp(min=0.0)[:, None]
    middle = middle + loose * (torch.rand((n, 2), generator=draw) - 0.5) * 0.8
    quarter = torch.randint(0, 4, (n,), generator=draw).float() * (numpy.pi / 2)
    angle = quarter + between(-0.2, 0.2, n, draw)
    mirror = 1.0 - 2.0 * torch.randint(0, 2, (n,), generator=draw).float()
    stretch = torch.exp(between(-0.3, 0.3, n, draw))
    turn = torch.stack([torch.cos(angle), -torch.sin(angle), torch.sin(angle), torch.cos(angle)], 1)
    scale = torch.stack([side * stretch * mirror, side / stretch], 1)
    matrix = turn.view(n, 2, 2) * scale[:, None, :]
    shift = (2.0 * middle - 1.0)[:, :, None]
    grid = functional.affine_grid(torch.cat([matrix, shift], 2), (n, 1, SIDE, SIDE),
                                  align_corners=False)
    # Means of 2 x 2 pixels for crops that shrink the chip.
    halved = functional.interpolate(functional.avg_pool2d(images, 2), scale_factor=2.0)
    small = (side > 0.75)[:, None, None, None]
    images = torch.where(small, halved, images)
    images = functional.grid_sample(images, grid, padding_mode="reflection", align_corners=False)
    for blurred in (functional.avg_pool2d(images, 3, 1, 1),
                    functional.interpolate(functional.avg_pool2d(images, 2), scale_factor=2.0,
                                           mode="bilinear", align_corners=False)):
        chosen = (torch.rand(n, generator=draw) < 0.25)[:, None, None, None]
        images = torch.where(chosen, blurred, images)
    speckle = between(0.0, 0.35, n, draw)[:, None, None, None]
    images = images * (1.0 + speckle * torch.randn(images.shape, generator=draw)).clamp(min=0.0)
    gain = torch.exp(between(-0.6, 0.9, n, draw))[:, None, None, None]
    gamma = torch.exp(between(-0.6, 0.6, n, draw))[:, None, None, None]
    return even((images * gain).clamp(1e-4, 1.0) ** gamma)


# ---- Real images.

def real(folder, classes):
    """Pictures (SIDE x SIDE, 0 to 1), stretched to squares, and numbers of their classes."""
    pictures, labels = [], []
    for number, name in enumerate(classes):
        paths = [p for p in sorted((folder / name).glob("*")) if p.suffix.lower() in SUFFIXES]
        if not paths:
            sys.exit(f"{folder / name}: has no pictures ({' '.join(SUFFIXES)})")
        for path in paths:
            picture = Image.open(path).convert("L").resize((SIDE, SIDE), Image.BILINEAR)
            pictures.append(numpy.asarray(picture, dtype=numpy.float32) / 255.0)
            labels.append(number)
    return torch.from_numpy(numpy.stack(pictures)), numpy.array(labels)


# ---- The network.

def network(classes):
    layers, width = [], 1
    for wider, size, stride in ((16, 5, 2), (32, 3, 1), (64, 3, 1), (96, 3, 1)):
        layers += [nn.Conv2d(width, wider, size, stride, size // 2, bias=False),
                   nn.BatchNorm2d(wider), nn.ReLU(), nn.MaxPool2d(2)]
        width = wider
    return nn.Sequential(*layers, nn.Flatten(), nn.Dropout(0.4), nn.Linear(4 * width, classes))


def trained(data, classes, seed, steps, crop):
    """A network after `steps` batches of 32 pictures, each class as often as the others."""
    pictures, labels, boxes, for_training = data
    torch.manual_seed(seed)
    draw = torch.Generator().manual_seed(seed)
    model = network(classes)
    optimiser = torch.optim.AdamW(model.parameters(), 2e-3, weight_decay=0.02)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, 4e-3, total_steps=steps)
    of_class = [torch.nonzero((labels == k) & for_training)[:, 0] for k in range(classes)]
    each = 32 // classes
    model.train()
    for _ in range(steps):
        chosen = torch.cat([of[torch.randint(0, len(of), (each,), generator=draw)]
                            for of in of_class])
        images = varied(pictures[chosen], boxes[chosen], draw, crop)
        loss = functional.cross_entropy(model(images), labels[chosen], label_smoothing=0.1)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
    return model.eval()


@torch.no_grad()
def scores(model, images):
    """Probabilities of the classes, averaged over the eight turns and mirror images."""
    images = even(images)[:, None]
    total = 0.0
    for turns in range(4):
        turned = torch.rot90(images, turns, (2, 3))
        total = total + model(turned).softmax(1) + model(turned.flip(3)).softmax(1)
    return (total / 8.0).numpy()


# ---- Measures.

def balanced_accuracy(labels, score):
    chosen = score.argmax(1)
    return float(numpy.mean([(chosen[labels == k] == k).mean() for k in numpy.unique(labels)]))


def area_under_curve(labels, score):
    """Of each class against the others, averaged; equal scores count half."""
    areas = []
    for k in range(score.shape[1]):
        own, other = score[labels == k, k], score[labels != k, k]
        more = (own[:, None] > other).mean() + 0.5 * (own[:, None] == other).mean()
        areas.append(more)
    return float(numpy.mean(areas))


def interval(labels, all_scores, measure, times=400):
    """95 % of the mean over the seeds, for other pictures of the same kind (bootstrap by class)."""
    draw = numpy.random.default_rng(1)
    of_class = [numpy.flatnonzero(labels == k) for k in numpy.unique(labels)]
    found = []
    for _ in range(times):
        chosen = numpy.concatenate([draw.choice(of, len(of)) for of in of_class])
        found.append(numpy.mean([measure(labels[chosen], score[chosen]) for score in all_scores]))
    return [float(v) for v in numpy.percentile(found, [2.5, 97.5])]


def measured(labels, all_scores):
    """Mean and each seed's value of both measures, with intervals."""
    found = {}
    for name, measure in (("balanced_accuracy", balanced_accuracy), ("auc", area_under_curve)):
        each = [measure(labels, score) for score in all_scores]
        found[name] = {"mean": float(numpy.mean(each)), "seeds": each,
                       "interval": interval(labels, all_scores, measure)}
    found["pictures"] = [int((labels == k).sum()) for k in numpy.unique(labels)]
    return found


def by_statistics(data, classes, folders):
    """The same measures of Fisher's discriminant of the statistics of bench/realism/judge.py."""
    pictures, labels, boxes, for_training = data
    draw = torch.Generator().manual_seed(1)
    rows = torch.nonzero(for_training)[:, 0]
    crops = varied(pictures[rows], boxes[rows], draw)
    described = numpy.array([described_by_statistics(crop) for crop in crops[:, 0].numpy()])
    found = {}
    for name, (images, its) in folders.items():
        test = numpy.array([described_by_statistics(crop) for crop in even(images).numpy()])
        score = []
        for k in range(classes):
            of = (labels[rows] == k).numpy().astype(int)
            both = judged(described, of, numpy.concatenate([described, test]))
            middle = 0.5 * (both[:len(of)][of == 0].mean() + both[:len(of)][of == 1].mean())
            score.append(both[len(of):] - middle)
        found[name] = measured(its, [numpy.stack(score, 1)])
    return found


def described_by_statistics(crop):
    """judge.py describes brightness from 0 up; an even crop has mean 0 and deviation 1."""
    return list(statistics(numpy.maximum(crop.astype(float) + 2.0, 0.0)).values())


def run(datasets, folders, classes, same, seeds, steps, crop="body", samples=None):
    """The result for a dataset, as a table for JSON."""
    data = ours(datasets, classes, same, samples)
    tests = {str(folder.name): real(folder, classes) for folder in folders}
    training = data[3]
    result = {"classes": classes, "steps": steps, "crop": crop,
              "training_pictures": [int(((data[1] == k) & training).sum())
                                    for k in range(len(classes))]}
    every = {name: [] for name in tests}
    own = []
    held = torch.nonzero(~training)[:, 0]
    for seed in range(1, seeds + 1):
        model = trained(data, len(classes), seed, steps, crop)
        for name, (images, _) in tests.items():
            every[name].append(scores(model, images))
        if len(held):
            draw = torch.Generator().manual_seed(1)
            images = varied(data[0][held], data[2][held], draw, crop)[:, 0]
            own.append(scores(model, images))
    result["network"] = {name: measured(labels, every[name])
                         for name, (_, labels) in tests.items()}
    if own:
        result["network"]["held out of ours"] = measured(data[1][held].numpy(), own)
    result["statistics"] = by_statistics(data, len(classes), tests)
    return result


def line(name, found):
    accuracy, auc = found["balanced_accuracy"], found["auc"]
    return (f"{name:40} balanced accuracy {accuracy['mean']:.2f} "
            f"({accuracy['interval'][0]:.2f} to {accuracy['interval'][1]:.2f}), "
            f"AUC {auc['mean']:.2f} ({auc['interval'][0]:.2f} to {auc['interval'][1]:.2f}), "
            f"pictures {found['pictures']}")


def renamed(texts):
    for text in texts:
        if "=" not in text:
            sys.exit(f"--same {text}: give OTHER=CLASS, such as boat=wreck")
    return dict(text.split("=", 1) for text in texts)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("datasets", nargs="+", type=Path)
    parser.add_argument("--real", action="append", type=Path, required=True)
    parser.add_argument("--classes", nargs="+", help="default: the folders of the first FOLDER")
    parser.add_argument("--same", action="append", default=[], help="OTHER=CLASS: is CLASS too")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--steps", type=int, default=800, help="batches of 32 pictures")
    parser.add_argument("--crop", choices=["body", "whole"], default="body",
                        help="training on crops about the targets, or on whole chips")
    parser.add_argument("--samples", type=int, help="of each dataset; default: all")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    first = options.real[0]
    classes = options.classes or sorted(p.name for p in first.glob("*") if p.is_dir())
    if len(classes) < 2:
        sys.exit(f"{first}: needs a folder of pictures for each of two classes or more")
    result = run(options.datasets, options.real, classes, renamed(options.same), options.seeds,
                 options.steps, options.crop, options.samples)
    for name, found in result["network"].items():
        print(line(f"network, {name}", found))
    for name, found in result["statistics"].items():
        print(line(f"statistics, {name}", found))
    print("always the most frequent class: balanced accuracy "
          f"{1.0 / len(classes):.2f}, AUC 0.50")
    if options.json:
        options.json.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
