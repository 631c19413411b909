"""Attacks by files with changed bytes."""

import shutil

from attack import Failed, Row, tree
from jobs import tiny_recipe


class DamagedCache(Row):
    title = "a cached seafloor cut short or with changed bytes: never used"

    def trial(self, draw):
        job = draw.choice([j for j in self.jobs if j.name.startswith("run") and j.name != "run in parts"])
        if not (job.folder / "cache").exists():
            job.finish()
        shutil.rmtree(job.folder / "out")
        file = draw.choice([f for f in (job.folder / "cache").rglob("*") if f.is_file()])
        damage(file, draw)
        job.finish()
        return 1


def damage(file, draw):
    """Cuts a file short, changes or inserts bytes, or repeats a part of it, until it differs."""
    whole = file.read_bytes()
    data = bytearray(whole)
    most = draw.randint(1, 4)
    changes = 0
    while changes < most or data == whole:
        changes += 1
        at, size = draw.randrange(len(data) + 1), draw.choice([1, 2, 4, 8, 100])
        how = draw.randrange(6)
        if how == 0:
            del data[at:]
        elif how == 1:
            data[at:at + size] = draw.randbytes(len(data[at:at + size]))
        elif how == 2:
            data[at:at] = draw.randbytes(size)
        elif how == 3:
            data[at:at] = data[at:at + size]
        elif how == 4:
            del data[at:at + size]
        else:
            data[at:at + 4] = draw.choice([b"\xff\xff\xff\xff", b"\0\0\0\0", b"1e99", b"-1 0", b"nan ",
                                           b"\xff\xff\xff\x7f"])
    file.write_bytes(bytes(data))


class DamagedInputs(Row):
    title = "damaged meshes, grids, scenes, recipes, tables and recordings: a message, no output left"

    def __init__(self, *args):
        super().__init__(*args)
        inputs = self.folder / "inputs"
        shutil.rmtree(inputs, ignore_errors=True)
        inputs.mkdir()
        sample = self.jobs[0].folder.parent / "whole/samples/000000"
        shutil.copy(sample / "scene.toml", inputs)
        (inputs / "recipe.toml").write_text(tiny_recipe(2))
        for name in ("bed.ply", "bed.tif", "bed.npy"):
            self.program.check(["seafloor", sample / "scene.toml", "-o", name, "-D",
                                "seafloor.cell_m=4", "-D", "track.origin_lat_deg=55", "-D",
                                "track.origin_lon_deg=-10"], inputs)
        for pattern in ("*.xtf", "*.jsf"):
            for file in sample.glob(pattern):
                shutil.copy(file, inputs)
        (inputs / "box.obj").write_text(
            "v 0 0 0\nv 4 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
        (inputs / "bed.off").write_text("OFF\n4 2 0\n0 0 -9\n9 0 -9\n9 9 -8\n0 9 -9\n3 0 1 2\n3 0 2 3\n")
        (inputs / "bed.asc").write_text(
            "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 2\nNODATA_value -9999\n"
            "-9 -9.5 -10\n-9 -9999 -8\n")
        self.inputs = sorted(inputs.iterdir())

    def trial(self, draw):
        source = draw.choice(self.inputs)
        file = self.folder / f"damaged{source.suffix}"
        shutil.copy(source, file)
        damage(file, draw)
        commands = {".ply": ["mesh-info"], ".obj": ["mesh-info"], ".off": ["mesh-info"],
                    ".asc": ["mesh-info"], ".tif": ["mesh-info"], ".npy": ["mesh-info"],
                    ".xtf": ["imitate", "-o", "out"], ".jsf": ["imitate", "-o", "out"]}
        command = commands.get(source.suffix, ["run", "-o", "out", "--quiet", "--memory", "500MB", "-D",
                                               "track.pings=2"])
        if source.name == "recipe.toml":
            command = ["generate", "--dry-run", "-o", "out", "--quiet"]
        shutil.rmtree(self.folder / "out", ignore_errors=True)
        code, _ = self.program.check([*command, file.name], self.folder, timeout_s=60)
        if code not in (0, 75) and (self.folder / "out").exists():
            left = tree(self.folder / "out")
            if left:
                raise Failed(f"{source.name}: exit code {code}, but {', '.join(left)} stay")
        return 1
