#!/usr/bin/env python3
"""How much the level of the bed changes along the track, by grazing angle.

    tones.py RECORDING...       XTF files, of a sonar or of a run with output.xtf

Squares of 1 m of the bed lie in rows along the track, each row at one grazing angle over flat ground. The
script prints the rms change of their level (dB) from a square to those 1, 4 and 16 m away, by ranges of
the angle: the median over rows, sides and all files. The change is a robust standard deviation, so that
few objects do not count. The part that speckle causes is estimated from every other ping and taken out.
The bed begins where the samples, smoothed, first reach a share of the ping's strong ones. It needs the
Python module.
"""

import sys
import warnings

import numpy as np

from forms import ping_spacing_m

ANGLES_DEG = ((8, 14), (14, 20), (20, 30), (30, 45), (45, 65))
DISTANCES_M = (1, 4, 16)
LEAST_SQUARES = 20  # of a row


def smoothed(values, length, axis):
    """Running means; at the ends, of what is there."""
    kernel = np.ones(length)
    def means(line):
        return np.convolve(line, kernel, "same") / np.convolve(np.ones_like(line), kernel, "same")
    return np.apply_along_axis(means, axis, values)


def altitudes_m(intensity, sample_m):
    """By ping. The first metre, with the transmitted pulse, does not count."""
    level = smoothed(smoothed(intensity, 9, 1), 9, 0)
    first = int(1.0 / sample_m)
    strong = np.percentile(level, 90, axis=1, keepdims=True)
    at = np.argmax(level[:, first:] > 0.15 * strong, axis=1) + first
    return np.array([np.median(at[max(0, n - 7):n + 8]) for n in range(len(at))]) * sample_m


def variance(values):
    """Robust, so that few large values do not count."""
    if len(values) < LEAST_SQUARES:
        return np.nan
    return np.percentile(np.abs(values - np.median(values)), 68.3) ** 2


def level_db(intensity):
    return 10.0 * np.log10(np.maximum(intensity.mean(axis=1), 1e-9))


def changes(intensity, ping_m, sample_m):
    """Variances of the level's change for each distance, by range of angles."""
    altitude_m = altitudes_m(intensity, sample_m)
    samples, pings = intensity.shape[1], max(2, 2 * round(0.5 / ping_m))  # of a square
    squares = len(intensity) // pings
    found = {}
    for least_deg, most_deg in ANGLES_DEG:
        rows = found[least_deg] = []
        for angle_deg in np.arange(least_deg + 1.0, most_deg, 2.0):
            angle = np.radians(angle_deg)
            middle = (altitude_m / np.sin(angle) / sample_m).astype(int)
            half = max(1, round(0.5 * np.cos(angle) / sample_m))
            shown = (middle < 0.95 * samples - half) & (middle > half)
            middle = np.clip(middle, half, samples - half - 1)
            row = np.array([ping[m - half:m + half + 1].mean() for ping, m in zip(intensity, middle)])
            row = row[:squares * pings].reshape(squares, pings)
            whole = shown[:squares * pings].reshape(squares, pings).all(axis=1)
            level = level_db(row)
            speckle = variance((level_db(row[:, ::2]) - level_db(row[:, 1::2]))[whole]) / 2.0
            rows.append([variance((level[far:] - level[:-far])[whole[far:] & whole[:-far]]) - speckle
                         for far in DISTANCES_M])
    return found


def main(files):
    import ensonify
    everything = {least: [] for least, _ in ANGLES_DEG}
    for file in files:
        line = ensonify.read_recording(file)[0]
        for side in ("port", "starboard"):
            intensity = np.asarray(getattr(line, side), dtype=float) ** 2
            sample_m = np.nanmean(line.range_m) / intensity.shape[1]
            for least, rows in changes(intensity, ping_spacing_m(line), sample_m).items():
                everything[least] += rows
    print("grazing_deg," + ",".join(f"change_over_{d}_m_db" for d in DISTANCES_M))
    warnings.simplefilter("ignore", RuntimeWarning)  # no row is long enough
    for least, most in ANGLES_DEG:
        median = np.nanmedian(np.array(everything[least]), axis=0)
        print(f"{least}-{most}," + ",".join(f"{v:.2f}" for v in np.sqrt(np.maximum(median, 0.0))))


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(sys.argv[1:])
