#!/usr/bin/env python3
"""Attacks the program, each row for a given time, and reports what was tried and what failed.

usage: soak.py PROGRAM FAILING_CALLS_LIBRARY FOLDER [--seconds S] [--rows ROW,ROW]
               [--write doc/reliability.md]

A row repeats trials until its time is over; each trial has random numbers of its own, from the
row's name and the trial's number. FOLDER/report.json counts the trials of all calls, so a later
call continues with new ones; it starts again if the program has changed. The exit code is 1 if a
trial failed. A failed trial's inputs stay in FOLDER/failed.
"""

import argparse
import contextlib
import hashlib
import http.client
import json
import os
import pathlib
import random
import resource
import shutil
import signal
import socket
import subprocess
import sys
import time
import zipfile

import random_scenes

PROJECT = pathlib.Path(__file__).resolve().parents[2]
EXIT_CODES = {0, 1, 2, 3, 75}  # of the program; a signal ends it with another
MB = 1 << 20


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


class Failed(Exception):
    """A trial that failed, with what is wrong."""


def tiny_recipe(samples):
    header = (PROJECT / "tests/support/tiny_recipe.h").read_text()
    recipe = header.split('R"(')[1].split(')"')[0]
    return recipe.replace("samples = 8", f"samples = {samples}").replace(
        "seafloors = 4", f"seafloors = {samples}")


def tree(folder):
    """The hash of every file under a folder, by its path."""
    return {str(file.relative_to(folder)): hashlib.sha256(file.read_bytes()).hexdigest()
            for file in sorted(pathlib.Path(folder).rglob("*")) if file.is_file()}


def check_same(found, expected, what):
    for name in sorted(found.keys() | expected.keys()):
        if found.get(name) != expected.get(name):
            state = "missing" if name not in found else "left" if name not in expected else "different"
            raise Failed(f"{what}: {name} is {state}")


class Program:
    def __init__(self, path, failing_calls):
        self.path = str(pathlib.Path(path).resolve())
        self.failing_calls = str(pathlib.Path(failing_calls).resolve())

    def start(self, args, folder, fail=None, limits=(), env=None, **options):
        """Starts the program. `fail` holds settings of failing_calls.cpp without their prefix."""
        environment = dict(os.environ, **(env or {}))
        if fail:
            environment["LD_PRELOAD"] = self.failing_calls
            environment.update({f"ENSONIFY_{name}": str(value) for name, value in fail.items()})

        def set_limits():
            for which, most in limits:
                resource.setrlimit(which, (most, most))

        return subprocess.Popen([self.path, *map(str, args)], cwd=folder, env=environment,
                                preexec_fn=set_limits if limits else None,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)

    def run(self, args, folder, stop=None, text=b"", timeout_s=300, **how):
        """Runs it to its end, or sends it the signal stop = (signal, after this many seconds)."""
        process = self.start(args, folder, stdin=subprocess.PIPE, **how)
        if stop:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(stop[1])
            process.send_signal(stop[0])
        try:
            out, err = process.communicate(text, timeout_s)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            raise Failed(f"{' '.join(map(str, args))}: not finished after {timeout_s} s") from None
        return process.returncode, out, err.decode(errors="replace")

    def check(self, *args, codes=EXIT_CODES, **how):
        """The exit code of a run that ends as the documentation says, and its output."""
        code, out, err = self.run(*args, **how)
        if code == 127 and "error while loading shared libraries" in err:
            return code, out  # it did not begin
        if code not in codes:
            raise Failed(f"{' '.join(map(str, args[0]))}: exit code {code}; {err.strip()[-400:]}")
        if code not in (0, 75) and not err.strip():
            raise Failed(f"{' '.join(map(str, args[0]))}: exit code {code} without a message")
        return code, out


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


class Row:
    """One way to break the program."""

    title = ""
    unit = "trials"

    def __init__(self, program, jobs, folder):
        self.program, self.jobs, self.folder = program, jobs, folder

    def trial(self, draw):
        """Raises Failed, or returns how many of its unit were tried."""
        raise NotImplementedError


