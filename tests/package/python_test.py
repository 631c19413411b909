"""The Python package: images, sessions, exceptions, threads, Ctrl-C, and the README's first program."""

import gc
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import numpy

import ensonify

readme = pathlib.Path(__file__).parents[2] / "README.md"
scene = {
    "seafloor": {"extent_east_m": 40, "extent_north_m": 20, "cell_m": 0.5, "material": "plain"},
    "material": {"plain": {"model": "lambert"}},
    "track": {"pings": 9},
    "sonar": {"left-right": {"range_m": 15, "bins": 100, "elevations": 128}},
}


def toml_of(path):
    path.write_text("""version = 1
[seafloor]
extent_east_m = 40
extent_north_m = 20
cell_m = 0.5
material = "plain"
[material.plain]
model = "lambert"
[track]
pings = 9
[sonar.left-right]
range_m = 15
bins = 100
elevations = 128
""")
    return path


def cube(half_m):
    corners = [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    faces = [f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))]
    return half_m * numpy.array(corners, float), numpy.array(faces)


class Images(unittest.TestCase):
    def test_a_file_and_a_dict_give_the_same_image_as_the_program(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            path = toml_of(folder / "scene.toml")
            image = ensonify.simulate(path)
            self.assertEqual(image.shape, (9, 200))
            self.assertEqual(image.dtype, numpy.float32)
            numpy.testing.assert_array_equal(image, ensonify.simulate(str(path)))
            numpy.testing.assert_array_equal(image, ensonify.simulate(scene))
            subprocess.run([os.environ["ENSONIFY_PROGRAM"], "run", path, "-o", folder / "out", "--quiet",
                            "-D", "output.npz=true"], check=True)
            written = numpy.load(folder / "out" / "left-right.npz")
            layers = ensonify.simulate(scene, layer="all")
            self.assertEqual(sorted(layers), sorted(ensonify.layers))
            for name, values in layers.items():
                numpy.testing.assert_array_equal(values, written[name], name)

    def test_the_layers_of_an_image_share_its_memory_and_outlive_it(self):
        layers = ensonify.simulate(scene, layer=["range_m", "region"])
        owner = layers["range_m"].base
        self.assertIs(owner, layers["region"].base)
        self.assertIsInstance(owner, ensonify.Image)
        region = layers["region"].copy()
        kept = layers["region"]
        del layers, owner
        gc.collect()
        numpy.testing.assert_array_equal(kept, region)

    def test_keys_change_a_scene(self):
        image = ensonify.simulate(scene, keys={"track.pings": 3, "sonar.left-right.sides": "port"})
        self.assertEqual(image.shape, (3, 100))

    def test_progress_is_told(self):
        told = []
        ensonify.simulate(scene, progress=lambda *what: told.append(what))
        self.assertEqual(told[-1], ("pings", 9, 9))

    def test_what_is_wrong_is_said(self):
        with self.assertRaisesRegex(ensonify.SceneError, "pingz.*did you mean 'pings'"):
            ensonify.simulate({**scene, "track": {"pingz": 1}})
        with self.assertRaisesRegex(ensonify.SceneError, "No such file"):
            ensonify.simulate("/nowhere/scene.toml")
        with self.assertRaisesRegex(TypeError, "a scene holds no complex"):
            ensonify.simulate({**scene, "seed": 1j})
        with self.assertRaisesRegex(KeyError, "no sonar 'x'"):
            ensonify.simulate(scene, sonar="x")
        with self.assertRaisesRegex(KeyError, "no layer 'x'"):
            ensonify.simulate(scene, layer="x")
        with self.assertRaisesRegex(ZeroDivisionError, "mine"):
            ensonify.simulate(scene, progress=self.fail_with(ZeroDivisionError("mine")))

    @staticmethod
    def fail_with(error):
        def fail(*_):
            raise error
        return fail

    def test_control_c_interrupts(self):
        program = ("import ensonify, sys\n"
                   "print('begun', flush=True)\n"
                   "try:\n"
                   f"    ensonify.simulate({scene!r}, keys={{'track.pings': 200000, 'track.speed_mps': 0.0}})\n"
                   "except KeyboardInterrupt:\n"
                   "    sys.exit(7)\n")
        process = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE)
        process.stdout.readline()
        time.sleep(1.0)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(timeout=60), 7)
        process.stdout.close()


