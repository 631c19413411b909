"""The comparison of two builds finds what is planted: a bit of a layer, a file, a failure."""

import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy

PROGRAM = os.environ["ENSONIFY_PROGRAM"]
COMPARE = pathlib.Path(__file__).with_name("same_bytes.py")
SCENE = """version = 1
[seafloor]
extent_east_m = 40
extent_north_m = 20
cell_m = 0.5
[track]
pings = 4
[sonar.left-right]
range_m = 15
bins = 100
elevations = 128
"""
# Runs the program and then changes its files: FOLDER is what follows -o.
CHANGED = """#!{python}
import pathlib, subprocess, sys
import numpy
code = subprocess.run([{program!r}, *sys.argv[1:]]).returncode
folder = pathlib.Path(sys.argv[sys.argv.index("-o") + 1])
{change}
sys.exit(code)
"""
ONE_BIT = """
layers = dict(numpy.load(folder / "left-right.npz"))
layers["range_m"].view(numpy.uint32)[2, 50] ^= 1
numpy.savez(folder / "left-right.npz", **layers)
"""


class Planted(unittest.TestCase):
    def compare(self, change, scene=SCENE):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            (folder / "small.toml").write_text(scene)
            new = folder / "new"
            new.write_text(CHANGED.format(python=sys.executable, program=PROGRAM, change=change))
            new.chmod(0o755)
            done = subprocess.run([sys.executable, COMPARE, PROGRAM, new, folder / "made", folder / "small.toml"],
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
            return done.returncode, done.stdout

    def test_nothing_is_found_where_nothing_changed(self):
        code, text = self.compare("")
        self.assertEqual(code, 0, text)
        self.assertRegex(text, r"small +\d+ files +same")

    def test_one_bit_of_one_layer(self):
        code, text = self.compare(ONE_BIT)
        self.assertEqual(code, 1, text)
        self.assertIn("left-right.npz: range_m (1 of 800 values)\n", text)

    def test_one_byte_of_a_recording(self):
        code, text = self.compare("""
data = bytearray((folder / "left-right.xtf").read_bytes())
data[-1] ^= 1
(folder / "left-right.xtf").write_bytes(data)
""")
        self.assertEqual(code, 1, text)
        self.assertIn("left-right.xtf\n", text)

    def test_the_scene_s_hash_in_the_manifest_but_not_the_version(self):
        change = """
text = (folder / "manifest.json").read_text()
(folder / "manifest.json").write_text(text.replace({0!r}, {1!r}))
"""
        code, text = self.compare(change.format('"scene_hash": "', '"scene_hash": "0'))
        self.assertEqual(code, 1, text)
        self.assertIn("manifest.json\n", text)
        code, text = self.compare(change.format('"version": "', '"version": "9'))
        self.assertEqual(code, 0, text)

    def test_a_file_that_only_one_has(self):
        code, text = self.compare('(folder / "left-right.png").unlink()')
        self.assertEqual(code, 1, text)
        self.assertIn("left-right.png (only old has it)", text)

    def test_a_program_that_fails(self):
        code, text = self.compare("sys.exit(3)")
        self.assertEqual(code, 1, text)
        self.assertIn("new: exit code 3", text)


if __name__ == "__main__":
    unittest.main()
