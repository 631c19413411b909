#!/usr/bin/env python3
"""How near the pictures of runs come to real recordings, statistic by statistic.

    measure.py PROGRAM DATA RUN...

PROGRAM is `ensonify`, DATA the folder of recordings (sidescan/*.xtf), each RUN the folder of a run.
Prints for each statistic of `ensonify compare` the least and greatest value of the recordings, the
median, least and greatest of the runs, and whether that median lies between the recordings'.
The statistics are of amplitudes as recorded; doc/statistics.md defines them.
"""

import json
import statistics
import subprocess
import sys
from pathlib import Path

# What distinguishes simulated pictures from real ones; levels over range and angle depend on the scene.
SHOWN = (
    "kurtosis", "bright_per_10000", "contrast", "skew", "range_correlation", "track_correlation",
    "tone_change",
    "ping_brightness", "column_over_bed", "column_bright", "first_return_wander", "first_return_overshoot",
    "clipped_share",
)


def statistics_of(program, line):
    """The statistics of a recording or run: it is compared with itself."""
    done = subprocess.run([program, "compare", "--json", str(line), str(line)],
                          capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{line}: {done.stderr.strip()}")
    return {name: row["a"] for name, row in json.loads(done.stdout)["statistics"].items()
            if name.startswith(SHOWN)}


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    program, data, runs = sys.argv[1], Path(sys.argv[2]), sys.argv[3:]
    recordings = sorted((data / "sidescan").glob("*.xtf"))
    if not recordings:
        sys.exit(f"{data}: has no sidescan/*.xtf; name the folder that holds the recordings")
    real = [statistics_of(program, recording) for recording in recordings]
    ours = [statistics_of(program, run) for run in runs]
    print("statistic,real_least,real_greatest,ours_median,ours_least,ours_greatest,inside")
    inside = known = 0
    for name in real[0]:
        theirs = [line[name] for line in real if line[name] is not None]
        its = [line[name] for line in ours if line[name] is not None]
        if not theirs or not its:
            continue
        median = statistics.median(its)
        within = min(theirs) <= median <= max(theirs)
        known += 1
        inside += within
        print(f"{name},{min(theirs):.4g},{max(theirs):.4g},{median:.4g},{min(its):.4g},"
              f"{max(its):.4g},{'yes' if within else 'no'}")
    print(f"# {inside} of {known} medians lie between {len(real)} recordings; {len(ours)} runs")


if __name__ == "__main__":
    main()
