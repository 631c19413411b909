#!/usr/bin/env python3
"""Attacks the program, each row for a given time, and reports what was tried and what failed.

usage: soak.py PROGRAM FAILING_CALLS_LIBRARY FOLDER [--seconds S] [--rows ROW,ROW]
               [--write doc/reliability.md]

A row repeats trials until its time is over; each trial has separate random numbers, from the
row's name and the trial's number. FOLDER/report.json counts the trials of all calls, so a later
call continues with new ones; it starts again if the program has changed. The exit code is 1 if a
trial failed. A failed trial's inputs stay in FOLDER/failed.
"""

import argparse
import hashlib
import json
import pathlib
import random
import sys
import time

from attack import PROJECT, Failed, Program, Row
from damaged_files import DamagedCache, DamagedInputs
from disturbances import FailingCalls, Kills, LittleDisk, LittleMemory, SameBytes, Terminations, Together
from jobs import make_jobs
from random_trials import RandomDatasets, RandomRuns, RandomSessions
from servers import LivePage, LongStream


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


ROWS = {"rays": Rays, "kills": Kills, "terminations": Terminations, "failing-calls": FailingCalls,
        "little-memory": LittleMemory, "little-disk": LittleDisk, "together": Together,
        "same-bytes": SameBytes, "random-scenes": RandomRuns, "random-sessions": RandomSessions,
        "random-datasets": RandomDatasets, "damaged-cache": DamagedCache,
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
        before = result["tried"]
        # Longer if no trial succeeded or failed yet: some draws make nothing to try.
        while (spent := time.monotonic() - start) < options.seconds or \
                (result["tried"] == before and not failures and spent < options.seconds + 300):
            trial, result["trials"] = result["trials"], result["trials"] + 1
            try:
                result["tried"] += row.trial(random.Random(f"{name} {trial}"))
            except Failed as problem:
                failures += 1
                result["failures"].append({"trial": trial, "problem": str(problem)})
                print(f"{name}, trial {trial}: {problem}", file=sys.stderr)
        result["seconds"] += spent
        if result["tried"] == before:
            failures += 1
            print(f"{name}: no trial made anything to try", file=sys.stderr)
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
