"""The program on terminals of several widths, into pipes without a reader, and at a limit of its shell."""

import contextlib
import fcntl
import os
import pathlib
import pty
import re
import resource
import signal
import struct
import subprocess
import tempfile
import termios
import threading
import time
import unittest

END = b"\0end\0"

program = os.environ["ENSONIFY_PROGRAM"]
scene = """version = 1
[seafloor]
extent_east_m = 40
extent_north_m = 20
cell_m = 0.5
material = "plain"
[material.plain]
model = "lambert"
[track]
pings = 2000
speed_mps = 0.1
[sonar.left-right]
range_m = 15
bins = 100
elevations = 128
[run]
block_pings = 20
"""


def shown(arguments, columns, stream, folder):
    """The exit code, and what a terminal with `columns` columns gets on one of the program's streams."""
    ours, its = pty.openpty()
    fcntl.ioctl(its, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    process = subprocess.Popen([program, *arguments], cwd=folder, env={**os.environ, "TERM": "xterm"},
                               **{"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, stream: its})
    def end():
        process.wait()
        os.write(its, END)
    waiter = threading.Thread(target=end)
    waiter.start()
    # A mark ends the text, not the end of the terminal: Linux can report that one too early.
    text = b""
    while not text.endswith(END):
        text += os.read(ours, 65536)
    waiter.join()
    os.close(its)
    os.close(ours)
    return process.returncode, text.removesuffix(END).decode()


class IntoAFullPipe(unittest.TestCase):
    def test_a_run_whose_messages_are_not_read_goes_on_and_is_stopped_by_sigterm(self):
        read, write = os.pipe()
        os.set_blocking(write, False)
        with contextlib.suppress(BlockingIOError):
            while True:
                os.write(write, bytes(4096))
        os.set_blocking(write, True)
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "scene.toml").write_text(scene)
            arguments = ["run", "scene.toml", "-o", "out", "-D", "sonar.left-right.elevations=32768",
                         "-D", "track.pings=20000", "-D", "track.speed_mps=0.001", "-D", "run.intersector=embree",
                         "--threads", "1"]
            process = subprocess.Popen([program, *arguments], cwd=folder, stderr=write)
            time.sleep(12)  # lines of progress are 10 s apart
            process.send_signal(signal.SIGTERM)
            try:
                self.assertEqual(process.wait(10), 128 + signal.SIGTERM)
            finally:
                process.kill()
                process.wait()
            self.assertFalse((pathlib.Path(folder) / "out").exists())
        os.close(read)
        os.close(write)


class IntoAClosedPipe(unittest.TestCase):
    def outcome(self, stream, *arguments, **more):
        """The exit code, and what the program's other stream gets, if this one has no reader."""
        read, write = os.pipe()
        os.close(read)
        other = {"stdout": "stderr", "stderr": "stdout"}[stream]
        done = subprocess.run([program, *arguments], timeout=60, **{stream: write, other: subprocess.PIPE}, **more)
        os.close(write)
        return done.returncode, getattr(done, other)

    def test_a_run_whose_messages_have_no_reader_makes_its_files(self):
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "scene.toml").write_text(scene)
            self.assertEqual(self.outcome("stderr", "run", "scene.toml", "-o", "out", cwd=folder), (0, b""))
            self.assertEqual({file.name for file in (pathlib.Path(folder) / "out").iterdir()},
                             {"left-right.exr", "left-right.png", "left-right_pings.csv", "manifest.json"})

    def test_a_command_whose_output_has_no_reader_ends_at_once_without_a_message(self):
        ended = (128 + signal.SIGPIPE, b"")
        for arguments in (["schema"], ["--help"], ["run", "--help"], ["--version"]):
            self.assertEqual(self.outcome("stdout", *arguments), ended)
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "scene.toml").write_text(scene)
            waits, keeps_it_open = os.pipe()  # the input does not end
            self.assertEqual(self.outcome("stdout", "stream", "scene.toml", "--quiet", cwd=folder, stdin=waits), ended)
            os.close(waits)
            os.close(keeps_it_open)
            self.assertEqual(self.outcome("stdout", "run", "scene.toml", "-o", "out", "--json", "--quiet", cwd=folder),
                             ended)
            self.assertTrue((pathlib.Path(folder) / "out/manifest.json").exists())


class AtTheLimitOfProcessorTime(unittest.TestCase):
    def test_a_run_stops_and_leaves_nothing(self):
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "scene.toml").write_text(scene)
            done = subprocess.run([program, "run", "scene.toml", "-o", "out", "-D", "track.pings=20000",
                                   "-D", "track.speed_mps=0.001", "-D", "sonar.left-right.elevations=32768"],
                                  cwd=folder, timeout=60, stderr=subprocess.PIPE, text=True,
                                  preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (2, 60)))
            self.assertEqual(done.returncode, 128 + signal.SIGXCPU)
            self.assertIn("stopped on request", done.stderr)
            self.assertFalse((pathlib.Path(folder) / "out").exists())


class OnATerminal(unittest.TestCase):
    def test_progress_stays_on_one_line(self):
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "scene.toml").write_text(scene)
            for columns in (10, 20, 40, 64, 80, 200):
                code, text = shown(["run", "scene.toml", "-o", f"out{columns}"], columns, "stderr", folder)
                self.assertEqual(code, 0)
                bars = [bar for bar in re.split(r"\r\x1b\[K", text.split("\r\n")[0]) if bar]
                self.assertGreater(len(bars), 2)
                for bar in bars[:-1]:
                    self.assertLess(len(bar), columns, bar)
                whole = [bar for bar in bars[:-1] if "pings " in bar]
                if columns >= 40:
                    self.assertTrue(any("/2000" in bar for bar in whole), bars)
                if columns >= 80:
                    self.assertTrue(all(bar.startswith("[") for bar in whole), bars)

    def test_control_characters_of_data_do_nothing_to_it_and_stay_in_files(self):
        with tempfile.TemporaryDirectory() as folder:
            pathlib.Path(folder, "recipe.toml").write_text(
                scene + '[dataset]\nsamples = 1\n[[objects]]\nshape = "box"\nclass = "größe\\u009b31m"\n')
            dry_run = ["generate", "recipe.toml", "--dry-run", "-o", "dataset"]
            code, text = shown(dry_run, 80, "stdout", folder)
            self.assertEqual(code, 0)
            self.assertIn('"größe\\xC2\\x9B31m"', text)
            data = subprocess.run([program, *dry_run], cwd=folder, capture_output=True, check=True).stdout
            self.assertIn('"größe\u009b31m"', data.decode())

    def test_help_stays_within_the_terminal_and_within_80_columns_elsewhere(self):
        def run(*arguments):
            return subprocess.run([program, *arguments], check=True, capture_output=True, text=True).stdout
        listed = run("--help")
        commands = re.findall(r"^  (\S+)", listed[listed.index("Subcommands:"):], re.M)
        self.assertIn("run", commands)
        self.assertIn("backscatter", commands)
        for command in [[], *([name] for name in commands)]:
            help_text = run(*command, "--help")
            for line in help_text.splitlines():
                self.assertLessEqual(len(line), 80, line)
            for columns in (60, 132):
                code, text = shown([*command, "--help"], columns, "stdout", None)
                self.assertEqual(code, 0)
                lines = text.replace("\r\n", "\n").splitlines()
                for line in lines:
                    self.assertLessEqual(len(line), columns, line)
                self.assertEqual("".join(text.split()), "".join(help_text.split()))  # nothing is lost


if __name__ == "__main__":
    unittest.main()
