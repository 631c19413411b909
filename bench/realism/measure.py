#!/usr/bin/env python3
"""How near the pictures of runs come to real recordings, statistic by statistic.

    measure.py PROGRAM DATA RUN...

PROGRAM is `ensonify`, DATA the folder of recordings (sidescan/*.xtf), each RUN the folder of a run.
Prints for each statistic of `ensonify compare` the least and greatest value of the recordings, the
median, least and greatest of the runs, and whether that median lies between the recordings'; then the
least and greatest value of the recordings' single sides, each of which shows a bed of its own, and
whether the median lies between these.
The statistics are of amplitudes as recorded; doc/statistics.md defines them.
"""

import json
import statistics
import struct
import subprocess
import sys
import tempfile
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


def one_side(recording, channel):
    """The bytes of an XTF file with one channel of each ping: 0 is port, 1 starboard."""
    kept, at = [recording[:1024]], 1024
    while at + 14 <= len(recording):
        kind, channels, size = recording[at + 2], *struct.unpack_from("<H4xI", recording, at + 4)
        packet = recording[at:at + size]
        at += size
        if kind == 0:  # a ping: its header, then each channel's header and samples
            place, side = 256, b""
            for _ in range(channels):
                number, samples = struct.unpack_from("<H40xI", packet, place)
                bytes_per_sample = struct.unpack_from("<H", recording, 256 + 128 * number + 6)[0]
                end = place + 64 + samples * bytes_per_sample
                if number == channel:
                    side = packet[:256] + packet[place:end]
                place = end
            if not side:
                continue
            packet = bytearray(side + bytes(-len(side) % 64))
            struct.pack_into("<H4xI", packet, 4, 1, len(packet))
        kept.append(packet)
    return b"".join(kept)


def statistics_of_sides(program, recordings):
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for recording in recordings:
            for channel in (0, 1):
                side = Path(folder) / recording.name
                side.write_bytes(one_side(recording.read_bytes(), channel))
                found.append(statistics_of(program, side))
    return found


def spread_of(name, lines):
    """The least and the greatest value of a statistic; None if no line has it."""
    values = [line[name] for line in lines if line[name] is not None]
    return (min(values), max(values)) if values else None


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    program, data, runs = sys.argv[1], Path(sys.argv[2]), sys.argv[3:]
    recordings = sorted((data / "sidescan").glob("*.xtf"))
    if not recordings:
        sys.exit(f"{data}: has no sidescan/*.xtf; name the folder that holds the recordings")
    real = [statistics_of(program, recording) for recording in recordings]
    sides = statistics_of_sides(program, recordings)
    ours = [statistics_of(program, run) for run in runs]
    print("statistic,real_least,real_greatest,ours_median,ours_least,ours_greatest,inside,"
          "sides_least,sides_greatest,inside_sides")
    inside = inside_sides = known = 0
    for name in real[0]:
        of_real, of_sides, of_ours = (spread_of(name, lines) for lines in (real, sides, ours))
        if not of_real or not of_ours:
            continue
        median = statistics.median(line[name] for line in ours if line[name] is not None)
        within, within_sides = (low <= median <= high for low, high in (of_real, of_sides))
        known += 1
        inside += within
        inside_sides += within_sides
        print(f"{name},{of_real[0]:.4g},{of_real[1]:.4g},{median:.4g},{of_ours[0]:.4g},"
              f"{of_ours[1]:.4g},{'yes' if within else 'no'},{of_sides[0]:.4g},{of_sides[1]:.4g},"
              f"{'yes' if within_sides else 'no'}")
    print(f"# {inside} of {known} medians lie between {len(real)} recordings, {inside_sides} between "
          f"their {len(sides)} sides; {len(ours)} runs")


if __name__ == "__main__":
    main()
