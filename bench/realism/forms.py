#!/usr/bin/env python3
"""How uneven recorded ground is between the speckle and the slow changes of tone.

    forms.py RECORDING...       XTF files, of a sonar or of a run with output.xtf

Intensities over their mean within some 4 m are filtered by the difference of two Gaussians, of a
scale and of twice the scale. For each scale, piece and side the script prints the contrast of what is
left (a robust standard deviation: few bright objects do not count) and its skew; for the largest scale
also how many times as long as wide the forms are, and the angle from the track to their longer side.
Length and width are inverse to the rms slopes of the level along the two axes of its structure
tensor. Pieces have 360 pings. A piece shows ground from 35 to 95 % of the range. It needs the Python module.
"""

import sys

import numpy as np

SCALES_M, MEAN_M, PIECE, MOST = (0.3, 0.6, 1.2, 2.4), 4.0, 360, 8.0


def blurred(values, sigmas):
    """By a Gaussian of these standard deviations in pixels; the picture continues as its mirror."""
    doubled = np.block([[values, values[:, ::-1]], [values[::-1], values[::-1, ::-1]]])
    spectrum = np.fft.rfft2(doubled)
    along, across = (np.fft.fftfreq(doubled.shape[0]), np.fft.rfftfreq(doubled.shape[1]))
    spectrum *= np.exp(-2.0 * (np.pi * sigmas[0] * along[:, None]) ** 2)
    spectrum *= np.exp(-2.0 * (np.pi * sigmas[1] * across[None, :]) ** 2)
    return np.fft.irfft2(spectrum, doubled.shape)[: values.shape[0], : values.shape[1]]


def elongation(level, ping_m, sample_m):
    """The ratio of length to width, and the angle from the track to the longer side, degrees."""
    slopes = np.array([part.ravel() for part in np.gradient(level, ping_m, sample_m)])
    squares, axes = np.linalg.eigh(slopes @ slopes.T)  # the smaller slope is along the longer side
    return np.sqrt(squares[1] / squares[0]), np.degrees(np.arctan2(axes[1, 0], axes[0, 0])) % 180.0


def forms(samples, ping_m, sample_m):
    """Contrast and skew by scale, and the elongation of the largest forms."""
    def blur(values, scale_m):
        return blurred(values, (scale_m / ping_m, scale_m / sample_m))
    intensity = np.maximum(samples.astype(float) ** 2, 1e-9)
    level = np.minimum(intensity / blur(intensity, MEAN_M), MOST)
    found = []
    for scale_m in SCALES_M:
        left = blur(level, scale_m) - blur(level, 2.0 * scale_m)
        off = left - left.mean()
        found += [np.percentile(np.abs(left - np.median(left)), 68.3),
                  (off ** 3).mean() / (off ** 2).mean() ** 1.5]
    return found + list(elongation(left, ping_m, sample_m))


def ping_spacing_m(line):
    """From places a second or more apart, since positions are noisy."""
    east, north = line.easting_m, line.northing_m
    if np.isnan(east).all():
        degree_m = 111_200.0
        north = degree_m * line.lat_deg
        east = degree_m * np.cos(np.radians(np.nanmean(line.lat_deg))) * line.lon_deg
    step = 20
    way = np.hypot(east[step:] - east[:-step], north[step:] - north[:-step])
    return np.nanmean(way) / step


def main(files):
    import ensonify
    def row(found):
        scales = (f"{c:.3f},{s:.2f}" for c, s in zip(found[:-2:2], found[1:-2:2]))
        return ",".join([*scales, f"{found[-2]:.1f},{found[-1]:.0f}"])
    print("recording,side,first_ping," + ",".join(f"contrast_{s}_m,skew_{s}_m" for s in SCALES_M) +
          f",elongation_{SCALES_M[-1]}_m,longer_side_deg")
    everything = []
    for file in files:
        line = ensonify.read_recording(file)[0]
        ping_m = ping_spacing_m(line)
        for side in ("port", "starboard"):
            samples = np.asarray(getattr(line, side), dtype=float)
            sample_m = np.nanmean(line.range_m) / samples.shape[1]
            ground = samples[:, int(0.35 * samples.shape[1]):int(0.95 * samples.shape[1])]
            for first in range(0, len(ground) - PIECE // 2, PIECE):
                found = forms(ground[first:first + PIECE], ping_m, sample_m)
                everything.append(found)
                print(f"{file},{side},{first},{row(found)}")
    print("median,,," + row(np.median(everything, axis=0)))


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(sys.argv[1:])
