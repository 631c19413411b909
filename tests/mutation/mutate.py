#!/usr/bin/env python3
"""Breaks one line of the program at a time, and counts the changes that no test notices.

usage: mutate.py FOLDER [--mutants N] [--rooms ROOM,ROOM] [--again] [--write CONTRIBUTING.md]

FOLDER holds a copy of the committed tree, its build, and report.json. Each call tries up to N
mutants of each room that the report does not have yet: draws of a fixed random order over all
mutants of the room. --again tries the survivors of the report again, after tests were added. A
mutant that does not compile counts as none. A mutant is noticed if a test program of its room
fails, ends by a signal, or takes five times as long as without it.
"""

import argparse
import json
import os
import pathlib
import random
import re
import resource
import subprocess
import sys
import tempfile
import time

PROJECT = pathlib.Path(__file__).resolve().parents[2]

# The rooms, and the test programs that hold them, quick ones first: each with the tests that are
# run, as Catch2 selects them ([#FILE] has those of a file).
QUICK = "~[slow]~[.]"
ROOMS = {
    "engine/trace": {"test_engine_trace": QUICK, "test_contract": QUICK},
    "refine": {"test_refine": QUICK},
    "engine/sonar": {"test_engine_sonar": QUICK, "test_physics": QUICK},
    "engine/dataset": {"test_engine_dataset": QUICK,
                       "test_whole": "[#dataset_files_test],[#generate_test]"},
}
MEMORY_BYTES = 8 << 30  # a mutant may ask for more and more


def negated(condition):
    depth = 0
    for letter in condition.group(1):
        depth += {"(": 1, ")": -1}.get(letter, 0)
        if depth < 0:  # the match ends in a later parenthesis than the condition
            return condition.group(0)
    return f"if (!({condition.group(1)})) "


# Each pattern and what takes its place. The project's format has spaces around binary operators,
# and none in templates and pointers.
REPLACEMENTS = [
    (r" < ", " <= "), (r" <= ", " < "), (r" > ", " >= "), (r" >= ", " > "),
    (r" == ", " != "), (r" != ", " == "), (r" && ", " || "), (r" \|\| ", " && "),
    (r" \+ ", " - "), (r" - ", " + "), (r" \* ", " / "), (r" / ", " * "),
    (r" \+= ", " -= "), (r" -= ", " += "), (r"\bstd::min\(", "std::max("), (r"\bstd::max\(", "std::min("),
    (r"\btrue\b", "false"), (r"\bfalse\b", "true"), (r"\bbreak;", ";"), (r"\bcontinue;", ";"),
    (r"(?<![\w.])(\d+)(?![\w.'])", lambda number: str(int(number.group(1)) + 1)),
    (r"\bif \((.*)\) ", negated),
    (r"^(\s+)(?!return|throw|delete)[\w.:>\[\]-]+\(.*\);$", r"\1;"),  # a call
    (r"^(\s+)[\w.>\[\]()-]+ [-+*/|&]?= .*;$", r"\1;"),  # an assignment
]
# Lines whose change is no fault: declarations for the compiler, and memory taken early.
SKIPPED = re.compile(r"^\s*(//|#|using |template|namespace |static_assert|case )|\.reserve\(")


def open_parentheses(line):
    return line.count("(") - line.count(")")


def mutants(tree, room):
    """(file, line number, line, new line) for each change of the room's sources, in a fixed order."""
    found = []
    for path in sorted((tree / room).rglob("*.cpp")):
        for number, line in enumerate(path.read_text().splitlines()):
            if SKIPPED.search(line):
                continue
            quoted = [match.span() for match in re.finditer(r'"(\\.|[^"\\])*"|//.*', line)]
            for pattern, replacement in REPLACEMENTS:
                for match in re.finditer(pattern, line):
                    if any(begin <= match.start() < end for begin, end in quoted):
                        continue
                    new = replacement(match) if callable(replacement) else match.expand(replacement)
                    changed = line[:match.start()] + new + line[match.end():]
                    if changed != line and open_parentheses(changed) == open_parentheses(line):
                        found.append((str(path.relative_to(tree)), number, line, changed))
    random.Random(room).shuffle(found)
    return found


def limit_memory():
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))