class Rays(Row):
    title = "rays by every surface and intersector, compared with the exact reference"
    unit = "rays"
    scenes = ("ripples", "boulders", "rocky", "wreck", "outcrop", "clutter")

    def trial(self, draw):
        scene = PROJECT / f"scenes/{draw.choice(self.scenes)}.toml"
        code, out, err = self.program.run(
            ["check", scene, "--rays", "20000", "--json", "--quiet", "-D",
             f"seed={draw.randrange(1 << 31)}", "--cache", self.folder], self.folder, timeout_s=3000)
        if code != 0:
            raise Failed(f"check {scene.name}: exit code {code}; {err.strip()[-400:]}")
        return sum(row["rays"] for row in json.loads(out)["rows"])


class Kills(Row):
    title = "SIGKILL at any time, then the same command again: the same bytes, nothing left over"
    unit = "kills"

    def trial(self, draw):
        job = draw.choice([j for j in self.jobs if j.name != "stream"])
        job.clear()
        kills = 0
        for _ in range(draw.randint(1, 4)):
            code, _, err = self.program.run(job.args, job.folder,
                                            stop=(signal.SIGKILL, draw.uniform(0, job.seconds)))
            if code not in (-signal.SIGKILL, 0):
                raise Failed(f"{job.name}: exit code {code}; {err.strip()[-400:]}")
            kills += code != 0
        job.finish()
        return kills


class Terminations(Row):
    title = "SIGTERM at any time: ends within 10 s, and the same command completes the work"

    def trial(self, draw):
        job = draw.choice([j for j in self.jobs if j.name != "stream"])
        job.clear()
        code, _, err = self.program.run(job.args, job.folder, timeout_s=10 + job.seconds,
                                        stop=(signal.SIGTERM, draw.uniform(0, job.seconds)))
        if code not in (0, 75, -signal.SIGTERM, 128 + signal.SIGTERM):
            raise Failed(f"{job.name}: exit code {code}; {err.strip()[-400:]}")
        job.finish()
        return 1


class FailingCalls(Row):
    title = "the k-th call of open, write, fsync, rename, mmap or malloc fails"
    errors = {"open": (13, 28, 24), "write": (28, 5), "fsync": (5, 28), "rename": (5, 28, 13),
              "mmap": (12,), "malloc": (12,)}

    def __init__(self, *args):
        super().__init__(*args)
        self.counts = {}

    def count(self, job, call):
        """How often a job makes this call."""
        if (job.name, call) not in self.counts:
            file = self.folder / "calls"
            file.write_text("0")
            job.clear()
            job.finish(fail={"FAIL_CALL": call, "CALLS_FILE": file})
            self.counts[job.name, call] = int(file.read_text())
        return self.counts[job.name, call]

    def trial(self, draw):
        job = draw.choice(self.jobs)
        call = draw.choice([c for c in self.errors if self.count(job, c)])
        at, error = draw.randint(1, self.count(job, call)), draw.choice(self.errors[call])
        job.clear()
        try:
            job.attempt(fail={"FAIL_CALL": call, "FAIL_AT": at, "FAIL_ERRNO": error})
            if job.name != "stream":
                job.finish()
        except Failed as failed:
            raise Failed(f"call {at} of {call} ({os.strerror(error)}): {failed}") from None
        return 1


class LittleMemory(Row):
    title = "address space limited to 100 MB and more"

    def trial(self, draw):
        job = draw.choice(self.jobs)
        most = int(100 * MB * 40 ** draw.random())
        job.clear()
        try:
            job.attempt(limits=[(resource.RLIMIT_AS, most)])
            job.finish()
        except Failed as failed:
            raise Failed(f"{most >> 20} MB: {failed}") from None
        return 1


