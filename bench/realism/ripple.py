#!/usr/bin/env python3
"""How much the vertical beam ripples: bands along the track that follow the altitude.

    ripple.py RECORDING...      XTF files, of a sonar or of a run with output.xtf

Of pieces of 240 pings the mean level (dB) at each degree of grazing angle over flat ground, from 14 to 52
degrees, is fitted by a smooth law (a square in the logarithm of the angle's sine) with and without a
cosine of the angle of one of five periods. The script prints the cosine from its brightest to its
darkest, its period, an angle at which it is dark, and what both fits leave (rms): a median for each side.
The altitude is found as in tones.py. It needs the Python module.
"""

import sys

import numpy as np

from tones import altitudes_m

FIRST_DEG, LAST_DEG, PERIODS_DEG, PIECE, LEAST = 14, 52, (13, 16, 20, 24, 28), 240, 60


def fit(degrees, level_db, period_deg=None):
    """Coefficients, and the rms of what is left."""
    sine = np.log(np.sin(np.radians(degrees)))
    terms = [np.ones_like(sine), sine, sine ** 2]
    if period_deg:
        turns = 2.0 * np.pi * degrees / period_deg
        terms += [np.cos(turns), np.sin(turns)]
    terms = np.stack(terms, axis=1)
    found = np.linalg.lstsq(terms, level_db, rcond=None)[0]
    return found, np.std(level_db - terms @ found)


def ripple(intensity, altitude_m, sample_m):
    """The best period's: peak to peak (dB), period, dark angle, rms left, rms without; or None."""
    range_m = (np.arange(intensity.shape[1]) + 0.5) * sample_m
    sine = altitude_m[:, None] / range_m
    degree = np.degrees(np.arcsin(np.clip(sine, 0.0, 0.999))).astype(int)
    count = np.bincount(degree.ravel(), minlength=90)[FIRST_DEG:LAST_DEG]
    total = np.bincount(degree.ravel(), intensity.ravel(), minlength=90)[FIRST_DEG:LAST_DEG]
    shown = count > LEAST
    if shown.sum() < 30:
        return None
    degrees = np.arange(FIRST_DEG, LAST_DEG)[shown] + 0.5
    level_db = 10.0 * np.log10(total[shown] / count[shown])
    fits = [(fit(degrees, level_db, period), period) for period in PERIODS_DEG]
    (found, left_db), period = min(fits, key=lambda of: of[0][1])
    dark = (np.degrees(np.arctan2(found[4], found[3])) / 360.0 + 0.5) % 1.0 * period
    while dark < 25.0:
        dark += period
    return 2.0 * np.hypot(found[3], found[4]), period, dark, left_db, fit(degrees, level_db)[1]


def main(files):
    import ensonify
    print("recording,side,ripple_db,period_deg,dark_deg,left_db,left_without_db")
    for file in files:
        line = ensonify.read_recording(file)[0]
        for side in ("port", "starboard"):
            intensity = np.asarray(getattr(line, side), dtype=float) ** 2
            sample_m = np.nanmean(line.range_m) / intensity.shape[1]
            altitude_m = altitudes_m(intensity, sample_m)
            pieces = [ripple(intensity[first:first + PIECE], altitude_m[first:first + PIECE], sample_m)
                      for first in range(0, len(intensity) - PIECE // 2, PIECE)]
            found = [piece for piece in pieces if piece]
            if found:
                values = np.median(found, axis=0)
                print(f"{file},{side}," + ",".join(f"{v:.1f}" for v in values))


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(sys.argv[1:])
