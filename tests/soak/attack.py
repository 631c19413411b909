"""What every attack has: the program, and a row of trials."""

import contextlib
import hashlib
import os
import pathlib
import resource
import subprocess

PROJECT = pathlib.Path(__file__).resolve().parents[2]
EXIT_CODES = {0, 1, 2, 3, 75}  # of the program; a signal ends it with another
NOT_BEGUN = 127  # of the loader


class Failed(Exception):
    """A trial that failed, with what is wrong."""


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
        if code == NOT_BEGUN and "error while loading shared libraries" in err:
            return code, out
        if code not in codes:
            raise Failed(f"{' '.join(map(str, args[0]))}: exit code {code}; {err.strip()[-400:]}")
        if code not in (0, 75) and not err.strip():
            raise Failed(f"{' '.join(map(str, args[0]))}: exit code {code} without a message")
        return code, out


class Row:
    """One way to break the program."""

    title = ""
    unit = "trials"

    def __init__(self, program, jobs, folder):
        self.program, self.jobs, self.folder = program, jobs, folder

    def trial(self, draw):
        """Raises Failed, or returns how many of its unit were tried."""
        raise NotImplementedError