class LittleDisk(Row):
    title = "files limited in size, or a disk that is full"

    def trial(self, draw):
        job = draw.choice([j for j in self.jobs if j.name != "stream"])
        job.clear()
        if draw.random() < 0.5 or os.geteuid() != 0:
            most = int(2 ** draw.uniform(6, 20))
            try:
                job.attempt(limits=[(resource.RLIMIT_FSIZE, most)])
                job.finish()
            except Failed as failed:
                raise Failed(f"files of {most} bytes: {failed}") from None
            return 1
        out = job.folder / "out"
        most = 4 * draw.randint(1, 300)
        if subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={most}k", "none", out],
                          stderr=subprocess.DEVNULL).returncode != 0:
            return 0  # not allowed in most containers
        try:
            if job.inputs:
                with contextlib.suppress(shutil.Error, OSError):
                    shutil.copytree(job.inputs, out, dirs_exist_ok=True)
                if tree(out) != tree(job.inputs):
                    return 0
            job.attempt()
            subprocess.run(["mount", "-o", "remount,size=1g", out], check=True)
            job.finish()
        except Failed as failed:
            raise Failed(f"a disk of {most} kB: {failed}") from None
        finally:
            subprocess.run(["umount", out], check=True)
        return 1


class Together(Row):
    title = "two or eight processes in one folder, with one cache"

    def trial(self, draw):
        job = draw.choice([j for j in self.jobs if j.name != "stream"])
        job.clear()
        together = [self.program.start(job.args, job.folder, stdin=subprocess.DEVNULL)
                    for _ in range(draw.choice([2, 8]))]
        for process in together:
            _, err = process.communicate(timeout=300)
            if process.returncode not in EXIT_CODES:
                raise Failed(f"{job.name}: exit code {process.returncode}; {err.decode()[-400:]}")
        job.finish()
        return len(together)


class SameBytes(Row):
    title = "the same bytes with any number of threads, locale, time zone, umask, jumping clock, " \
            "cold and warm cache"

    def trial(self, draw):
        job = draw.choice(self.jobs)
        job.clear()
        env = {"LC_ALL": draw.choice(["C", "C.UTF-8", "de_DE.UTF-8", "tr_TR.UTF-8"]),
               "TZ": draw.choice(["UTC", "Asia/Kathmandu", "America/St_Johns", "Pacific/Kiritimati"]),
               "OMP_NUM_THREADS": str(draw.randint(1, 8))}
        fail = {"CLOCK_JUMP": draw.choice([0, 3600, 400000])}
        umask = draw.choice([0o022, 0o077, 0o002])
        threads = draw.choice([1, 2, 3, 5])
        args = job.args
        if job.name.startswith("run") or job.name == "generate":
            args = [*[a for a in args if a not in ("--threads", "2")], "--threads", threads]
        before = os.umask(umask)
        try:
            for _ in range(draw.randint(1, 2)):
                code, out = self.program.check(args, job.folder, text=job.text, env=env, fail=fail,
                                               codes={0})
                job.check_output(out)
        except Failed as failed:
            raise Failed(f"{env}, {threads} threads, umask {umask:o}, {fail}: {failed}") from None
        finally:
            os.umask(before)
        return 1


class RandomSceneFiles(Row):
    title = "scenes of random keys: a message, or the same files on every surface, with any number " \
            "of threads, and in parts"
    unit = "scenes"

    def __init__(self, program, jobs, folder):
        super().__init__(program, jobs, folder)
        self.scenes = random_scenes.RandomScenes(
            program.check(["schema", "--json-schema"], folder, codes={0})[1])

    def trial(self, draw):
        scene = self.scenes.draw(draw)
        file = self.folder / "scene.toml"
        for _ in range(60):
            file.write_text(random_scenes.toml(scene))
            code, message = self.make("whole")
            if code == 0:
                break
            if not random_scenes.repair(scene, message):
                return 0
        else:
            return 0
        expected = contents(self.folder / "whole")
        ways = {"threads": ["--threads", draw.choice([1, 3, 5])]}
        if "embree" not in scene["run"].get("intersector", ""):
            for surface in ("static", "refined", "footprint"):
                ways[surface] = ["--surface", surface]
        display = scene["display"]
        if not (display.get("flat_field") or display.get("beam_normalisation") or
                display.get("mapping") == "equalised"):
            ways["parts"] = ["-D", "output.pings_per_file=2", "-D", "output.file_per_leg=false"]
        for way, args in ways.items():
            code, message = self.make(way, *args)
            if code == 2 and way in ("static", "refined", "footprint"):
                continue  # the scene does not allow that surface
            if code != 0:
                raise Failed(self.kept(f"{way}: exit code {code}; {message}"))
            found = contents(self.folder / way)
            common = expected if way != "parts" else \
                {name: hash for name, hash in expected.items()
                 if name.endswith(".png") and not name.endswith("_truth.png") and "/" not in name}
            differing = [name for name, hash in common.items() if found.get(name) != hash]
            if differing:
                raise Failed(self.kept(f"{way}: other {', '.join(differing[:5])}"))
        return 1

    def make(self, way, *args):
        shutil.rmtree(self.folder / way, ignore_errors=True)
        code, _, err = self.program.run(["run", "scene.toml", "-o", way, "--quiet", *args], self.folder)
        lines = [line for line in err.splitlines() if line and "warning:" not in line]
        if code not in (0, 1, 2) or (code != 0 and len(lines) != 1):
            raise Failed(self.kept(f"{way}: exit code {code}; {err[-400:]}"))
        return code, lines[0] if lines else ""

    def kept(self, problem):
        failed = self.folder / "failed"
        failed.mkdir(exist_ok=True)
        place = failed / f"{len(list(failed.iterdir()))}.toml"
        shutil.copy(self.folder / "scene.toml", place)
        return f"{place}: {problem}"


