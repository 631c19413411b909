"""Draws the validation page: what the program gives, next to closed forms and published values.

Usage: validation.py PROGRAM FOLDER. Writes validation.md and its pictures into FOLDER; exit code 1 if a
bound does not hold. Nothing here shares code with the program: the laws are written out again.
"""

import csv
import dataclasses
import io
import json
import pathlib
import subprocess
import sys
import tempfile

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import numpy as np

import ensonify

plt.rcParams.update({"svg.hashsalt": "ensonify", "figure.figsize": (6.8, 4.6), "figure.autolayout": True,
                     "axes.grid": True, "axes.formatter.useoffset": False, "grid.alpha": 0.3, "lines.linewidth": 1.2})

speed_mps = 1500.0
absorption_db_per_m = 0.03
lambert_db = -27.0


@dataclasses.dataclass
class Law:
    name: str
    title: str
    text: str  # what is expected, with its source
    unit: str
    bound: float
    worst: float  # the largest deviation from the law; not a number if something was not found
    draw: object  # draw(axes, axes below for the difference), or None

    @property
    def holds(self):
        return bool(self.worst <= self.bound)


laws = []


def law(function):
    laws.append(function)
    return function


def decibel(x):
    return 10 * np.log10(np.maximum(x, 1e-300))


def scene(depth_m=20.0, sonar=None, extent_m=120.0, **tables):
    """A level bed that scatters by Lambert's law, and one sonar without noise, which hears one side of it."""
    whole = {"version": 1, "speckle": False, "texture": False,
             "sea": {"sound_speed_mps": speed_mps, "absorption_db_per_km": 1e3 * absorption_db_per_m},
             "seafloor": {"extent_east_m": extent_m, "extent_north_m": extent_m, "cell_m": extent_m / 100,
                          "depth_m": depth_m, "material": "law", "fractal": {"height_at_1m_m": 0.0}},
             "material": {"law": {"model": "lambert", "lambert_mu_db": lambert_db}},
             "run": {"surface": "static", "intersector": "fan_scan"},
             "track": {"pings": 1},
             "sonar": {"s": {"range_m": 50.0, "bins": 1000, "noise": False, "vertical_beamwidth_deg": 0.0,
                             "sector_high_deg": 90.0, "elevations": 4000, **(sonar or {})}}}
    whole.update(tables)
    return whole


def starboard(simulator, pose, number=None):
    lines = simulator.ping(pose, number)
    return next(line for line in lines if line.side == "starboard")


