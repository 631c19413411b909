"""The Python package: images, sessions, exceptions, threads, Ctrl-C, and the README's first program."""

import copy
import gc
import importlib.util
import inspect
import json
import math
import os
import pathlib
import pickle
import pydoc
import re
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import warnings

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


def two_sonars():
    return {**scene, "sonar": {"zeta": scene["sonar"]["left-right"], "alpha": {"range_m": 10, "bins": 50, "elevations": 128}}}


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

    def test_progress_is_reported(self):
        progress = []
        ensonify.simulate(scene, progress=lambda *what: progress.append(what))
        self.assertEqual(progress[-1], ("pings", 9, 9))

    def test_faults_are_reported(self):
        with self.assertRaisesRegex(ensonify.SceneError, "pingz.*did you mean 'pings'"):
            ensonify.simulate({**scene, "track": {"pingz": 1}})
        with self.assertRaisesRegex(ensonify.SceneError, "there is no such file"):
            ensonify.simulate("/nowhere/scene.toml")
        with self.assertRaisesRegex(ensonify.SceneError,
                                    r"/nowhere/größe\\xFF\\x1B.toml.*there is no such file"):
            ensonify.simulate("/nowhere/größe\udcff\x1b.toml")  # no UTF-8, and a control character
        with self.assertRaisesRegex(ValueError, "has a character that no path can have"):
            ensonify.simulate("a\0b")
        with self.assertRaisesRegex(TypeError, "'seed': a scene holds no complex"):
            ensonify.simulate({**scene, "seed": 1j})
        with self.assertRaisesRegex(TypeError, "'track.pings': a scene holds no NoneType.*leave the key out"):
            ensonify.simulate({**scene, "track": {"pings": None}})
        with self.assertRaisesRegex(TypeError, "'objects.0.east_m': a scene holds no object"):
            ensonify.simulate({**scene, "objects": [{"east_m": object()}]})
        with self.assertRaisesRegex(TypeError, "'sea.ph': a scene holds no complex"):
            ensonify.simulate(scene, keys={"sea.ph": numpy.complex64(1)})
        with self.assertRaisesRegex(ValueError, "'seed' is 36893488147419103232, beyond"):
            ensonify.simulate({**scene, "seed": 2**65})
        with self.assertRaisesRegex(ensonify.SceneError, "'track.pings' is 7.0, expected a whole number"):
            ensonify.simulate({**scene, "track": {"pings": numpy.float64(7)}})
        with self.assertRaisesRegex(ensonify.SceneError, "'track.speed_mps' is an array, expected a number"):
            ensonify.simulate({**scene, "track": {"speed_mps": numpy.ones(3)}})
        with self.assertRaisesRegex(TypeError, "the scene is a int, expected"):
            ensonify.simulate(7)
        with self.assertRaisesRegex(TypeError, "keys is a list, expected a dict"):
            ensonify.simulate(scene, keys=[])
        with self.assertRaisesRegex(KeyError, "no sonar 'x'"):
            ensonify.simulate(scene, sonar="x", progress=self.fail_with(AssertionError("it was computed")))
        with self.assertRaisesRegex(KeyError, "no layer 'x'"):
            ensonify.simulate(scene, layer="x")
        with self.assertRaisesRegex(ZeroDivisionError, "mine"):
            ensonify.simulate(scene, progress=self.fail_with(ZeroDivisionError("mine")))

    def test_values_without_an_end_and_half_characters_are_refused(self):
        class Itself:
            def tolist(self):
                return self

        in_itself = {}
        in_itself["again"] = in_itself
        deep = []
        for _ in range(100_000):
            deep = [deep]
        for endless in (in_itself, deep, Itself()):
            for given, keys in (({**scene, "seed": endless}, None), (scene, {"seed": endless})):
                with self.assertRaisesRegex(ValueError, "'seed' has values more than 64 deep"):
                    ensonify.simulate(given, keys=keys)
        with self.assertRaisesRegex(ValueError, "'again' has values more than 64 deep"):
            ensonify.simulate(in_itself)
        half = "a\ud800"
        for given in ({**scene, half: 1}, {**scene, "track": {half: 1}},
                      {**scene, "seafloor": {"material": half}}):
            with self.assertRaisesRegex(ValueError, r"'a\\ud800' is not valid Unicode"):
                ensonify.simulate(given)

    def test_a_wrong_number_of_threads_is_refused_before_any_work(self):
        for threads in (-1, -1000, 1025):
            for made in (ensonify.simulate, ensonify.images, ensonify.Simulator):
                with self.assertRaisesRegex(ValueError, f"threads is {threads}, expected 1 to 1024, or 0"):
                    made(scene, threads=threads)
        numpy.testing.assert_array_equal(ensonify.simulate(scene, threads=2), ensonify.simulate(scene, threads=0))

    def test_with_several_sonars_images_are_found_by_name(self):
        both = ensonify.simulate(two_sonars())
        self.assertEqual(list(both), ["zeta", "alpha"])
        self.assertEqual([image.shape for image in both.values()], [(9, 200), (9, 100)])
        for name, image in both.items():
            numpy.testing.assert_array_equal(ensonify.simulate(two_sonars(), sonar=name), image)
        layers = ensonify.simulate(two_sonars(), layer=["range_m", "region"])
        self.assertEqual({name: sorted(each) for name, each in layers.items()},
                         {"zeta": ["range_m", "region"], "alpha": ["range_m", "region"]})
        self.assertEqual(sorted(ensonify.simulate(scene, layer="all")), sorted(ensonify.layers))

    def test_an_image_has_the_data_of_a_run_s_files(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            path = toml_of(folder / "scene.toml")
            with path.open("a") as text:
                text.write('[[objects]]\nshape = "barrel"\neast_m = 6.0\n'
                           '[output]\nclass_names = ["ship", "object"]\nsediment_names = ["fouled steel"]\n')
            images = ensonify.images(path, keys={"output.npz": True})
            self.assertEqual(list(images), ["left-right"])
            image = images["left-right"]
            subprocess.run([os.environ["ENSONIFY_PROGRAM"], "run", path, "-o", folder / "out", "--quiet",
                            "-D", "output.npz=true"], check=True)
            written = numpy.load(folder / "out" / "left-right.npz")
            for layer in ("intensity", "class", "sediment"):
                numpy.testing.assert_array_equal(image[layer], written[layer], layer)
            targets = json.loads((folder / "out" / "left-right_targets.json").read_text())["targets"]
            self.assertEqual(len(targets), 1)
            self.assertEqual(image.targets, targets)
            rows = (folder / "out" / "left-right_pings.csv").read_text().splitlines()
            columns = rows[0].split(",")
            pings = [dict(zip(columns, map(float, row.split(",")[:len(columns) - 1]))) for row in rows[1:]]
            self.assertEqual(len(image.poses), len(pings))
            for prefix, poses in (("", image.poses), ("reported_", image.reported_poses)):
                for ping, pose in zip(pings, poses):
                    for name in ("x_m", "y_m", "z_m", "roll_deg", "pitch_deg", "heading_deg"):
                        self.assertAlmostEqual(getattr(pose, name), ping[prefix + name], places=5)
            numpy.testing.assert_allclose(image.altitude_m, [ping["altitude_m"] for ping in pings], atol=1e-5)
            manifest = json.loads((folder / "out" / "manifest.json").read_text())
            self.assertEqual((image.classes, image.materials), (manifest["classes"], manifest["materials"]))
            self.assertEqual(image.classes[1:3], ["ship", "object"])
            self.assertEqual(image.attributes["class_names"], image.classes)
            self.assertEqual(image.attributes["sediment_names"], image.materials)
            self.assertEqual(image.attributes["scene_hash"], manifest["scene_hash"])
            self.assertEqual(image.attributes["range_m"], 15.0)
            self.assertEqual(image.attributes["units_range_m"], "m")

    def test_what_cannot_be_pickled_says_what_to_use(self):
        simulator = ensonify.Simulator(scene)
        for item in (simulator, simulator.ping(ensonify.Pose(0, 0, -12))[0], ensonify.images(scene)["left-right"]):
            for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
                with self.assertRaisesRegex(TypeError, "^(Simulator|EchoLine|Image) cannot be pickled or copied; "):
                    pickle.dumps(item, protocol)

    def test_numbers_and_arrays_of_numpy_are_numbers_and_lists(self):
        square = [[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]]
        def with_patch(polygon, number, whole, truth):
            return {**scene, "seed": whole(3), "speckle": truth(True),
                    "sea": {"temperature_c": number(12.5)},
                    "seafloor": {**scene["seafloor"], "patches": [{"material": "clay", "polygon_m": polygon}]}}
        plain = ensonify.simulate(with_patch(square, float, int, bool))
        for array, number, whole, truth in ((numpy.array, numpy.float64, numpy.int64, numpy.bool_),
                                            (lambda a: numpy.array(a, numpy.float32), numpy.float32, numpy.uint8, bool),
                                            (lambda a: [numpy.array(p) for p in a], numpy.array, numpy.array, numpy.array),
                                            (lambda a: tuple(map(tuple, a)), float, int, bool)):
            numpy.testing.assert_array_equal(ensonify.simulate(with_patch(array(square), number, whole, truth)), plain)
        numpy.testing.assert_array_equal(
            ensonify.simulate(with_patch(square, float, int, bool), keys={"track.pings": numpy.int32(9)}), plain)

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


class Poses(unittest.TestCase):
    pose = ensonify.Pose(1, 2.5, -12, t_s=0.1, roll_deg=-3, pitch_deg=4, heading_deg=10,
                         velocity_mps=(0, 2, 0.1), rates_degps=(1, 2, 3))

    def test_attitude_is_in_degrees_and_can_be_set(self):
        pose = copy.copy(self.pose)
        self.assertEqual((pose.x_m, pose.y_m, pose.z_m), pose.position_m)
        self.assertAlmostEqual(pose.roll_deg, -3)
        self.assertAlmostEqual(pose.pitch_deg, 4)
        self.assertAlmostEqual(pose.heading_deg, 10)
        self.assertEqual(pose.velocity_mps, (0.0, 2.0, 0.1))
        numpy.testing.assert_allclose(pose.rates_degps, (1, 2, 3))
        # Heading 90 is east: then the starboard side looks south.
        pose = ensonify.Pose(0, 0, -12)
        pose.heading_deg = 90
        line = ensonify.Simulator(scene).ping(pose)[1]
        self.assertLess(line["y_m"][line["region"] == 2].max(), 0)
        for name, value in (("x_m", 7.0), ("y_m", 8.0), ("z_m", -9.0), ("t_s", 0.5), ("roll_deg", 1.0),
                            ("pitch_deg", 2.0), ("velocity_mps", (1.0, 2.0, 3.0)), ("rates_degps", (3.0, 2.0, 1.0))):
            setattr(pose, name, value)
            numpy.testing.assert_allclose(getattr(pose, name), value)

    def test_the_repr_of_a_pose_evaluates_to_it(self):
        self.assertEqual(repr(self.pose), "Pose(1, 2.5, -12, t_s=0.1, roll_deg=-3, pitch_deg=4, heading_deg=10, "
                                          "velocity_mps=(0, 2, 0.1), rates_degps=(1, 2, 3))")
        self.assertEqual(repr(ensonify.Pose(0, 0, -1)), "Pose(0, 0, -1)")
        utm = ensonify.Pose(500000.123456, 6200000.123456789, -3.0000000012345, t_s=1700000000.123456,
                            roll_deg=1 / 3, pitch_deg=-2 / 7, heading_deg=359.99999999999994,
                            velocity_mps=(1 / 3, 0, 0), rates_degps=(1 / 7, 0, 1e-5))
        for pose in (self.pose, utm):
            self.assertEqual(eval(repr(pose), {"Pose": ensonify.Pose}), pose)

    def test_poses_compare_pickle_and_copy(self):
        for again in (*(pickle.loads(pickle.dumps(self.pose, protocol)) for protocol in range(pickle.HIGHEST_PROTOCOL + 1)),
                      copy.deepcopy(self.pose), copy.copy(self.pose)):
            self.assertIsNot(again, self.pose)
            self.assertEqual(again, self.pose)
        other = copy.copy(self.pose)
        other.heading_deg += 1e-9
        self.assertNotEqual(other, self.pose)
        self.assertNotEqual(self.pose, "a pose")
        track = ensonify.Simulator(scene).track()
        self.assertEqual(pickle.loads(pickle.dumps(track)), track)


class Documentation(unittest.TestCase):
    def test_everything_public_is_documented_with_its_arguments(self):
        self.assertIn("Pose", pydoc.render_doc(ensonify))
        for name in ensonify.__all__:
            item = getattr(ensonify, name)
            if name == "layers":
                continue
            self.assertEqual(item.__module__, "ensonify")
            self.assertGreater(len(inspect.getdoc(item)), 20, name)
            if not inspect.isclass(item) or issubclass(item, Exception):
                continue
            for member, value in vars(item).items():
                if member.startswith("_") and member != "__getitem__":
                    continue
                self.assertTrue(inspect.getdoc(value), f"{name}.{member}")
                self.assertNotIn("_ensonify", inspect.getdoc(value), f"{name}.{member}")
                if not isinstance(value, property):
                    self.assertEqual(list(inspect.signature(value).parameters)[0], "self", f"{name}.{member}")
        self.assertEqual(str(inspect.signature(ensonify.Simulator.ping)), "(self, pose, number=None)")
        for text, item in (("degrees", ensonify.Pose), ("north", ensonify.Pose), ("NED", ensonify.Pose), ("z_m=-12", ensonify.Pose),
                           ("ValueError", ensonify.Simulator.ping), (r"\(pings, samples\)", ensonify.simulate),
                           (r"\(bins,\)", ensonify.EchoLine), ("newest", ensonify.Image.targets)):
            self.assertRegex(inspect.getdoc(item), text)

    def test_the_version_is_the_programs(self):
        printed = subprocess.run([os.environ["ENSONIFY_PROGRAM"], "--version"], check=True, capture_output=True, text=True)
        self.assertEqual(printed.stdout.splitlines()[0], f"ensonify {ensonify.__version__}")
        self.assertRegex(ensonify.__version__, r"^\d+\.\d+\.\d+$")

    program = """
import numpy
import ensonify

image = ensonify.simulate({"track": {"pings": 3}}, keys={"seed": 1})
print(image.mean(), image.shape)
for name, layer in ensonify.simulate("a.toml", layer="all").items():
    print(name, layer.shape)
pose = ensonify.Pose(0, 0, -12, heading_deg=10)
pose.position_m = (1, 2, -3)
simulator = ensonify.Simulator("a.toml")
lines: list[ensonify.EchoLine] = simulator.ping(pose)
instance: int = simulator.add_mesh(numpy.zeros((3, 3)), [[0, 1, 2]], pose)
poses: list[ensonify.Pose] = ensonify.images("a.toml")["sidescan"].poses
degrees: float = poses[0].heading_deg
version: str = ensonify.__version__
"""

    def test_a_jsf_recording_is_read_into_arrays(self):
        # A message of type 80 as EdgeTech's description of the format has it.
        def message(number, channel, samples):
            header = bytearray(240)
            struct.pack_into("<i", header, 0, 1700000000 + number)
            struct.pack_into("<I", header, 8, number)
            struct.pack_into("<H", header, 30, 1 | 1 << 3)  # position and heading are valid
            struct.pack_into("<iih", header, 80, 10 * 600000, -5 * 600000, 2)
            struct.pack_into("<HI", header, 114, len(samples), 40000)  # samples, ns per sample
            struct.pack_into("<HH", header, 126, 44000, 46000)  # 10 Hz
            struct.pack_into("<H", header, 172, 27000)
            body = bytes(header) + struct.pack(f"<{len(samples)}h", *samples)
            return struct.pack("<HBxHBBBBHi", 0x1601, 13, 80, 0, 21, channel, 0, 0, len(body)) + body

        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "line.jsf"
            path.write_bytes(b"".join(message(n, c, [n, c, 100 + n]) for n in (4, 6) for c in (0, 1)))
            (line,) = ensonify.read_recording(path)
            path.write_bytes(b"nothing")
            with self.assertRaisesRegex(ensonify.RecordingError, "is no recording"):
                ensonify.read_recording(path)
        self.assertEqual((line.format, line.frequency_hz, line.bandwidth_hz), ("JSF", 450e3, 20e3))
        numpy.testing.assert_array_equal(line.port, [[4, 0, 104], [6, 0, 106]])
        numpy.testing.assert_array_equal(line.starboard, [[4, 1, 104], [6, 1, 106]])
        self.assertEqual(line.port.dtype, numpy.float32)
        numpy.testing.assert_array_equal(line.number, [4, 6])
        numpy.testing.assert_allclose(line.utc_s, [1700000004, 1700000006])
        numpy.testing.assert_allclose(line.lon_deg, [10, 10])
        numpy.testing.assert_allclose(line.lat_deg, [-5, -5])
        numpy.testing.assert_allclose(line.heading_deg, [270, 270])
        numpy.testing.assert_allclose(line.range_m, 3 * 40e-6 * 1500 / 2)
        self.assertTrue(numpy.isnan(line.altitude_m).all())
        port = line.port
        del line
        gc.collect()
        self.assertEqual(port[1, 2], 106)  # the array keeps its line

    @unittest.skipUnless(importlib.util.find_spec("mypy"), "mypy is not installed")
    def test_the_stub_passes_mypy_strict_and_fits_the_module(self):
        package = pathlib.Path(ensonify.__file__).parent
        with tempfile.TemporaryDirectory() as folder:
            program = pathlib.Path(folder) / "program.py"
            program.write_text(self.program)
            environment = {**os.environ, "MYPYPATH": str(package.parent), "MYPY_CACHE_DIR": folder}
            def checked(*arguments):
                return subprocess.run([sys.executable, "-m", *arguments], cwd=folder, env=environment,
                                      capture_output=True, text=True)
            strict = checked("mypy", "--strict", str(package / "__init__.pyi"), "program.py")
            self.assertEqual(strict.returncode, 0, strict.stdout + strict.stderr)
            program.write_text(self.program + 'wrong: int = pose.heading_deg\nensonify.Pose("east", 0, 0)\n')
            self.assertIn("Found 2 errors", checked("mypy", "--strict", "program.py").stdout)
            # A pybind11 class differs from a Python class in its metaclass and its __init__.
            allowed = pathlib.Path(folder) / "allowed"
            allowed.write_text("ensonify\\.(EchoLine|Image|Pose|RecordedLine|Simulator)\n"
                               "ensonify\\.(EchoLine|Image|RecordedLine)\\.__init__\n")
            module = checked("mypy.stubtest", "ensonify", "--ignore-missing-stub", "--allowlist", str(allowed))
            self.assertEqual(module.returncode, 0, module.stdout + module.stderr)


class Sessions(unittest.TestCase):
    pose = ensonify.Pose(0, 0, -12, t_s=0.5)

    def test_lines_hold_every_layer_and_outlive_the_simulator(self):
        simulator = ensonify.Simulator(scene)
        lines = simulator.ping(self.pose)
        self.assertEqual([line.side for line in lines], ["port", "starboard"])
        self.assertEqual([line.sector for line in lines], [0, 1])
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

    def test_a_warning_that_raises_takes_no_ping_number(self):
        on_bed, off_bed = ensonify.Pose(0, 0, -10), ensonify.Pose(0, 1000, -10)
        session, fresh = ensonify.Simulator(scene), ensonify.Simulator(scene)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            self.assertRaisesRegex(UserWarning, "out of every sonar's range", session.ping, off_bed)
            for mine, expected in zip(session.ping(on_bed), fresh.ping(on_bed)):
                numpy.testing.assert_array_equal(mine["intensity"], expected["intensity"])
            session.ping(off_bed)  # it warns once
        for mine, expected in zip(session.ping(on_bed), fresh.ping(on_bed, 2)):
            numpy.testing.assert_array_equal(mine["intensity"], expected["intensity"])

    def test_objects_are_added_moved_and_removed(self):
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
        # The scene's own material, and a form that follows from the seed and the instance.
        boulders = []
        for seed in (1, 1, 2):
            # Without the echo of the other side of the track, which outweighs the boulder in some bins.
            other = ensonify.Simulator(scene, keys={"seed": seed, "sonar.left-right.sector_high_deg": 90})
            other.add({"shape": "boulder", "material": "plain", "diameter_m": 2}, ensonify.Pose(5, 0, -19))
            line = other.ping(self.pose, 0)[1]
            boulders.append(line["z_m"][line["instance"] == 1].tolist())
            self.assertGreater(len(boulders[-1]), 3)
        self.assertEqual(boulders[0], boulders[1])
        self.assertNotEqual(boulders[0], boulders[2])
        numpy.testing.assert_array_equal(empty, simulator.ping(self.pose, 0)[1]["intensity_mean"])

    def test_the_mesh_of_an_added_object_lies_beside_the_scene(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            vertices, faces = cube(0.5)
            lines = [f"v {x} {y} {z}" for x, y, z in vertices]
            lines += ["f " + " ".join(str(corner + 1) for corner in face) for face in faces]
            (folder / "box.obj").write_text("\n".join(lines) + "\n")
            simulator = ensonify.Simulator(toml_of(folder / "scene.toml"))
            self.assertEqual(simulator.add({"mesh": "box.obj"}, ensonify.Pose(5, 0, -17)), 1)

    def test_control_c_stops_a_ping_and_the_next_one_is_whole(self):
        simulator = ensonify.Simulator(scene, keys={"sonar.left-right.elevations": 40000, "run.intersector": "pluecker"})
        whole = simulator.ping(self.pose, 0)
        begin = time.monotonic()
        simulator.ping(self.pose, 0)
        takes = time.monotonic() - begin

        def interrupt(*_):
            raise KeyboardInterrupt

        before = signal.signal(signal.SIGALRM, interrupt)
        try:
            signal.setitimer(signal.ITIMER_REAL, 0.1 * takes)
            begin = time.monotonic()
            with self.assertRaises(KeyboardInterrupt):
                simulator.ping(self.pose, 0)
            self.assertLess(time.monotonic() - begin, 0.6 * takes)
        finally:
            signal.signal(signal.SIGALRM, before)
        for line, again in zip(whole, simulator.ping(self.pose, 0)):
            numpy.testing.assert_array_equal(line["intensity"], again["intensity"])

    def test_a_signal_s_handler_cannot_call_a_simulator_in_the_midst_of_a_call(self):
        simulator = ensonify.Simulator(scene, keys={"sonar.left-right.elevations": 40000, "run.intersector": "pluecker"})
        before = signal.signal(signal.SIGALRM, lambda *_: simulator.classes)
        try:
            signal.setitimer(signal.ITIMER_REAL, 0.05)
            with self.assertRaisesRegex(RuntimeError, "in the midst of a call"):
                for _ in range(100):
                    simulator.ping(self.pose, 0)
        finally:
            signal.signal(signal.SIGALRM, before)
        self.assertEqual(len(simulator.ping(self.pose)), 2)

    def test_control_c_ends_an_add_that_changes_nothing(self):
        def interrupt(*_):
            raise KeyboardInterrupt

        n = 200
        x, y = (0.01 * a.ravel() for a in numpy.meshgrid(numpy.arange(n), numpy.arange(n)))
        corner = (n * numpy.arange(n - 1)[:, None] + numpy.arange(n - 1)).ravel()
        faces = numpy.concatenate([numpy.stack([corner, corner + 1, corner + n], 1),
                                   numpy.stack([corner + 1, corner + n + 1, corner + n], 1)])
        mesh = numpy.stack([x, y, 0.1 * numpy.sin(3 * x) * numpy.cos(5 * y)], 1), faces
        simulator = ensonify.Simulator(scene)
        begin = time.monotonic()
        simulator.remove(simulator.add_mesh(*mesh, self.pose))
        takes = time.monotonic() - begin
        before = signal.signal(signal.SIGALRM, interrupt)
        try:
            signal.setitimer(signal.ITIMER_REAL, 0.3 * takes)
            with self.assertRaises(KeyboardInterrupt):
                simulator.add_mesh(*mesh, self.pose)
        finally:
            signal.signal(signal.SIGALRM, before)
        self.assertEqual(simulator.add_mesh(*cube(1), self.pose), 1)

    def test_a_sonar_is_set(self):
        simulator = ensonify.Simulator(scene)
        simulator.set({"sonar.left-right.range_m": 10, "sonar.left-right.bins": 50})
        self.assertEqual(simulator.ping(self.pose)[0]["range_m"].shape, (50,))
        with self.assertRaisesRegex(ValueError, "track.pings"):
            simulator.set({"track.pings": 3})
        with self.assertRaises(ensonify.SceneError):
            simulator.set({"sonar.left-right.range_m": -1})

    def test_changes_of_several_threads_all_stay(self):
        simulator = ensonify.Simulator(two_sonars())
        threads = [threading.Thread(target=lambda n=name, b=bins: [simulator.set({f"sonar.{n}.bins": b + i})
                                                                   for i in range(20)])
                   for name, bins in (("zeta", 30), ("alpha", 60))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        simulator.set({"sonar.alpha.range_m": 9})  # sets the sonar by all that was changed
        self.assertEqual([len(line["range_m"]) for line in simulator.ping(self.pose)], [49, 49, 79, 79])

    def test_bad_calls_raise(self):
        simulator = ensonify.Simulator(scene)
        with self.assertRaisesRegex(ValueError, "finite"):
            simulator.ping(ensonify.Pose(float("nan"), 0, 0))
        for rate in (math.inf, math.nan):
            with self.assertRaisesRegex(ValueError, "finite"):
                simulator.ping(ensonify.Pose(0, 0, -6, rates_degps=(0, 0, rate)))
        with self.assertRaisesRegex(ValueError, "sonar left-right 3.0 m above the sea surface.*depth is negative"):
            simulator.ping(ensonify.Pose(0, 0, 3))
        with self.assertRaisesRegex(ValueError, "m below the bed"):
            simulator.ping(ensonify.Pose(0, 0, -60))
        with self.assertRaisesRegex(ValueError, "instance 5"):
            simulator.remove(5)
        with self.assertRaisesRegex(ValueError, "three columns"):
            simulator.add_mesh([1, 2], [3], self.pose)
        vertices, faces = cube(1)
        for wrong in (99, -1, 2**32, 2**32 + 2, -2**32, 2**63 - 1):
            with self.assertRaisesRegex(ensonify.MeshError, f"face 1 has vertex {wrong}, but the mesh has 8"):
                simulator.add_mesh(vertices, [[0, 1, 2], [0, 1, wrong]], self.pose)
        with self.assertRaises(ensonify.MeshError):
            simulator.add_mesh(vertices, numpy.array([[0, 1, 2**64 - 1]], numpy.uint64), self.pose)
        for wrong in (faces + 0.7, faces.astype(float), faces > 0, faces.astype(str), faces.astype(object),
                      [[0, 1], [2]]):
            with self.assertRaisesRegex(TypeError, "faces are .*, expected an array of whole numbers"):
                simulator.add_mesh(vertices, wrong, self.pose)
        for wrong in (vertices * 1j, vertices > 0, vertices.astype(str)):
            with self.assertRaisesRegex(TypeError, "vertices are of .*, expected an array of real numbers"):
                simulator.add_mesh(wrong, faces, self.pose)
        for none in ([], numpy.zeros((0, 3))):
            with self.assertRaisesRegex(ValueError, "no faces"):
                simulator.add_mesh(vertices, none, self.pose)
        instances = [simulator.add_mesh(v, f, self.pose)
                     for v, f in ((vertices, faces.astype(numpy.uint8)), (vertices.tolist(), faces.tolist()),
                                  (vertices.astype(numpy.int16), faces[::-1]))]
        self.assertEqual(instances, [1, 2, 3])
        with self.assertRaisesRegex(ensonify.SceneError, "shape"):
            simulator.add({"shape": "teapot"}, self.pose)
        with self.assertRaises(TypeError):
            simulator.ping(1)

    def test_all_exceptions_of_the_module_have_one_base(self):
        for one, builtin in ((ensonify.SceneError, ValueError), (ensonify.MeshError, ValueError),
                             (ensonify.MemoryError, MemoryError)):
            self.assertTrue(issubclass(one, ensonify.Error) and issubclass(one, builtin), one)
        with self.assertRaises(ensonify.Error):
            ensonify.Simulator({"track": {"pingz": 1}})
        program = ("import ensonify, resource\n"
                   "resource.setrlimit(resource.RLIMIT_AS, (2 << 30, resource.RLIM_INFINITY))\n"
                   "try:\n"
                   "    ensonify.Simulator({'seafloor': {'extent_east_m': 5700, 'extent_north_m': 5700, 'cell_m': 0.5}})\n"
                   "except ensonify.MemoryError as error:\n"
                   "    print(error)\n")
        result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
        self.assertIn("need about", result.stdout, result.stderr)

    def test_several_threads_get_the_same_lines_as_one(self):
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

    def test_a_child_of_fork_does_not_wait_for_a_thread_of_its_parent(self):
        simulator = ensonify.Simulator(scene)
        pose = simulator.track()[0]
        stop = threading.Event()

        def pings():
            while not stop.is_set():
                simulator.ping(pose)

        thread = threading.Thread(target=pings)
        thread.start()
        try:
            for _ in range(8):
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")  # Python 3.12 warns of a fork with threads
                    child = os.fork()
                if child == 0:
                    signal.alarm(60)  # a child that hangs
                    try:
                        simulator.ping(pose)
                        os._exit(0)
                    except RuntimeError as error:
                        os._exit(3 if "when this process was forked" in str(error) else 1)
                _, status = os.waitpid(child, 0)
                self.assertIn(status, (0, 3 << 8))
        finally:
            stop.set()
            thread.join()
        child = os.fork()  # no thread is in a call
        if child == 0:
            simulator.ping(pose)
            os._exit(0)
        self.assertEqual(os.waitpid(child, 0)[1], 0)

    def test_a_simulator_made_after_a_fork_does_not_wait_for_the_first_ping_of_a_thread(self):
        # Constants that are made in a first ping: each time another moment of it, in a process of its own.
        program = """
import os, signal, sys, threading, time, warnings
import ensonify
scene = {"seafloor": {"extent_east_m": 40, "extent_north_m": 20, "cell_m": 0.5}, "track": {"pings": 9, "speed_mps": 0.5},
         "sonar": {"a": {"range_m": 15, "bins": 100, "elevations": 128}}}
simulator = ensonify.Simulator(scene)
threading.Thread(target=lambda: [simulator.ping(ensonify.Pose(0, 0, -12)) for _ in range(20)], daemon=True).start()
time.sleep(float(sys.argv[1]))
warnings.simplefilter("ignore")  # Python 3.12 warns of a fork with threads
child = os.fork()
if child == 0:
    signal.alarm(20)  # a child that hangs
    ensonify.Simulator(scene).ping(ensonify.Pose(0, 0, -12))
    os._exit(0)
sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) != 0)
"""
        children = [subprocess.Popen([sys.executable, "-c", program, str(0.002 * i)]) for i in range(8)]
        self.assertEqual([child.wait() for child in children], [0] * len(children))

    def test_an_object_without_a_value_raises(self):
        arguments = {"ping": (self.pose,), "altitude_m": (self.pose,), "set": ({},), "move": (0, self.pose), "remove": (0,),
                     "add": ({"shape": "barrel"}, self.pose), "add_mesh": ([], [], self.pose), "track": ()}
        for kind in (ensonify.Simulator, ensonify.Image, ensonify.EchoLine, ensonify.RecordedLine, ensonify.Pose):
            empty = kind.__new__(kind)
            for name in (name for name in dir(kind) if not name.startswith("_")):
                with self.subTest(kind=kind.__name__, name=name), self.assertRaisesRegex(TypeError, "has no value"):
                    attribute = getattr(empty, name)
                    attribute(*arguments[name])
        for kind in (ensonify.Image, ensonify.EchoLine):
            with self.assertRaisesRegex(TypeError, "has no value"):
                kind.__new__(kind)["intensity"]
        for use in (repr, copy.copy, lambda pose: pose == self.pose, ensonify.Simulator(scene).ping):
            with self.assertRaisesRegex(TypeError, "has no value"):
                use(ensonify.Pose.__new__(ensonify.Pose))

    def test_control_c_stops_the_making_of_a_long_track(self):
        simulator = ensonify.Simulator({**scene, "track": {"pings": 1000000, "speed_mps": 0, "ping_interval_s": 0.1}})
        ran_out = []

        def handler(*_):
            raise KeyboardInterrupt

        before = signal.signal(signal.SIGALRM, handler)
        try:
            signal.setitimer(signal.ITIMER_REAL, 0.2)
            with self.assertRaises(KeyboardInterrupt):
                simulator.track()
                ran_out.append(True)
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, before)
        self.assertEqual(ran_out, [])

    def test_the_interpreter_ends_while_daemon_threads_ping(self):
        # What the main thread does at its end, registered before the module is imported, comes last.
        program = f"""
import atexit, threading, time
atexit.register(lambda: print(len(simulator.ping(ensonify.Pose(0, 0, -12)))))
import ensonify
scene = {scene!r}
simulator = ensonify.Simulator(scene, threads=1)
def ping():
    while True:
        simulator.ping(ensonify.Pose(0, 0, -12))
def make_images():
    while True:
        ensonify.images(scene, threads=2)
for work in (ping, ping, make_images):
    threading.Thread(target=work, daemon=True).start()
time.sleep(0.2)
"""
        for _ in range(5):
            result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
            self.assertEqual((result.returncode, result.stdout), (0, "2\n"), result.stderr)


class Readme(unittest.TestCase):
    def test_the_first_program_is_short_and_runs(self):
        blocks = [block for block in re.findall(r"```python\n(.*?)```", readme.read_text(), re.S)
                  if "import ensonify" in block]
        self.assertTrue(blocks)
        program = blocks[0]
        self.assertLessEqual(len([line for line in program.splitlines() if line.strip()]), 5)
        result = subprocess.run([sys.executable, "-c", program], cwd=readme.parent, capture_output=True, text=True)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("(660, 2000)", result.stdout)


if __name__ == "__main__":
    unittest.main()