def contents(folder):
    """Hashes of what a run's files say, without what tells how the run was made."""
    hashes = {}
    for file in sorted(folder.rglob("*")):
        name = str(file.relative_to(folder))
        if file.suffix == ".npz":
            with zipfile.ZipFile(file) as layers:
                hashes |= {f"{name}/{layer.filename}": layer.CRC for layer in layers.infolist()
                           if layer.filename != "attributes.npy"}
        elif file.is_file() and (file.suffix in (".png", ".csv") or name.endswith("_targets.json")):
            hashes[name] = hashlib.sha256(file.read_bytes()).hexdigest()
    return hashes


class DamagedCache(Row):
    title = "a cached seafloor cut short or with changed bytes: noticed, never used"

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
    """Cuts a file short, changes or inserts bytes, or repeats a part of it."""
    data = bytearray(file.read_bytes())
    for _ in range(draw.randint(1, 4)):
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


class LongStream(Row):
    title = "long streams: memory, descriptors and threads do not grow"
    unit = "pings"
    warm, pings = 200, 800

    def trial(self, draw):
        job = next(j for j in self.jobs if j.name == "stream")
        process = self.program.start(job.args, job.folder, stdin=subprocess.PIPE)
        own = pathlib.Path(f"/proc/{process.pid}")

        def state():
            status = dict(line.split(":\t") for line in (own / "status").read_text().splitlines()
                          if ":\t" in line)
            return (int(status["RssAnon"].split()[0]), len(list((own / "fd").iterdir())),
                    int(status["Threads"]))

        def answer():
            line = process.stdout.readline()
            if not line:
                raise Failed(f"ended: {process.stderr.read().decode()[-400:]}")
            return json.loads(line)

        before = None
        try:
            lines = sum(len(sonar["sides"]) * sonar["beams"] for sonar in answer()["sonars"])
            for k in range(self.pings):
                process.stdin.write(pose(k, draw))
                process.stdin.flush()
                for _ in range(lines):
                    process.stdout.read(answer()["bytes"])
                if k == self.warm:
                    before = state()
            after = state()
        finally:
            process.kill()
            process.communicate()
        if after[0] > before[0] + 1024 or after[1:] != before[1:]:
            raise Failed(f"anonymous kB, descriptors, threads: {before} at ping {self.warm}, {after} "
                         f"at ping {self.pings}")
        return self.pings


