#!/usr/bin/env python3
"""Whether a linear judge can distinguish the pictures of runs from real ones.

    judge.py DATA RUN...

DATA is the folder of real images (real_images/{sdvd,garmin,klsg} and sidescan/*.png), each RUN the
folder of a run, whose first picture is taken. Crops of 64 x 64 pixels of the bed are described by
simple statistics; a linear discriminant is fitted to all sources but one real and one run, and
judges these. Prints, for each statistic, the least and greatest median of the real sources and the
median of the runs; then the area under the judge's curve: 0.5 is chance, 1 always right.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

SIDE = 64
LAGS = (1, 2, 4, 8)


def local_mean(crop, size=9):
    """Mean over size x size pixels, the border repeated."""
    padded = np.pad(crop, size // 2, mode="edge")
    sums = np.pad(padded, ((1, 0), (1, 0))).cumsum(0).cumsum(1)
    return (sums[size:, size:] - sums[:-size, size:] - sums[size:, :-size]
            + sums[:-size, :-size]) / size**2


def skew(values):
    off = values - values.mean()
    return (off**3).mean() / max((off**2).mean(), 1e-12) ** 1.5


def kurtosis(values):
    off = values - values.mean()
    return (off**4).mean() / max((off**2).mean(), 1e-12) ** 2 - 3.0


def slope(crop):
    """Exponent of the power spectrum along the range, from 1 to 8 cycles per crop."""
    power = (np.abs(np.fft.rfft(crop - crop.mean(), axis=1)) ** 2).mean(0)[1:9]
    return np.polyfit(np.log(np.arange(1, 9)), np.log(np.maximum(power, 1e-12)), 1)[0]


def statistics(crop):
    mean = np.maximum(local_mean(crop), 1e-3)
    rest = crop / mean - 1.0
    variance = max((rest**2).mean(), 1e-12)
    found = {"contrast": rest.std(), "skew": skew(rest), "kurtosis": kurtosis(rest),
             "bright": (crop > 2.0 * mean).mean(), "dark": (crop < 0.3 * mean).mean()}
    for lag in LAGS:
        found[f"range_correlation_{lag}"] = (rest[:, lag:] * rest[:, :-lag]).mean() / variance
        found[f"track_correlation_{lag}"] = (rest[lag:] * rest[:-lag]).mean() / variance
    blobs = crop.reshape(SIDE // 8, 8, SIDE // 8, 8).mean((1, 3))
    found["blob_skew"] = skew(blobs)
    found["blob_contrast"] = blobs.std() / blobs.mean()
    found["slope"] = slope(crop)
    rows = crop.mean(1)
    found["row_brightness"] = np.abs(np.diff(rows)).mean() / rows.mean()
    return found


def shows_bed(crop):
    """Whether a crop is neither dark nor saturated, and without lettering, lines or a blank panel."""
    blobs = crop.reshape(8, 8, 8, 8).mean((1, 3))
    even = blobs.min() > 0.3 * np.percentile(blobs, 90)
    drawn = any((crop.std(axis) < 0.01 * crop.mean(axis)).any() for axis in (0, 1))
    return crop.mean() > 0.08 and (crop > 0.99).mean() < 0.1 and even and not drawn


def crops_of(path, most=24):
    """Crops that show bed. Left out are those much darker than most, which show the water column."""
    picture = np.asarray(Image.open(path).convert("L"), dtype=float) / 255.0
    found = [picture[top:top + SIDE, left:left + SIDE]
             for top in range(0, picture.shape[0] - SIDE + 1, SIDE)
             for left in range(0, picture.shape[1] - SIDE + 1, SIDE)]
    found = [crop for crop in found if shows_bed(crop)]
    middle = np.median([crop.mean() for crop in found]) if found else 0.0
    found = [crop for crop in found if crop.mean() > 0.3 * middle]
    step = max(1, len(found) // most)
    return found[::step][:most]


def real_sources(data):
    """Name and picture of each real source; the many pictures of one sonar are one source."""
    images = data / "real_images"
    listed = {"scotsman": sorted((data / "sidescan").glob("*.png")),
              "sdvd": sorted((images / "sdvd" / "images").glob("*")),
              "garmin": sorted((images / "garmin").glob("*.jpg")),
              "klsg": sorted((images / "klsg").glob("*/images/*"))}
    return {name: paths for name, paths in listed.items() if paths}


def described(paths, most):
    each = max(2, most // len(paths))
    rows = [list(statistics(crop).values()) for path in paths for crop in crops_of(path, each)]
    return np.array(rows)


def judged(train, labels, test):
    """Scores of Fisher's linear discriminant; greater is more like a run. Outliers are clipped."""
    low, high = np.percentile(train, [2, 98], axis=0)
    train, test = np.clip(train, low, high), np.clip(test, low, high)
    middle, scale = train.mean(0), train.std(0) + 1e-9
    train, test = (train - middle) / scale, (test - middle) / scale
    within = sum(np.cov(train[labels == k].T) for k in (0, 1)) / 2 + 0.05 * np.eye(train.shape[1])
    axis = np.linalg.solve(within, train[labels == 1].mean(0) - train[labels == 0].mean(0))
    return test @ axis


def area_under_curve(real, ours):
    ranks = np.argsort(np.argsort(np.concatenate([real, ours]))) + 1
    of_ours = ranks[len(real):].sum() - len(ours) * (len(ours) + 1) / 2
    return of_ours / (len(real) * len(ours))


def main():
    if len(sys.argv) < 4:  # two runs, so that one can be held out
        sys.exit(__doc__)
    data = Path(sys.argv[1])
    real = {name: described(paths, 1000) for name, paths in real_sources(data).items()}
    if len(real) < 2:
        sys.exit(f"{data}: has no real_images and sidescan/*.png; name the folder that holds them")
    ours = {}
    for run in sys.argv[2:]:
        pictures = [path for path in sorted(Path(run).glob("*.png")) if "truth" not in path.name]
        if not pictures:
            sys.exit(f"{run}: has no picture; give folders that `ensonify run` wrote")
        crops = described(pictures[:1], 60)
        if len(crops):
            ours[run] = crops
    names = list(statistics(np.random.default_rng(1).random((SIDE, SIDE))))
    medians = np.array([np.median(rows, axis=0) for rows in real.values()])
    its = np.median(np.concatenate(list(ours.values())), axis=0)
    print("statistic,real_least,real_greatest,ours_median,inside")
    for i, name in enumerate(names):
        low, high = medians[:, i].min(), medians[:, i].max()
        inside = "yes" if low <= its[i] <= high else "no"
        print(f"{name},{low:.3g},{high:.3g},{its[i]:.3g},{inside}")
    areas = []
    for held_real in real:
        for held_run in ours:
            rest_real = np.concatenate([rows for name, rows in real.items() if name != held_real])
            rest_ours = np.concatenate([rows for name, rows in ours.items() if name != held_run])
            labels = np.repeat([0, 1], [len(rest_real), len(rest_ours)])
            score = judged(np.concatenate([rest_real, rest_ours]), labels,
                           np.concatenate([real[held_real], ours[held_run]]))
            held = len(real[held_real])
            areas.append((held_real, area_under_curve(score[:held], score[held:])))
    for name in real:
        its = [area for held, area in areas if held == name]
        print(f"# judge's area with {name} held out: {np.mean(its):.3f}")
    all_areas = np.array([area for _, area in areas])
    print(f"# mean area {all_areas.mean():.3f}, mean distance from 0.5 {np.abs(all_areas - 0.5).mean():.3f}; "
          f"{len(real)} real sources, {len(ours)} runs")


if __name__ == "__main__":
    main()