class Sessions(unittest.TestCase):
    pose = ensonify.Pose(0, 0, -12, t_s=0.5)

    def test_lines_hold_every_layer_and_outlive_the_simulator(self):
        simulator = ensonify.Simulator(scene)
        lines = simulator.ping(self.pose)
        self.assertEqual([line.side for line in lines], ["port", "starboard"])
        kept = {name: lines[0][name] for name in ensonify.layers}
        before = {name: values.copy() for name, values in kept.items()}
        self.assertIs(kept["intensity"].base, lines[0])
        for _ in range(3):
            simulator.ping(self.pose)
        del simulator, lines
        gc.collect()
        for name, values in kept.items():
            self.assertEqual(values.shape, (100,))
            numpy.testing.assert_array_equal(values, before[name])

    def test_a_number_gives_the_same_ping_again(self):
        simulator = ensonify.Simulator(scene)
        first = simulator.ping(self.pose)[0]["intensity"]
        self.assertFalse(numpy.array_equal(first, simulator.ping(self.pose)[0]["intensity"]))
        numpy.testing.assert_array_equal(first, simulator.ping(self.pose, 0)[0]["intensity"])

    def test_objects_come_move_and_go(self):
        simulator = ensonify.Simulator(scene)
        empty = simulator.ping(self.pose, 0)[1]["intensity_mean"]
        cylinder = simulator.add({"shape": "cylinder", "material": "wood"}, ensonify.Pose(5, 0, -17))
        box = simulator.add_mesh(*cube(0.5), ensonify.Pose(-5, 0, -17), class_name="box")
        self.assertEqual((cylinder, box), (1, 2))
        self.assertIn("box", simulator.classes)
        self.assertIn("wood", simulator.materials)
        port, starboard = simulator.ping(self.pose, 0)
        self.assertIn(box, port["instance"])
        self.assertIn(cylinder, starboard["instance"])
        simulator.move(box, ensonify.Pose(5, 0, -14))
        self.assertIn(box, simulator.ping(self.pose, 0)[1]["instance"])
        simulator.remove(box)
        simulator.remove(cylinder)
        numpy.testing.assert_array_equal(empty, simulator.ping(self.pose, 0)[1]["intensity_mean"])

    def test_a_sonar_is_set(self):
        simulator = ensonify.Simulator(scene)
        simulator.set({"sonar.left-right.range_m": 10, "sonar.left-right.bins": 50})
        self.assertEqual(simulator.ping(self.pose)[0]["range_m"].shape, (50,))
        with self.assertRaisesRegex(ValueError, "track.pings"):
            simulator.set({"track.pings": 3})
        with self.assertRaises(ensonify.SceneError):
            simulator.set({"sonar.left-right.range_m": -1})

    def test_bad_calls_raise(self):
        simulator = ensonify.Simulator(scene)
        with self.assertRaisesRegex(ValueError, "finite"):
            simulator.ping(ensonify.Pose(float("nan"), 0, 0))
        with self.assertRaisesRegex(ValueError, "instance 5"):
            simulator.remove(5)
        with self.assertRaisesRegex(ValueError, "three columns"):
            simulator.add_mesh([1, 2], [3], self.pose)
        with self.assertRaises(ensonify.MeshError):
            simulator.add_mesh(cube(1)[0], [[0, 1, 99]], self.pose)
        with self.assertRaisesRegex(ensonify.SceneError, "shape"):
            simulator.add({"shape": "teapot"}, self.pose)
        with self.assertRaises(TypeError):
            simulator.ping(1)

    def test_threads_hear_the_same_as_one(self):
        def session():
            simulator = ensonify.Simulator(scene)
            return numpy.array([simulator.ping(self.pose)[0]["intensity"] for _ in range(5)])

        expected = session()
        heard = []
        threads = [threading.Thread(target=lambda: heard.append(session())) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(heard), 8)
        for mine in heard:
            numpy.testing.assert_array_equal(mine, expected)

    def test_one_simulator_may_be_shared(self):
        simulator = ensonify.Simulator(scene)
        expected = simulator.ping(self.pose, 4)[0]["intensity"]
        heard = []
        threads = [threading.Thread(target=lambda: heard.append(simulator.ping(self.pose, 4)[0]["intensity"]))
                   for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for mine in heard:
            numpy.testing.assert_array_equal(mine, expected)


class Readme(unittest.TestCase):
    def test_the_first_program_is_short_and_runs(self):
        blocks = [block for block in re.findall(r"```python\n(.*?)```", readme.read_text(), re.S)
                  if "import ensonify" in block]
        self.assertTrue(blocks)
        program = blocks[0]
        self.assertLessEqual(len([line for line in program.splitlines() if line.strip()]), 5)
        result = subprocess.run([sys.executable, "-c", program], cwd=readme.parent, capture_output=True, text=True)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("(600, 2000)", result.stdout)


if __name__ == "__main__":
    unittest.main()