class LivePage(Row):
    title = "any request to the live page: an answer below 500, and pings continue"
    unit = "requests"

    def trial(self, draw):
        scene = self.jobs[0].folder.parent / "whole/samples/000000/scene.toml"
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        process = self.program.start(["live", scene, "--port", port, "--quiet"], self.folder,
                                     stdin=subprocess.DEVNULL)
        try:
            for _ in range(1200):  # until the seafloor is prepared
                with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1):
                    break
                time.sleep(0.1)
            paths = ["/", "/state", "/../etc/passwd", "/image", "/mesh", "/events", "/%00", "/" + "a" * 9000,
                     "//", "/state?x=" + "%ff" * 50]
            for _ in range(40):
                if draw.random() < 0.4:
                    with contextlib.suppress(OSError), \
                            socket.create_connection(("127.0.0.1", port), 1) as raw:
                        raw.sendall(draw.randbytes(draw.randint(1, 400)) +
                                    draw.choice([b"", b"\r\n\r\n", b" HTTP/1.1\r\nHost: x\r\n\r\n"]))
                    continue
                page = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
                with contextlib.suppress(TimeoutError):  # a stream of events does not end
                    page.request(draw.choice(["GET", "POST", "PUT", "HEAD", "OPTIONS"]), draw.choice(paths),
                                 headers={"Host": draw.choice([f"127.0.0.1:{port}", "example.org", ""])})
                    if page.getresponse().status >= 500:
                        raise Failed("an answer of 500 or more")
                page.close()
            if process.poll() is not None:
                raise Failed(f"ended with {process.returncode}: {process.stderr.read().decode()[-400:]}")
            page = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
            page.request("GET", "/")
            if page.getresponse().status != 200:
                raise Failed("the page is not answered after other requests")
        except (OSError, http.client.HTTPException) as problem:
            process.kill()
            raise Failed(f"{problem}; {process.stderr.read().decode()[-400:]}") from None
        finally:
            process.kill()
            process.communicate()
        return 40


ROWS = {"rays": Rays, "kills": Kills, "terminations": Terminations, "failing-calls": FailingCalls,
        "little-memory": LittleMemory, "little-disk": LittleDisk, "together": Together,
        "same-bytes": SameBytes, "random-scenes": RandomSceneFiles, "damaged-cache": DamagedCache,
        "damaged-inputs": DamagedInputs, "long-stream": LongStream, "live-page": LivePage}


def table(report):
    lines = ["| row | tried | failed | time |", "| --- | ---: | ---: | ---: |"]
    for name, row in report["rows"].items():
        lines.append(f"| {ROWS[name].title} | {row['tried']:,} {ROWS[name].unit} | {len(row['failures'])} "
                     f"| {row['seconds'] / 60:.1f} min |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("program")
    parser.add_argument("failing_calls")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--seconds", type=float, default=3600, help="for each row")
    parser.add_argument("--rows", default=",".join(ROWS))
    parser.add_argument("--write", type=pathlib.Path, help="a page whose table is renewed")
    options = parser.parse_args()
    program = Program(options.program, options.failing_calls)
    folder = options.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    report_file = folder / "report.json"
    version = hashlib.sha256(pathlib.Path(program.path).read_bytes()).hexdigest()
    report = json.loads(report_file.read_text()) if report_file.exists() else {}
    if report.get("program") != version:
        report = {"program": version, "rows": {}}
    jobs = make_jobs(program, folder / "jobs")
    failed = False
    for name in options.rows.split(","):
        if name not in ROWS:
            parser.error(f"no row '{name}'; the rows are {', '.join(ROWS)}")
        result = report["rows"].setdefault(name, {"trials": 0, "tried": 0, "seconds": 0, "failures": []})
        (folder / name).mkdir(exist_ok=True)
        row = ROWS[name](program, jobs, folder / name)
        start = time.monotonic()
        failures = 0
        while (spent := time.monotonic() - start) < options.seconds:
            trial, result["trials"] = result["trials"], result["trials"] + 1
            try:
                result["tried"] += row.trial(random.Random(f"{name} {trial}"))
            except Failed as problem:
                failures += 1
                result["failures"].append({"trial": trial, "problem": str(problem)})
                print(f"{name}, trial {trial}: {problem}", file=sys.stderr)
        result["seconds"] += spent
        print(f"{name}: {result['tried']:,} {row.unit}, {failures} of this call failed", flush=True)
        failed = failed or failures > 0
        report_file.write_text(json.dumps(report, indent=1))
    if options.write:
        page = options.write.read_text()
        before, rest = page.split("<!-- table -->\n", 1)
        after = rest.split("<!-- end -->", 1)[1]
        options.write.write_text(f"{before}<!-- table -->\n{table(report)}\n<!-- end -->{after}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
