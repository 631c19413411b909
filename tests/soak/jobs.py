"""Commands that write, and what they write when nothing disturbs them."""

import json
import random
import shutil
import time

from attack import PROJECT, Failed, check_same, tree

# 12,000 x 60 cells: too long to be made at once.
BED_IN_TILES = """version = 1
[seafloor]
extent_east_m = 1200
extent_north_m = 6
cell_m = 0.1
[seafloor.fractal]
height_at_1m_m = 0.03
[[seafloor.patches]]
material = "sandy gravel"
share = 0.4
patch_m = 8
[track]
heading_deg = 90
pings = 60
speed_mps = 2
ping_interval_s = 1
[sonar.left-right]
range_m = 15
bins = 100
elevations = 256
"""


def tiny_recipe(samples):
    header = (PROJECT / "tests/support/tiny_recipe.h").read_text()
    recipe = header.split('R"(')[1].split(')"')[0]
    return recipe.replace("samples = 8", f"samples = {samples}").replace(
        "seafloors = 4", f"seafloors = {samples}")


class Job:
    """A command that writes into `out`, and what it writes when nothing disturbs it."""

    def __init__(self, name, program, folder, args, text=b"", inputs=None):
        self.name, self.program, self.args, self.text, self.inputs = name, program, args, text, inputs
        self.expected, self.expected_out = None, b""
        self.folder = folder
        self.clear()
        start = time.monotonic()
        self.expected_out = self.finish()
        self.seconds = time.monotonic() - start
        self.expected = tree(folder / "out")

    def clear(self):
        for name in ("out", "cache"):
            shutil.rmtree(self.folder / name, ignore_errors=True)
        (self.folder / "out").mkdir(parents=True)
        if self.inputs:
            shutil.copytree(self.inputs, self.folder / "out", dirs_exist_ok=True)

    def attempt(self, **how):
        """Disturbed: any documented exit code. Returns it."""
        code, out = self.program.check(self.args, self.folder, text=self.text, **how)
        if code == 0 and not how.get("stop"):
            self.check_output(out)
        return code

    def finish(self, **how):
        """Undisturbed: it must succeed, and write what it always writes."""
        code, out, err = self.program.run(self.args, self.folder, text=self.text, **how)
        if code != 0:
            raise Failed(f"{self.name}, undisturbed: exit code {code}; {err.strip()[-400:]}")
        if self.expected is not None:
            self.check_output(out)
        return out

    def check_output(self, out):
        check_same(tree(self.folder / "out"), self.expected, self.name)
        if out != self.expected_out:
            raise Failed(f"{self.name}: other output on stdout")


def pose(number, draw):
    """A line for `ensonify stream`."""
    values = {"t_s": 0.1 * number, "x_m": draw.uniform(-5, 5), "y_m": draw.uniform(-5, 5),
              "z_m": draw.uniform(-9, -5), "roll_deg": draw.uniform(-5, 5), "pitch_deg": 0,
              "heading_deg": draw.uniform(0, 360)}
    return json.dumps(values).encode() + b"\n"


def make_jobs(program, folder):
    """The commands that write, each small enough for a second."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "recipe.toml").write_text(tiny_recipe(2))
    for name in ("whole", "merged"):
        shutil.rmtree(folder / name, ignore_errors=True)
    generate = ["generate", folder / "recipe.toml", "--quiet", "--threads", "2", "--cache", "cache"]
    if program.run([*generate, "-o", "whole"], folder)[0] != 0:
        raise SystemExit("soak: the tiny recipe does not work")
    scene = folder / "whole/samples/000000/scene.toml"
    (folder / "tiles.toml").write_text(BED_IN_TILES)
    draw = random.Random(1)
    poses = b"".join(pose(k, draw) for k in range(5))
    run = ["run", scene, "-o", "out", "--quiet", "--cache", "cache", "-D", "run.surface=refined"]

    def job(name, args, **more):
        (folder / name).mkdir(exist_ok=True)
        return Job(name, program, folder / name, args, **more)

    return [
        job("run", run),
        job("run in parts", [*run, "-D", "output.pings_per_file=4", "-D", "output.xtf=false",
                             "-D", "output.jsf=false"]),
        *(job(name, ["run", folder / "tiles.toml", "-o", "out", "--quiet", "--cache", "cache",
                     "--surface", surface])
          for name, surface in (("run on tiles", "footprint"), ("run on clusters", "refined"))),
        job("generate", [*generate, "-o", "out"]),
        job("merge", ["merge", "out", "--quiet", "--webdataset"], inputs=folder / "whole"),
        job("analyse", ["analyse", scene, "-o", "out/bed.epm"]),
        job("stream", ["stream", scene, "--quiet", "--cache", "cache"], text=poses),
    ]
