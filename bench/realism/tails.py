#!/usr/bin/env python3
"""How often samples of the bed are much brighter than those around them, by grazing angle.

    tails.py RECORDING...       XTF files, of a sonar or of a run with output.xtf

Prints, per side and range of the angle, the mean square of the intensity over the square of its mean (2 for
speckle of one look), and how many of 10,000 samples have more than 2, 3, 4, 5 and 6 times the mean amplitude.
Means are over the 9 pings and 17 samples around. Grazing angles are those of flat ground. It needs the Python
module.
"""

import sys

import numpy as np

from tones import altitudes_m, smoothed

ANGLES_DEG = ((8, 14), (14, 20), (20, 40), (40, 70))
TIMES = (2, 3, 4, 5, 6)
LEAST_SAMPLES = 5000


def around(values):
    return smoothed(smoothed(values, 17, 1), 9, 0)


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    import ensonify
    print("file,side,least_deg,most_deg,moment," + ",".join(f"over_{times}" for times in TIMES))
    for name in sys.argv[1:]:
        line = ensonify.read_recording(name)[0]
        sample_m = float(np.median(line.range_m)) / line.port.shape[1]
        for side in ("port", "starboard"):
            amplitude = np.asarray(getattr(line, side), float)
            intensity = amplitude**2
            range_m = (np.arange(amplitude.shape[1]) + 0.5) * sample_m
            altitude_m = altitudes_m(intensity, sample_m)[:, None]
            grazing_deg = np.degrees(np.arcsin(np.minimum(altitude_m / range_m, 1.0)))
            times = amplitude / np.maximum(around(amplitude), 1e-9)
            power = intensity / np.maximum(around(intensity), 1e-9)
            for least, most in ANGLES_DEG:
                bed = (grazing_deg >= least) & (grazing_deg < most) & (range_m > 1.05 * altitude_m)
                if bed.sum() < LEAST_SAMPLES:
                    continue
                counts = ",".join(f"{1e4 * (times[bed] > k).mean():.1f}" for k in TIMES)
                print(f"{name},{side},{least},{most},{(power[bed] ** 2).mean():.2f},{counts}")


if __name__ == "__main__":
    main()