def compared(x, series, xlabel, ylabel):
    """Draws (name, expected, measured) over x: a line for the law, dots for the program; below it, their
    difference."""
    def draw(axes, below):
        for name, expected, measured in series:
            line, = axes.plot(x, expected, label=f"{name}: law")
            step = max(1, len(x) // 40)
            axes.plot(x[::step], measured[::step], "o", markersize=3, color=line.get_color(),
                      label=f"{name}: program")
            below.plot(x, measured - expected, ".-", markersize=3, color=line.get_color())
        axes.set(ylabel=ylabel)
        axes.legend(fontsize=7)
        below.set(xlabel=xlabel, ylabel="program - law")
    return draw


@law
def sonar_equation():
    altitude_m, series, worst = 10.0, [], 0.0
    for frequency_hz in (100e3, 400e3, 900e3):
        sonar = {"frequency_hz": frequency_hz, "array_length_m": 0.5, "bandwidth_hz": 30e3,
                 "source_level_db": 210.0, "focused": True}
        line = starboard(ensonify.Simulator(scene(sonar=sonar)), ensonify.Pose(0, 0, -altitude_m))
        cell_m = speed_mps / 2 / 30e3
        r = line["range_m"].astype(float) - cell_m / 2  # the middle of the echo's cell
        keep = (r > 1.2 * altitude_m) & (r < 49)
        r = r[keep]
        grazing = np.arcsin(altitude_m / r)
        beam_rad = 2 / 3 * speed_mps / frequency_hz / 0.5  # integral of sinc^4
        expected = (210.0 - 40 * np.log10(r) - 2 * absorption_db_per_m * r + lambert_db
                    + 20 * np.log10(np.sin(grazing)) + decibel(r * beam_rad * cell_m / np.cos(grazing)))
        measured = decibel(line["intensity_mean"][keep])
        series.append((f"{frequency_hz / 1e3:.0f} kHz", expected, measured))
        worst = np.maximum(worst, np.abs(measured - expected).max())
    return Law("sonar_equation", "Level over range",
               "A flat bed by Lambert's law returns SL - 40 log r - 2 a r + S_b + 10 log A, where A is the "
               "range cell c/2B, over the cosine, times r times the two-way beam 2/3 λ/L. "
               "The main lobe alone is traced here, which leaves out 0.014 dB.",
               "dB", 0.05, worst, compared(r, series, "slant range, m", "echo level, dB re 1 µPa"))


@law
def first_return():
    altitudes = np.array([2.0, 5.0, 8.0, 12.5, 20.0, 31.0])
    simulator = ensonify.Simulator(scene(depth_m=40.0))
    measured = []
    for altitude_m in altitudes:
        line = starboard(simulator, ensonify.Pose(0, 0, altitude_m - 40.0))
        measured.append(line["range_m"][np.argmax(line["intensity_mean"] > 0)])
    measured = np.array(measured)
    return Law("first_return", "First return",
               "The first echo of a level bed begins at the altitude; bins are 0.05 m wide.",
               "m", 0.05, np.abs(measured - altitudes).max(),
               compared(altitudes, [("first lit bin", altitudes, measured)], "altitude, m",
                        "first return, m"))


def element(depression):
    """One-way power of the default element: sinc², 50 degrees wide, 20 degrees down, not below -20 dB."""
    off = depression - np.radians(20)
    power = np.sinc(0.442946 * np.sin(off) / np.sin(np.radians(25)))**2
    return np.maximum(np.where(np.abs(off) < np.pi / 2, power, 0), 0.01)


@law
def nearest_place():
    altitude_m, series, worst = 10.0, [], 0.0
    at = np.linspace(1.03, 2.0, 60)
    for slope_deg in (-10.0, 0.0, 10.0):  # down to starboard
        whole = scene(depth_m=40.0, extent_m=160.0, sonar={"focused": True, "bins": 2000})
        whole["seafloor"].update(slope_deg=abs(slope_deg), downhill_deg=90.0 if slope_deg > 0 else 270.0)
        del whole["sonar"]["s"]["sector_high_deg"], whole["sonar"]["s"]["vertical_beamwidth_deg"]
        line = starboard(ensonify.Simulator(whole), ensonify.Pose(0, 0, altitude_m - 40.0))
        to_bed_m = altitude_m * np.cos(np.radians(slope_deg))
        cell_m = speed_mps / 2 / 30e3
        r = line["range_m"].astype(float) - cell_m / 2
        off, foot = np.arccos(to_bed_m / (at * to_bed_m)), np.radians(90 + slope_deg)
        heard = element(foot - off)**2 + element(foot + off)**2
        beam_rad = 2 / 3 * speed_mps / 400e3 / 0.5
        far = at * to_bed_m
        expected = (210.0 - 40 * np.log10(far) - 2 * absorption_db_per_m * far + lambert_db + decibel(heard)
                    + 20 * np.log10(np.cos(off)) + decibel(far * beam_rad * cell_m / np.sin(off)))
        measured = np.interp(far, r, decibel(line["intensity_mean"]))
        series.append((f"down by {slope_deg:.0f}°", expected, measured))
        worst = np.maximum(worst, np.abs(measured - expected).max())
    return Law("nearest_place", "Both sides of the nearest place",
               "A side hears all of the bed about its nearest place, also beyond the vertical: two places at each "
               "range, each with the square of the vertical pattern. Over a bed that sinks by 10 degrees to a side, "
               "the echo there begins at the foot of the perpendicular, cos(10°) times the altitude, 10 degrees past "
               "straight down. What the fan leaves out by default is less than 0.1 dB.",
               "dB", 0.15, worst, compared(at, series, "slant range over that of the nearest place",
                                           "echo level, dB re 1 µPa²"))


def target_scene(sonar, shape):
    """A smooth object that reflects nine tenths, high above a deep bed, so that it is alone in its ranges."""
    whole = scene(depth_m=400.0, extent_m=2.0,
                  sonar={"bandwidth_hz": 30e3, "focused": True, "sector_low_deg": -20.0,
                         "sector_high_deg": 20.0, "side_lobes": 0, **sonar},
                  objects=[{"shape": shape[0], "material": "rigid", "height_m": 380.0, **shape[1]}])
    whole["material"]["rigid"] = {"model": "solid", "like": "steel", "specular": 0.9, "diffuse_db": -100.0}
    return whole


def target_strength_db(line, near_m, far_m, source_level_db=210.0, bandwidth_hz=30e3):
    """The energy of an echo between two ranges, with its spreading and absorption undone."""
    r = line["range_m"].astype(float)
    keep = (r > near_m) & (r < far_m)
    r, energy = r[keep], line["intensity_mean"][keep].astype(float)
    bin_m, cell_m = r[1] - r[0], speed_mps / 2 / bandwidth_hz
    undone = energy * r**4 * 10 ** (2 * absorption_db_per_m * r / 10)
    return decibel(undone.sum() * bin_m / cell_m) - source_level_db


@law
def sphere():
    radii = np.array([0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8])
    # A spherical wave that has run d to the nearest point spreads from there on as if from the
    # sphere's inside: a^2 / 4 holds with the range d out and d + a back.
    nearest_m = 40.0 - radii
    expected, measured = decibel(0.9 * radii**2 / 4 * (nearest_m / 40.0)**2), []
    for a in radii:
        # 40 m off, at the sphere's height; an array so short that the beam is wider than the sphere.
        simulator = ensonify.Simulator(target_scene(
            {"frequency_hz": 200e3, "array_length_m": 0.05, "range_m": 60.0, "bins": 2400},
            ("sphere", {"diameter_m": 2 * a})))
        line = starboard(simulator, ensonify.Pose(-40.0, 0, -20.0 + a))
        measured.append(target_strength_db(line, 36.0, 42.0))
    measured = np.array(measured)
    return Law("sphere", "Target strength of a sphere",
               "A smooth rigid sphere of radius a returns a²/4 of what arrives, far from it, if waves are short: "
               "k a is 80 or more here (Urick, Principles of Underwater Sound). These reflect nine tenths of the "
               "energy. "
               "So near, the wave's own curvature counts: a factor of ((r - a) / r)².",
               "dB", 0.2, np.abs(measured - expected).max(),
               compared(radii, [("sphere", expected, measured)], "radius, m", "target strength, dB"))


def spherical(x, count):
    """Spherical Bessel functions of both kinds, of the orders up to count."""
    j = np.zeros(count + 41)
    j[-2] = 1e-200
    for n in range(len(j) - 2, 0, -1):
        j[n - 1] = (2 * n + 1) / x * j[n] - j[n + 1]
    y = np.zeros(count + 1)
    y[:2] = -np.cos(x) / x, -np.cos(x) / x**2 - np.sin(x) / x
    for n in range(1, count):
        y[n + 1] = (2 * n + 1) / x * y[n] - y[n - 1]
    return j[:count + 1] * np.sin(x) / x / j[0], y


def cylindrical(x, count):
    """The same of Bessel functions of whole orders, by Bessel's integral, Neumann's series and recurrence."""
    angle = (np.arange(4000) + 0.5) / 4000 * np.pi
    j = np.array([np.cos(n * angle - x * np.sin(angle)).mean() for n in range(count + 41)])
    m = np.arange(1, (count + 40) // 2)
    y = np.zeros(count + 1)
    y[0] = 2 / np.pi * (np.log(x / 2) + np.euler_gamma) * j[0] - 4 / np.pi * ((-1.0)**m * j[2 * m] / m).sum()
    y[1] = (j[1] * y[0] - 2 / (np.pi * x)) / j[0]
    for n in range(1, count):
        y[n + 1] = 2 * n / x * y[n] - y[n - 1]
    return j[:count + 1], y


def sum_of_modes(x, functions, weight):
    """|sum of (-1)^n weight(n) J_n'(x) / H_n'(x)|^2."""
    count = int(x) + 14
    n = np.arange(count)
    slopes = [n / x * f[:-1] - f[1:] for f in functions(x, count)]
    return np.abs(((-1.0)**n * weight(n) * slopes[0] / (slopes[0] + 1j * slopes[1])).sum())**2


@law
def low_ka():
    frequency_hz, range_m, length_m = 20e3, 40.0, 0.6
    wavelength_m = speed_mps / frequency_hz
    k = 2 * np.pi / wavelength_m
    ka = np.array([0.1, 0.2, 0.4, 0.7, 1.0, 1.4, 1.9, 2.1, 3.0, 5.0, 8.0])

    def measured(shape, sizes):
        levels = []
        for radius_m in ka / k:
            simulator = ensonify.Simulator(target_scene(
                {"frequency_hz": frequency_hz, "array_length_m": 0.5, "range_m": 60.0, "bins": 1200,
                 "bandwidth_hz": 10e3},
                (shape, {"diameter_m": 2 * radius_m, **sizes})))
            line = starboard(simulator, ensonify.Pose(-range_m, 0, radius_m - 20.0))
            levels.append(target_strength_db(line, 36.0, 44.0, bandwidth_hz=10e3))
        return np.array(levels)

    spheres = [sum_of_modes(x, spherical, lambda n: 2 * n + 1) / k**2 for x in ka]
    # The waves of a sonar are curved: over the rod's length, phases of exp(2 i k (R - r)).
    along_m = (np.arange(2000) + 0.5) / 2000 * length_m - length_m / 2
    phases = np.exp(2j * k * (np.hypot(range_m, along_m) - range_m)).mean()
    rods = [sum_of_modes(x, cylindrical, lambda n: np.where(n == 0, 1, 2)) / np.pi**2
            * length_m**2 * abs(phases)**2 for x in ka]
    series = [(name, decibel(0.9 * np.array(expected)), level) for name, expected, level in (
        ("sphere", spheres, measured("sphere", {})),
        ("rod of 0.6 m", rods, measured("cylinder", {"length_m": length_m})))]
    return Law("low_ka", "Spheres and rods that are small against the wavelength",
               "A rigid sphere and a rigid rod seen across its axis, at 20 kHz, by sums over their modes (Faran, JASA "
               "23, 405, 1951): (25/36) k⁴a⁶ and (9/16) k⁴a⁴L² far below the wavelength. They reflect nine tenths. "
               "Other bodies are ellipsoids where they are smaller than the waves: that is an approximation.",
               "dB", 1.0, max(np.abs(level - expected).max() for _, expected, level in series),
               compared(ka, series, "k a", "target strength, dB"))


@law
def overlapping_glints():
    band_hz, cells = 10e3, np.linspace(0.0, 2.0, 21)
    cell_m = speed_mps / 2 / band_hz
    wavelength_m = speed_mps / 400e3

    def energy(pulse, bins_per_cell, gap_m=None):
        sonar = {"frequency_hz": 400e3, "array_length_m": 0.05, "range_m": 60.0, "bandwidth_hz": band_hz,
                 "bins": round(60.0 / cell_m * bins_per_cell), **pulse}
        whole = target_scene(sonar, ("sphere", {"diameter_m": 0.1, "north_m": -0.5}))
        if gap_m is not None:  # as far aside, so that neither hides the other
            east_m = np.sqrt(np.hypot(40.0, 0.5)**2 + 2 * gap_m * np.hypot(40.0, 0.5) + gap_m**2 - 0.25) - 40.0
            whole["objects"].append({**whole["objects"][0], "north_m": 0.5, "east_m": east_m})
        line = starboard(ensonify.Simulator(whole), ensonify.Pose(-40.0, 0, -19.95))
        r = line["range_m"]
        return line["intensity_mean"][r > 20].astype(float).sum()

    series, worst = [], 0.0
    for name, pulse, overlap in (
            ("tone", {"pulse": "cw"}, np.maximum(0.0, 1 - cells)),
            ("sweep", {"pulse": "lfm"}, np.sinc(cells))):
        for bins_per_cell in (1, 2, 4):
            one = energy(pulse, bins_per_cell)
            # Whole numbers of half wavelengths, at which both are in phase, and those between: their mean has no
            # interference, and half their difference is the overlap.
            measured = []
            for gap_m in np.round(cells * cell_m / (wavelength_m / 2)) * wavelength_m / 2:
                both = [energy(pulse, bins_per_cell, gap_m + shift * wavelength_m / 4) for shift in (0, 1)]
                measured.append((both[0] - both[1]) / (4 * one))
            measured = np.array(measured)
            series.append((f"{name}, {bins_per_cell} bins per cell", overlap, measured))
            worst = max(worst, np.abs(measured - overlap).max())
    return Law("overlapping_glints", "Interference of two glints",
               "Two glints that are a time t apart have the energy |a₁|² + |a₂|² + 2 Re(a₁ a₂*) ρ(t), with the "
               "autocorrelation ρ of the pulse: a triangle for a tone, a sinc for a sweep, whatever the bins. Drawn is "
               "what two spheres have more in phase than against it, over four times the energy of one.",
               "", 0.05, worst, compared(cells, series, "distance, cells", "interference"))


@law
def far_sphere():
    a, distances_km = 0.15, np.array([0.0, 0.3, 1.0, 2.0, 5.0, 10.0, 20.0, 49.0])
    expected, measured = np.full(distances_km.size, decibel(0.9 * a**2 / 4 * (1 - a / 40.0)**2)), []
    for east_m in 1e3 * distances_km:
        whole = target_scene({"frequency_hz": 200e3, "array_length_m": 0.05, "range_m": 60.0, "bins": 2400},
                             ("sphere", {"diameter_m": 2 * a, "facet_m": 0.004, "east_m": east_m}))
        whole["seafloor"].update(extent_east_m=100e3, extent_north_m=100e3, cell_m=1000.0)
        line = starboard(ensonify.Simulator(whole), ensonify.Pose(east_m - 40.0, 0, -20.0 + a))
        measured.append(target_strength_db(line, 36.0, 42.0))
    measured = np.array(measured)
    return Law("far_sphere", "A sphere far from the middle of the seabed",
               "The same sphere, of 0.15 m in facets of 4 mm, returns the same wherever it lies. The mesh that rays "
               "meet has floats about the middle of the seabed: their steps are as long as a facet 50 km away from it.",
               "dB", 0.2, np.abs(measured - expected).max(),
               compared(distances_km, [("rigid sphere", expected, measured)], "distance from the seabed's middle, km",
                        "target strength, dB"))


@law
def beam():
    frequency_hz, length_m = 400e3, 0.3
    simulator = ensonify.Simulator(target_scene(
        {"frequency_hz": frequency_hz, "array_length_m": length_m, "range_m": 60.0, "bins": 1200,
         "side_lobes": 3}, ("sphere", {"diameter_m": 0.1})))
    angles = np.linspace(-2.0, 2.0, 81)
    measured = []
    for angle in angles:
        line = starboard(simulator, ensonify.Pose(-40.0, 0, -19.95, heading_deg=angle))
        r = line["range_m"]
        measured.append(line["intensity_mean"][(r > 38) & (r < 42)].astype(float).sum())
    measured = np.array(measured)
    measured = decibel(measured / measured.max())
    expected = 40 * np.log10(np.abs(np.sinc(length_m * frequency_hz / speed_mps * np.sin(np.radians(angles)))))
    keep = expected > -50
    return Law("beam", "Beam of a line array",
               "A small sphere 40 m off, the sonar turned past it: the two-way power of a line array is "
               "sinc⁴(L sin(angle) / λ). Levels below -50 dB are not compared.",
               "dB", 0.1, np.abs(measured - expected)[keep].max(),
               compared(angles[keep], [("0.3 m at 400 kHz", expected[keep], measured[keep])],
                        "angle from broadside, degrees", "level, dB re axis"))


@law
def shadow():
    altitude_m, series, worst = 10.0, [], 0.0
    places = np.array([12.0, 16.0, 20.0, 26.0, 32.0])
    for height_m in (0.5, 1.0, 2.0):
        expected, measured = [], []
        for east_m in places:
            simulator = ensonify.Simulator(scene(
                sonar={"array_length_m": 1.0, "range_m": 60.0, "bins": 2400, "pulse": "lfm", "bandwidth_hz": 60e3},
                objects=[{"shape": "box", "length_m": 12.0, "width_m": 1.0, "tall_m": height_m,
                          "east_m": east_m, "material": "concrete"}]))
            line = starboard(simulator, ensonify.Pose(0, 0, -altitude_m))
            behind = east_m + 0.5  # the upper far edge casts the end of the shadow
            end_m = behind * altitude_m / (altitude_m - height_m)
            expected.append(np.hypot(end_m, altitude_m))
            r = line["range_m"]
            dark = (line["region"] == 4) & (r < expected[-1] + 2)
            measured.append(r[dark].max() + 0.0125 if dark.any() else np.nan)
        series.append((f"{height_m} m tall", np.array(expected), np.array(measured)))
        worst = np.maximum(worst, np.abs(np.array(measured) - expected).max())
    return Law("shadow", "End of a shadow",
               "A wall of height h whose far edge is at ground distance d shades the bed as far as "
               "d H / (H - h), seen from the altitude H. The label `shadow` ends there, to two bins.",
               "m", 0.05, worst, compared(places, series, "distance of the wall, m", "slant range, m"))


@law
def speckle():
    whole = scene(sonar={"bins": 500, "array_length_m": 0.3})
    whole["speckle"] = True
    whole["track"] = {"pings": 400, "altitude_m": 10.0, "speed_mps": 2.0, "ping_interval_s": 0.5}
    whole["seafloor"]["extent_north_m"] = 600.0
    image = ensonify.images(whole)["s"]
    r = image["range_m"]
    keep = (r > 15) & (r < 45)
    x = np.sort(image["intensity"].astype(float)[keep] / image["intensity_mean"][keep])
    share_above = 1 - (np.arange(x.size) + 0.5) / x.size
    at = np.linspace(0.1, 6, 60)
    measured = np.interp(at, x, share_above)
    expected = np.exp(-at)

    def draw(axes, below):
        compared(at, [("share", expected, measured)], "x = intensity / its mean", "share above x")(axes, below)
        axes.set_yscale("log")
    return Law("speckle", "Speckle",
               "The intensity of many scatterers is exponentially distributed about its mean: a share of "
               f"exp(-x) is more than x times as strong. {x.size:,} bins of a flat bed.",
               "of the share", 0.01, np.abs(measured - expected).max(),
               draw)


@law
def texture():
    shapes, expected, measured = np.array([0.1, 0.2, 0.35, 0.6, 1.0, 2.0]), [], []
    for shape in shapes:
        whole = scene(sonar={"bins": 500, "array_length_m": 0.3, "bandwidth_hz": 15e3, "focused": True})
        whole.update(speckle=True, texture=True)
        # Patches far larger than a cell: its texture is that of one patch, the same at all angles.
        whole["material"]["law"].update(texture_patch_m=2.0, texture_shape=shape, texture_exponent=0.0,
                                        glint_share=0.0, variation_db=0.0)
        whole["track"] = {"pings": 600, "altitude_m": 10.0, "speed_mps": 2.0, "ping_interval_s": 0.5}
        whole["seafloor"]["extent_north_m"] = 800.0
        image = ensonify.images(whole)["s"]
        r = image["range_m"]
        keep = (r > 12) & (r < 30)
        x = image["intensity"].astype(float)[keep] / image["intensity_mean"][keep]
        expected.append(2 * (1 + 1 / shape))
        measured.append((x**2).mean() / x.mean() ** 2)
    expected, measured = np.array(expected), np.array(measured)
    return Law("texture", "Texture below the cell",
               "Patches of gamma distributed strength with the shape n make K distributed echoes: "
               "mean(I²) / mean(I)² = 2 (1 + 1/n) (Abraham and Lyons 2002).",
               "of the law", 0.05, np.abs(measured / expected - 1).max(),
               compared(shapes, [("second moment", expected, measured)], "shape n of a patch",
                        "mean(I²) / mean(I)²"))


def variance_left(weights, step_m, patch_m):
    """The share of a patch's variance in the mean over a line with these weights."""
    apart_m = step_m * np.abs(np.subtract.outer(np.arange(weights.size), np.arange(weights.size)))
    return np.outer(weights, weights).ravel() @ np.maximum(1 - apart_m / patch_m, 0).ravel() / weights.sum()**2


@law
def texture_of_cells():
    # Cells of 0.1 m in bins of 0.2 m down to 0.0125 m, over patches smaller and larger than cells.
    bins_per_cell, cell_m, array_m = np.array([0.5, 1, 2, 4, 8]), 0.1, 0.5
    near_m, far_m, altitude_m, series, worst = 36.0, 46.0, 6.0, [], 0.0
    over_bed = 1 / np.sqrt(1 - (altitude_m / 41)**2)
    for patch_m in (0.05, 0.12, 0.3):
        null_m = speed_mps / 400e3 / array_m * 41
        step_m = min(null_m, patch_m) / 40
        along = np.sinc(np.arange(-null_m + step_m / 2, null_m, step_m) / null_m)**4
        left = variance_left(np.ones(60), cell_m * over_bed / 60, patch_m) * variance_left(along, step_m, patch_m)
        measured = []
        for count in bins_per_cell:
            whole = scene(depth_m=60.0, sonar={"range_m": 48.0, "bins": int(48.0 / cell_m * count),
                                               "bandwidth_hz": speed_mps / 2 / cell_m, "focused": True,
                                               "side_lobes": 1, "elevations": 1024, "sides": "starboard"})
            whole.update(speckle=True, texture=True)
            whole["material"]["law"].update(texture_patch_m=patch_m, texture_shape=left, texture_exponent=0.0,
                                            glint_share=0.0, variation_db=0.0)
            whole["track"] = {"pings": 1000, "altitude_m": altitude_m, "speed_mps": 1.0, "ping_interval_s": 2.5}
            whole["seafloor"].update(extent_north_m=2800.0, cell_m=5.0)
            image = ensonify.images(whole)["s"]
            keep = (image["range_m"] > near_m) & (image["range_m"] < far_m)
            x = image["intensity"].astype(float)[keep] / image["intensity_mean"][keep]
            measured.append(1 / ((x**2).mean() / x.mean()**2 / 2 - 1))
        measured, expected = np.array(measured), np.ones(bins_per_cell.size)
        series.append((f"patches of {patch_m} m", expected, measured))
        worst = np.maximum(worst, np.abs(measured / expected - 1).max())
    return Law("texture_of_cells", "Texture of a cell",
               "A cell of 0.1 m by a beam of 0.2 m covers several patches, or parts of them. The shape of its echo is "
               "that of a patch over the share of a patch's variance that is left in the cell's mean: ∬ w w' C / "
               "(∫ w)², with a box over range, sinc⁴ along the track, and the share C = 1 - d / side of places "
               "that lie on one patch. It does not depend on the bins. The patches of each curve have such a shape that "
               "the cell's is 1. So few cells have a second moment that is sure to about 5 %.",
               "of the law", 0.15, worst, compared(bins_per_cell, series, "bins per cell", "shape of the echo"))


def ahead_scene(sonar=None, **tables):
    """The same of a sonar that looks ahead, with beams at every half a degree; 13 m deep."""
    return scene(depth_m=13.0, extent_m=80.0,
                 sonar={"kind": "imaging", "range_m": 25.0, "bins": 800, "beams": beams_ahead, "side_lobes": 3,
                        "elevations": 512, "sector_high_deg": 25.0, **(sonar or {})}, **tables)


beams_ahead, bearings_deg = 257, np.linspace(-65.0, 65.0, 257)
# The defaults of an imaging sonar: 0.1 m at 750 kHz; a sweep of 60 kHz under a Hann window, whose cell is 1.5 times
# as long.
per_sine_ahead, cell_ahead_m = 0.1 * 750e3 / speed_mps, 1.5 * speed_mps / 2 / 60e3


def frame(simulator, pose, layer="intensity_mean", number=None):
    """Beams x bins of a ping, and the ranges of the bins."""
    lines = [line for line in simulator.ping(pose, number) if line.side == "ahead"]
    return np.array([line[layer].astype(float) for line in lines]), lines[0]["range_m"].astype(float)


def taylor(x, side_lobe_db=30.0, nbar=4):
    """The far field of Taylor's weights (IRE Trans. 3, 16, 1955)."""
    a = np.arccosh(10 ** (side_lobe_db / 20)) / np.pi
    n = np.arange(1, nbar)
    nulls = nbar * np.sqrt((a**2 + (n - 0.5) ** 2) / (a**2 + (nbar - 0.5) ** 2))
    x = x + 1e-7  # the nulls of the sinc cancel
    return np.sinc(x) * np.prod([(1 - (x / null) ** 2) / (1 - (x / k) ** 2) for k, null in zip(n, nulls)], axis=0)


@law
def point_ahead():
    series, worst = [], 0.0
    for shading, pattern in (("uniform", np.sinc), ("taylor", taylor)):
        for bearing_deg in (0.0, 30.0, 60.0):
            for tilt_deg in (0.0, 8.0):
                bearing, roll, pitch = np.radians([bearing_deg, tilt_deg, tilt_deg / 2])
                whole = target_scene({"kind": "imaging", "range_m": 25.0, "bins": 800, "beams": beams_ahead,
                                      "bandwidth_hz": 60e3, "receive_shading": shading, "side_lobes": 3,
                                      "elevations": 256, "sector_high_deg": 25.0, "sector_low_deg": -25.0},
                                     ("sphere", {"diameter_m": 0.2}))
                levels, r = frame(ensonify.Simulator(whole), ensonify.Pose(
                    -15 * np.sin(bearing), -15 * np.cos(bearing), -19.9, roll_deg=tilt_deg, pitch_deg=tilt_deg / 2))
                # The component of the direction along the array, which points to starboard, rolled and pitched.
                sine = np.cos(bearing) * np.sin(pitch) * np.sin(roll) + np.sin(bearing) * np.cos(roll)
                x = per_sine_ahead * (np.sin(np.radians(bearings_deg)) - sine)
                expected = 20 * np.log10(np.maximum(np.abs(pattern(x)), 1e-9))
                measured = decibel(levels[:, (r > 14.5) & (r < 15.2)].sum(axis=1))
                measured -= measured.max() - expected[measured.argmax()]
                keep = (expected > -30) & (np.abs(x) < 3.9)
                worst = np.maximum(worst, np.abs(measured - expected)[keep].max())
                if tilt_deg:
                    series.append((f"{shading}, {bearing_deg:.0f} degrees", x[keep], expected[keep], measured[keep]))

    def draw(axes, below):
        at = np.linspace(-3.9, 3.9, 800)
        for pattern in (np.sinc, taylor):
            axes.plot(at, decibel(pattern(at) ** 2), color="grey")
        for name, x, expected, measured in series:
            dots, = axes.plot(x, measured, "o", markersize=3, label=name)
            below.plot(x, measured - expected, ".", markersize=3, color=dots.get_color())
        axes.set_ylim(-40, 2)
        axes.set(ylabel="level, dB re axis")
        axes.legend(fontsize=7)
        below.set(xlabel="sine from the beam's axis to the point, over λ / L", ylabel="program - law")
    return Law("point_ahead", "A point over the beams",
               "A small sphere 15 m ahead of an imaging sonar, at 0, 30 and 60 degrees, the sonar level, and rolled by 8 "
               "and pitched by 4 degrees (drawn). The beam that is steered to the sine s receives from the sine u the "
               "power of the array's pattern at L (u - s) / λ: sinc², or Taylor's (IRE Trans. 3, 16, 1955). Levels "
               "below -30 dB are not compared.",
               "dB", 0.02, worst, draw)


def received_by_all(sine, axes):
    """What a direction gives to all beams together; each has its pattern out to the fourth null."""
    x = per_sine_ahead * (np.asarray(sine)[:, None] - axes)
    return np.where(np.abs(x) < 4, np.sinc(x) ** 2, 0).sum(axis=1)


@law
def energy_ahead():
    altitude_m = 3.0
    levels, r = frame(ensonify.Simulator(ahead_scene({"beam_steps": "sine", "source_level_db": 200.0})),
                      ensonify.Pose(0, 0, altitude_m - 13.0))
    measured = decibel(levels.sum(axis=0))
    u = np.linspace(-1, 1, 40001)
    widest = np.sin(np.radians(65.0))
    power = (np.sinc(0.4429465 * u / widest) ** 2
             * received_by_all(u, np.linspace(-widest, widest, beams_ahead)))
    keep = (r > 8) & (r < 24.7)
    expected = []
    for range_m in r[keep]:
        ahead2 = range_m**2 * (1 - u**2) - altitude_m**2
        seen = ahead2 > 0
        expected.append((power[seen] / np.sqrt(ahead2[seen])).sum() * (u[1] - u[0]))
    expected = (200.0 - 40 * np.log10(r[keep]) - 2 * absorption_db_per_m * r[keep] + lambert_db
                + decibel(cell_ahead_m * altitude_m**2 * np.array(expected)))
    return Law("energy_ahead", "Energy of all beams together",
               "All beams of an imaging sonar together receive the integral over the fan. On a level bed by Lambert's "
               "law it is SL - 40 log r - 2 a r + μ + 10 log(c τ / 2 · h² ∫ b(u) B(u) / √(r² (1 - u²) - h²) du), over "
               "the sine u along the array, with the transmitter's pattern b and the sum B of the beams' patterns.",
               "dB", 0.03, np.abs(measured[keep] - expected).max(),
               compared(r[keep], [("257 beams", expected, measured[keep])], "slant range, m",
                        "sum of levels, dB re 1 µPa²"))


@law
def sidescan_ahead():
    same = {"frequency_hz": 750e3, "source_level_db": 200.0, "pulse": "lfm", "bandwidth_hz": 60e3,
            "pulse_length_s": 1e-3, "window": "hann", "range_m": 25.0, "bins": 800, "focused": True, "side_lobes": 3,
            "elevations": 512, "vertical_beamwidth_deg": 20.0, "tilt_deg": 0.0, "sector_low_deg": -25.0,
            "sector_high_deg": 25.0, "noise": False}
    whole = ahead_scene({**same, "transmit_beamwidth_deg": 50.0})
    # A transmitter that is 50 degrees wide, and the receiver's array.
    transmitter_m = 0.4429465 * speed_mps / 750e3 / np.sin(np.radians(25.0))
    whole["sonar"]["side"] = {**same, "sides": "starboard", "mount_azimuth_deg": -90.0,
                              "array_length_m": transmitter_m, "receive_array_length_m": 0.1}
    simulator, pose = ensonify.Simulator(whole), ensonify.Pose(0, 0, -10.0)
    levels, r = frame(simulator, pose)
    keep = r > 7.8
    expected = decibel(starboard(simulator, pose)["intensity_mean"])[keep]
    measured = decibel(levels[beams_ahead // 2])[keep]
    return Law("sidescan_ahead", "The middle beam and a sidescan",
               "The middle beam of an imaging sonar has the levels of a sidescan that is turned to look ahead, with the "
               "same arrays. (Both are the program's. The sidescan's level over range is the first law of this page.)",
               "dB", 0.05, np.abs(measured - expected).max(),
               compared(r[keep], [("level bed", expected, measured)], "slant range, m", "level, dB re 1 µPa²"))


def speckle_ahead(simulator, pose, beams):
    """Intensity over its mean, in the ranges in which the bed is."""
    intensity, r = frame(simulator, pose, "intensity")
    mean, _ = frame(simulator, pose)
    keep = (r > 9.3) & (r < 24.4)
    return intensity[np.ix_(beams, keep)] / mean[np.ix_(beams, keep)]


def correlation(a, b):
    return np.corrcoef(a.ravel(), b.ravel())[0, 1]


@law
def speckle_of_beams():
    whole = ahead_scene()
    whole["speckle"] = True
    simulator, apart = ensonify.Simulator(whole), np.arange(1, 7)
    x = np.sin(np.radians(bearings_deg))
    beams = np.arange(40, beams_ahead - 40)
    values = [speckle_ahead(simulator, ensonify.Pose(3.0 * i, 0, -10.0), beams) for i in range(-2, 3)]
    measured = np.array([np.mean([correlation(one[:-n], one[n:]) for one in values]) for n in apart])
    at = np.linspace(-4, 4, 16001)  # three side lobes are traced to either side
    shared = {a: (np.sinc(at) * np.sinc(at - a) * (np.abs(at - a) < 4)).sum() for a in np.arange(0, 4, 0.01)}
    share = np.array(list(shared.values())) / shared[0.0]
    expected = np.array([(np.interp(per_sine_ahead * (x[beams][n:] - x[beams][:-n]), list(shared), share) ** 2).mean()
                         for n in apart])
    return Law("speckle_of_beams", "Speckle of neighbouring beams",
               "Beams that overlap receive the same scatterers. The correlation of their intensities is the square of "
               "that of their fields (van Cittert and Zernike), ∫ p(x) p(x - a) dx / ∫ p² dx with a = L (s - s') / λ. "
               "That is sinc(a) for a focused uniform array with all its lobes; three to either side are traced here, "
               "which makes it up to 0.02 more. Over five frames, and beams up to 45 degrees.",
               "", 0.01, np.abs(measured - expected).max(),
               compared(apart, [("beams at every half a degree", expected, measured)], "beams apart", "correlation"))


@law
def speckle_of_frames():
    moved_m, starts_m, range_m, series = np.arange(0, 0.065, 0.01), np.arange(-10.0, 11.0, 2.0), 17.0, []
    x = np.linspace(-5, 5, 20001)  # of directions off the beam's axis, over λ / L

    def pattern(x):  # three side lobes are traced to either side
        return np.where(np.abs(x) < 4, np.sinc(x), 0)
    fields = np.array([(pattern(x) * pattern(x - per_sine_ahead * d / range_m)
                        * np.exp(4j * np.pi * d / 0.1 * x)).sum() for d in moved_m])
    expected = np.abs(fields / fields[0]) ** 2
    for planes in (4, 16):
        whole = ahead_scene({"beams": 17, "field_of_view_deg": 8.0, "transmit_beamwidth_deg": 130.0, "planes": planes})
        whole["speckle"] = True
        simulator = ensonify.Simulator(whole)
        frames = [[speckle_ahead(simulator, ensonify.Pose(start_m + d, 0, -10.0), np.arange(17)) for d in moved_m]
                  for start_m in starts_m]
        measured = np.array([np.mean([correlation(one[0], one[i]) for one in frames]) for i in range(moved_m.size)])
        series.append((f"{planes} planes in a beam", expected, measured))
    return Law("speckle_of_frames", "Speckle of a sonar that moves sideways",
               "Scatterers stay on the ground. Moved by d along its array, a beam receives a direction v from its axis "
               "with the phase 4 π d v / λ more, so the correlation of intensities is |∫ p(v) p(v - d / r) "
               "exp(4 π i d v / λ) dv|², nearly (1 - 2 d / L)². The program's frames lose some hundredths more than "
               "that in the first two centimetres, with few planes and with many, hence the wide bound. Over 11 pairs "
               "of frames and beams up to 4 degrees.",
               "", 0.12, max(np.abs(measured - expected).max() for _, _, measured in series),
               compared(moved_m, series, "moved, m", "correlation"))


@law
def shadow_ahead():
    height_m, wide_m, thick_m = 3.0, 4.0, 0.2
    places, series, worst = np.array([6.0, 7.0, 8.0, 9.0, 10.0]), [], 0.0
    bearings = np.radians(bearings_deg)
    for tall_m in (0.8, 1.5):
        expected, measured = [], []
        for north_m in places:
            simulator = ensonify.Simulator(ahead_scene(objects=[
                {"shape": "box", "length_m": thick_m, "width_m": wide_m, "tall_m": tall_m, "north_m": north_m,
                 "material": "concrete"}]))
            regions, r = frame(simulator, ensonify.Pose(0, 0, height_m - 13.0), "region")
            end_m = np.hypot((north_m + thick_m / 2) * height_m / (height_m - tall_m), height_m)
            dark = regions[beams_ahead // 2] == 4
            expected.append(end_m)
            measured.append(r[dark & (r < end_m + 2)].max() + (r[1] - r[0]) / 2)
            # Seen from above, the edges of the shadow are the lines through the near corners.
            edge = np.arctan2(wide_m / 2, north_m - thick_m / 2)
            at = np.argmin(np.abs(r - 0.97 * end_m))
            sure = np.abs(np.abs(bearings) - edge) > np.radians(1.5)
            if ((regions[:, at] == 4) != (np.abs(bearings) < edge))[sure].any():
                worst = np.inf
        series.append((f"{tall_m} m tall", np.array(expected), np.array(measured)))
        worst = np.maximum(worst, np.abs(np.array(measured) - expected).max())
    return Law("shadow_ahead", "A shadow in the beams",
               "A box of height t whose far edge is at ground distance d shades the bed as far as d h / (h - t) in the "
               "middle beam of an imaging sonar at height h: to two bins of 0.03 m. Over the beams the shadow ends at "
               "the lines through the box's near corners, to 1.5 degrees: if it does not, the deviation is infinite.",
               "m", 0.0625, worst, compared(places, series, "distance of the box, m", "slant range, m"))


# Applied Physics Laboratory, University of Washington, TR 9407 (1994), section IV, table 3: 30 kHz.
handbook_deg = np.array([1, 2, 3, 5, 7, 10, 20, 40, 60, 70, 80, 85, 88, 89, 90])
handbook_db = {
    "medium sand": [-51.4, -48.1, -45.8, -42.1, -39.0, -35.4, -28.3, -23.5, -21.2, -17.7, -10.8, -5.5, -3.4,
                    -3.1, -3.1],
    "very fine sand": [-59.7, -54.7, -50.8, -44.6, -40.1, -35.2, -27.1, -24.9, -23.7, -23.1, -20.2, -13.1,
                       -5.9, -4.3, -3.8],
    "sandy mud": [-58.2, -51.1, -46.6, -41.3, -38.3, -35.7, -31.8, -28.8, -27.4, -27.0, -26.3, -23.9, -13.1,
                  -6.8, -3.6]}


def table_of(program, *arguments):
    text = subprocess.run([program, *arguments], check=True, capture_output=True, text=True).stdout
    return list(csv.DictReader(io.StringIO(text)))


@law
def backscatter():
    series, worst = [], 0.0
    for name, published in handbook_db.items():
        rows = table_of(program, "backscatter", "--sediment", name, "--frequency-hz", "30000",
                        "--sound-speed-mps", "1528", "--model", "tr9407")
        angle = np.array([float(row["grazing_deg"]) for row in rows])
        strength = np.array([float(row["strength_db"]) for row in rows])
        measured = np.interp(handbook_deg, angle, strength)
        series.append((name, np.array(published), measured))
        worst = np.maximum(worst, np.abs(measured - published).max())
    return Law("backscatter", "Backscatter of the bottom",
               "Strength over the grazing angle at 30 kHz, against table 3 of APL-UW TR 9407 (1994), which is "
               "printed to 0.1 dB.",
               "dB", 0.15, worst, compared(handbook_deg, series, "grazing angle, degrees", "S_b, dB"))


@law
def measured_beds():
    # Olson, Lyons and Saebo, JASA 139, 1833 (2016): outcrops at 100 kHz and 20 degrees, abstract. Lyons and
    # Pouliquen (1998): dense seagrass, about -23 dB at all angles.
    published = {"rock": (20, -33.0, -26.0), "rough rock": (20, -30.0, -20.0), "seagrass": (23, -24.0, -22.0)}
    curves, worst = {}, 0.0
    for name in [*published, "medium sand", "clay"]:
        rows = table_of(program, "backscatter", "--material", name, "--frequency-hz", "100000",
                        "--sound-speed-mps", "1500")
        curves[name] = np.array([[float(row["grazing_deg"]), float(row["strength_db"]),
                                  float(row["bound_db"])] for row in rows]).T
    for name, (at, low, high) in published.items():
        level = np.interp(at, *curves[name][:2])
        worst = np.max([worst, low - level, level - high])

    def draw(axes, below):
        for name, (angle, strength, bound) in curves.items():
            line, = axes.plot(angle, strength, label=name)
            if name in published:
                at, low, high = published[name]
                axes.plot([at, at], [low, high], linewidth=5, alpha=0.4, color=line.get_color())
            below.plot(angle, strength - bound, color=line.get_color())
        axes.set(ylabel="S_b, dB", ylim=(-45, 0))
        below.set(xlabel="grazing angle, degrees", ylabel="over bound, dB", ylim=(-35, 12))
        axes.legend(fontsize=7)
    return Law("measured_beds", "Levels that were measured at 100 kHz",
               "Bars: rock outcrops (Olson, Lyons and Sæbø, JASA 139, 1833, 2016) and dense seagrass (Lyons and "
               "Pouliquen 1998), the published range. Lines: the program's materials. Below: how far each is from "
               "what an opaque surface can scatter back diffusely; a lobe near vertical may be over it. No "
               "calibrated levels of sand above 100 kHz were at hand: [levels](../scatter/levels.md).",
               "dB outside of the range", 0, worst, draw)


@law
def refraction():
    # A constant gradient g: rays are arcs of circles of radius c / (g cos(angle)).
    gradient, surface_mps = 0.05, 1480.0
    with tempfile.TemporaryDirectory() as folder:
        cast = pathlib.Path(folder, "cast.csv")
        cast.write_text(f"depth_m,soundspeed_mps\n0,{surface_mps}\n500,{surface_mps + 500 * gradient}\n")
        series, worst = [], 0.0
        at = np.linspace(10, 1500, 60)
        for launch_deg in (-5.0, 0.0, 5.0):
            rows = table_of(program, "ray", "--profile", str(cast), "--source-depth-m", "200",
                            f"--launch-deg={launch_deg}", "--range-m", "1500")
            x = np.array([float(row["range_m"]) for row in rows])
            z = np.array([float(row["depth_m"]) for row in rows])
            angle = np.radians(launch_deg)
            radius = (surface_mps + 200 * gradient) / gradient / np.cos(angle)
            expected = 200 - radius * np.cos(angle) + np.sqrt(radius**2 - (at - radius * np.sin(angle))**2)
            # The program's rows are dense: straight lines between them stay within 0.1 mm.
            measured = np.interp(at, x, z)
            series.append((f"launched at {launch_deg:+.0f} degrees", expected, measured))
            worst = np.maximum(worst, np.abs(measured - expected).max())

    def draw(axes, below):
        compared(at, series, "range, m", "depth, m")(axes, below)
        axes.invert_yaxis()
    return Law("refraction", "Bent rays",
               "In water whose sound speed grows evenly with depth, rays are arcs of circles of radius "
               "c / (g cos(angle)).", "m", 0.001, worst, draw)


@law
def water():
    # UNESCO 44 (1983), check value of Chen and Millero; Francois and Garrison (1982), table IV.
    rows = table_of(program, "water", "--temperature-c", "39.9904", "--salinity-psu", "40", "--pressure-dbar",
                    "10000")
    of = {row["formula"]: float(row["value"]) for row in rows if row["quantity"].startswith("sound_speed")}
    name = next(name for name in of if "chen" in name.lower())
    return Law("water", "Sound speed in sea water",
               "Chen and Millero's formula at 40 degrees (IPTS-68), 40 psu and 10,000 dbar gives 1731.995 m/s "
               f"(UNESCO 44, 1983); the program: {of[name]:.3f} m/s.",
               "m/s", 0.002, abs(of[name] - 1731.995), None)


@law
def intersectors():
    path = pathlib.Path(__file__).parent.parent / "scenes/ripples.toml"
    run = subprocess.run([program, "check", str(path), "--rays", "5e4", "-D", "track.pings=20", "--quiet"],
                         capture_output=True, text=True)
    rays, unexplained = {}, {}
    for row in csv.DictReader(io.StringIO(run.stdout)):
        of = row["surface"], row["intersector"]
        rays[of] = rays.get(of, 0) + int(row["rays"])
        unexplained[of] = unexplained.get(of, 0) + int(row["unexplained"])
    table = "".join(f"| {surface} | {name} | {rays[surface, name]:,} | {unexplained[surface, name]} |\n"
                    for surface, name in rays)
    return Law("intersectors", "Agreement of intersectors",
               "`ensonify check` compares every surface and intersector with the exact reference, on rays of "
               "`scenes/ripples.toml` and on rays aimed at vertices and edges.\n\n"
               f"| surface | intersector | rays | unexplained differences |\n|---|---|---|---|\n{table}",
               "unexplained", 0, float(sum(unexplained.values()) if run.returncode == 0 else np.inf), None)


transfer_results = pathlib.Path(__file__).resolve().parent.parent / "bench/transfer/results.json"


def transfer():
    rows = json.loads(transfer_results.read_text())
    table, errors = "", {}
    for name, row in rows.items():
        found = row["network"]["reporting"]
        accuracy, auc = found["balanced_accuracy"], found["auc"]
        table += (f"| {name} | {row['samples']} | {row['steps']} | {accuracy['mean']:.2f} "
                  f"({accuracy['interval'][0]:.2f} to {accuracy['interval'][1]:.2f}) | {auc['mean']:.2f} "
                  f"({auc['interval'][0]:.2f} to {auc['interval'][1]:.2f}) |\n")
        errors[name] = 1.0 - accuracy["mean"]
    pictures = next(iter(rows.values()))["network"]["reporting"]["pictures"]
    return Law("transfer", "Networks for real pictures",
               "A network that was trained on images of `scenes/transfer_targets.toml` alone distinguishes wrecks from "
               f"aircraft on real pictures, {pictures[1]} and {pictures[0]} of them. The bound is chance. The page "
               "does not measure this again: [bench/transfer](../bench/transfer/README.md) explains how it was "
               "measured.\n\n| trained on | samples | batches | balanced accuracy (95 %) | area under the curve "
               f"(95 %) |\n|---|---|---|---|---|\n{table}",
               "of pictures named wrongly, evenly over the classes", 0.5,
               errors["long training"], None)


if transfer_results.exists():
    law(transfer)


def main():
    global program
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    results = []
    for function in laws:
        print(function.__name__, file=sys.stderr)
        results.append(function())
    page = ["# Validation\n\nWhat the program gives, next to closed forms and published values. The laws are "
            "written out again for this page, in `doc/validation.py`, without the program's own code. "
            f"`./dev docs` makes the page again; this is ensonify {ensonify.__version__}. The tests hold more laws: "
            "`tests/physics`. The pages of the formulas also have what is left out: "
            "[the sonar](../engine/sonar/README.md#the-expected-echo), [sound](../scatter/README.md).\n\n"
            "| law | largest deviation | bound | |\n|---|---|---|---|\n"]
    for one in results:
        page.append(f"| [{one.title}](#{one.title.lower().replace(' ', '-')}) | {one.worst:.2g} {one.unit} | "
                    f"{one.bound:g} | {'holds' if one.holds else '**does not hold**'} |\n")
    for one in results:
        page.append(f"\n## {one.title}\n\n{one.text}\n")
        if one.draw:
            figure, axes = plt.subplots(2, sharex=True, height_ratios=(3, 1))
            one.draw(*axes)
            figure.savefig(folder / f"{one.name}.svg", metadata={"Date": None})
            plt.close(figure)
            page.append(f"\n![{one.title}: law and program]({one.name}.svg)\n")
    (folder / "validation.md").write_text("".join(page))
    for one in results:
        print(f"{one.title}: {one.worst:.3g} {one.unit}, bound {one.bound:g}", file=sys.stderr)
    return 0 if all(one.holds for one in results) else 1


if __name__ == "__main__":
    sys.exit(main())