class Copy:
    """A copy of the committed tree and its build. The sources of one's own tree stay as they are."""

    def __init__(self, folder):
        self.tree = folder / "tree"
        self.build = folder / "build"

    def renew(self, programs):
        if not self.tree.exists():
            subprocess.run(["git", "clone", "--quiet", "--no-checkout", PROJECT, self.tree], check=True)
        subprocess.run(["git", "-C", self.tree, "fetch", "--quiet", PROJECT, "HEAD"], check=True)
        subprocess.run(["git", "-C", self.tree, "checkout", "--quiet", "--force", "--detach",
                        "FETCH_HEAD"], check=True)
        subprocess.run(["cmake", "--preset", "release", "-D", "ENSONIFY_JOIN_SOURCES=OFF", "-B",
                        self.build], check=True, cwd=self.tree, stdout=subprocess.DEVNULL)
        if not self.compiles(programs, output=None):
            sys.exit("mutate: the tree does not build")

    def compiles(self, programs, output=subprocess.DEVNULL):
        return subprocess.run(["cmake", "--build", self.build, "--target", *programs],
                              stdout=output, stderr=output).returncode == 0

    def passes(self, program, tests, limit_s):
        with tempfile.TemporaryDirectory(dir=self.build) as scratch:
            try:
                return subprocess.run(
                    [self.build / "tests" / program, tests, "-#", "--abort"], timeout=limit_s, cwd=scratch,
                    env=os.environ | {"TMPDIR": scratch}, stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL, preexec_fn=limit_memory).returncode == 0
            except subprocess.TimeoutExpired:
                return False

    def outcome(self, mutant, programs, seconds):
        """'noticed', 'survived', or 'does not compile'."""
        file, number, _, changed = mutant
        path = self.tree / file
        original = path.read_text()
        lines = original.splitlines()
        lines[number] = changed
        path.write_text("\n".join(lines) + "\n")
        try:
            if not self.compiles(programs):
                return "does not compile"
            if all(self.passes(program, tests, 5 * seconds[program] + 10)
                   for program, tests in programs.items()):
                return "survived"
            return "noticed"
        finally:
            path.write_text(original)


def table(report):
    rows = ["| room | mutants | noticed | share |", "|---|---|---|---|"]
    for room in ROOMS:
        tried = [outcome for outcome in report.get(room, {}).values() if outcome != "does not compile"]
        if tried:
            noticed = tried.count("noticed")
            rows.append(f"| `{room}` | {len(tried)} | {noticed} | {100 * noticed / len(tried):.0f} % |")
    return "\n".join(rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--mutants", type=int, default=25)
    parser.add_argument("--rooms", default=",".join(ROOMS))
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--write", type=pathlib.Path)
    options = parser.parse_args()
    rooms = options.rooms.split(",")
    for room in rooms:
        if room not in ROOMS:
            sys.exit(f"mutate: no room {room}; rooms are {', '.join(ROOMS)}")

    copy = Copy(options.folder.resolve())
    copy.renew([program for room in rooms for program in ROOMS[room]])
    report_path = options.folder / "report.json"
    report = json.loads(report_path.read_text()) if report_path.exists() else {}
    for room in rooms:
        seconds = {}
        for program, tests in ROOMS[room].items():
            begin = time.monotonic()
            if not copy.passes(program, tests, 3600):
                sys.exit(f"mutate: {program} fails without a mutant")
            seconds[program] = time.monotonic() - begin
            print(f"{room}: {program} takes {seconds[program]:.0f} s", flush=True)
        outcomes = report.setdefault(room, {})
        left = options.mutants
        for mutant in mutants(copy.tree, room):
            file, number, line, changed = mutant
            change = f"{line.strip()} -> {changed.strip()}"
            key = f"{file}: {change}"  # without its number, so a line that moves stays the same mutant
            if left == 0:
                break
            if (outcomes.get(key) != "survived") if options.again else (key in outcomes):
                continue
            outcomes[key] = copy.outcome(mutant, ROOMS[room], seconds)
            report_path.write_text(json.dumps(report, indent=1) + "\n")
            if outcomes[key] != "does not compile":
                left -= 1
                print(f"{outcomes[key]}: {file}:{number + 1}: {change}", flush=True)
    print(table(report))
    if options.write:
        page = options.write.read_text()
        begin, end = "<!-- mutants -->\n", "<!-- end of mutants -->"
        before, rest = page.split(begin)
        options.write.write_text(before + begin + table(report) + "\n" + end + rest.split(end)[1])


if __name__ == "__main__":
    main()
