#!/usr/bin/env python3
"""Draws scenes/effects.png again: one small picture per effect of scenes/effects.md.

    effects.py PROGRAM PICTURE
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

PANEL_PX, GAP_PX = (250, 100), 6
SONAR = "sonar.sidescan."

# By rows of the picture; scenes/effects.md lists the same.
ROWS = (
    ([], ["speckle=false"], [SONAR + "looks=4"], [SONAR + "noise=false"]),
    (["arrivals.volume=true", "sea.volume_scattering_db=-55"],
     ["arrivals.surface=true", "sea.wind_mps=8"], ["arrivals.multiples=true"],
     ["arrivals.double_bounce=true"]),
    (["arrivals.burst_m=0.8"], ["arrivals.crosstalk_db=-12"], ["artefacts.lost=0.06"],
     ["artefacts.repeated=0.5"]),
    (["artefacts.interference_db=65", "artefacts.interference_range_m=34"],
     ["artefacts.interference_db=65", "artefacts.interference_drift_m=1.3"],
     ["artefacts.gain_step_db=5", "artefacts.gain_step_s=6"], ["artefacts.automatic_gain=0.9"]),
    (["artefacts.fish_per_hectare=200"], ["artefacts.wake_db=35"], ["artefacts.shimmer_db=2"],
     ["motion.heave.rms_m=0.5"]),
    (["motion.heading.rms_deg=2"],
     ["track.kind=lawn-mower", "track.legs=2", "track.leg_length_m=22", "track.leg_spacing_m=26"],
     ["display.slant_range_correction=true"], ["display.beam_normalisation=true"]),
    (["display.flat_field=true"], ["display.mapping=logarithmic"],
     ["display.mapping=equalised"], ["display.palette=paper"]),
)

# The box to starboard, and a sonar like that of ripples.toml.
BOX = """
[[objects]]
shape = "box"
class = "box"
east_m = 24
north_m = 8
length_m = 12
width_m = 6
tall_m = 3
"""


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    program, picture = sys.argv[1], Path(sys.argv[2])
    scene = (Path(__file__).parents[1] / "scenes/ripples.toml").read_text()
    width, height = PANEL_PX
    sheet = Image.new("L", (4 * (width + GAP_PX) - GAP_PX, len(ROWS) * (height + GAP_PX) - GAP_PX),
                      255)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scene.toml"
        file.write_text(scene + BOX)
        for row, panels in enumerate(ROWS):
            for column, effect in enumerate(panels):
                run = Path(folder) / f"{row}_{column}"
                keys = ["conditions=ideal", "display.palette=grey", "output.exr=false"]
                if not any(key.startswith("track.kind") for key in effect):
                    keys.append("track.pings=300")
                subprocess.run([program, "run", str(file), "-o", str(run), "--quiet"]
                               + [part for key in keys + effect for part in ("-D", key)],
                               check=True)
                shown = Image.open(run / "sidescan.png").convert("L")
                sheet.paste(shown.resize(PANEL_PX, Image.BOX),
                            (column * (width + GAP_PX), row * (height + GAP_PX)))
    sheet.save(picture, optimize=True)
    print(picture)


if __name__ == "__main__":
    main()
