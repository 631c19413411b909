"""Attacks by random scenes: runs, sessions and datasets."""

import hashlib
import json
import shutil
import zipfile

import numpy
import PIL.Image

import random_scenes
from attack import Failed, Row, check_same, tree

SURFACES = ("static", "refined", "footprint")


class RandomRow(Row):
    """Draws scenes, and removes keys until the program takes them."""

    unit = "scenes"

    def __init__(self, program, jobs, folder):
        super().__init__(program, jobs, folder)
        self.scenes = random_scenes.RandomScenes(
            program.check(["schema", "--json-schema"], folder, codes={0})[1])

    def is_made_valid(self, scene, make, fixed=()):
        """Whether make() succeeded in the end. `fixed` are tables whose given keys stay."""
        given = {name: dict(scene[name]) for name in fixed}
        for _ in range(60):
            (self.folder / "scene.toml").write_text(random_scenes.toml(scene))
            code, message = make()
            if code == 0:
                return True
            if not random_scenes.repair(scene, message):
                return False
            for name, keys in given.items():
                scene[name] = scene.get(name, {}) | keys
        return False

    def command(self, *args, **how):
        """The exit code, what was written, and the message."""
        code, out, err = self.program.run(args, self.folder, **how)
        lines = [line for line in err.splitlines() if line and "warning:" not in line]
        if code not in (0, 1, 2, 3) or (code != 0 and not lines):
            raise Failed(self.kept(f"{args[0]}: exit code {code}; {err[-400:]}"))
        return code, out, lines[0] if lines else ""

    def kept(self, problem):
        failed = self.folder / "failed"
        failed.mkdir(exist_ok=True)
        place = failed / f"{len(list(failed.iterdir()))}.toml"
        shutil.copy(self.folder / "scene.toml", place)
        return f"{place}: {problem}"


class RandomRuns(RandomRow):
    title = "scenes of random keys: a message, or the same files on every surface, with any number " \
            "of threads, and in parts"

    def trial(self, draw):
        scene = self.scenes.draw(draw)
        if not self.is_made_valid(scene, lambda: self.make("whole")):
            return 0
        expected = contents(self.folder / "whole")
        ways = {"threads": ["--threads", draw.choice([1, 3, 5])]}
        if "embree" not in scene["run"].get("intersector", ""):
            ways |= {surface: ["--surface", surface] for surface in SURFACES}
        display = scene["display"]
        if not (display.get("flat_field") or display.get("beam_normalisation") or
                display.get("mapping") == "equalised"):
            ways["parts"] = ["-D", "output.pings_per_file=2", "-D", "output.file_per_leg=false"]
        for way, args in ways.items():
            code, message = self.make(way, *args)
            if code == 2 and way in SURFACES:
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
        code, _, message = self.command("run", "scene.toml", "-o", way, "--quiet", *args)
        return code, message


def contents(folder):
    """Hashes of what a run's files say, without what tells how the run was made."""
    hashes = {}
    for file in sorted(folder.rglob("*")):
        name = str(file.relative_to(folder))
        if file.suffix == ".npz":
            with zipfile.ZipFile(file) as layers:
                hashes |= {f"{name}/{layer.filename}": layer.CRC for layer in layers.infolist()
                           if layer.filename != "attributes.npy"}
        elif file.is_file() and (file.suffix in (".png", ".csv", ".xtf", ".jsf") or
                                 name.endswith("_targets.json")):
            hashes[name] = hashlib.sha256(file.read_bytes()).hexdigest()
    return hashes


class RandomSessions(RandomRow):
    title = "sessions that add, move and remove random objects: the last ping is that of a session " \
            "that began as the other one ends"
    unit = "sessions"
    shapes = ("box", "sphere", "cylinder", "cone", "wedge", "boulder", "barrel", "tyre", "pot", "anchor",
              "mine", "container", "ladder", "boat")
    layers = "intensity,intensity_mean,x_m,grazing_rad,region,sediment,class,instance,fraction," \
             "shadow_fraction,shadow_instance,layover"

    def trial(self, draw):
        scene = self.scenes.draw(draw)
        ping = self.pose(draw, scene)
        if not self.is_made_valid(scene, lambda: self.answers(["-D", "run.surface=auto"], [ping])[::2]):
            return 0
        stay = [{"add": self.thing(draw)} for _ in range(draw.randint(0, 2))]
        go = [{"add": self.thing(draw)} for _ in range(draw.randint(1, 2))]
        places = [self.pose(draw, scene) for _ in stay]
        range_m = {"sonar.first.range_m": scene["sonar"]["first"]["range_m"]}
        changed = {"sonar.first.range_m": draw.uniform(1, 60)}
        busy = [ping, *(one | self.pose(draw, scene) for one in stay + go), ping,
                {"set": changed}, {"move": draw.randint(1, len(stay) + len(go))} | self.pose(draw, scene),
                ping, *({"remove": 1 + len(stay) + i} for i in range(len(go))), {"set": range_m},
                *({"move": 1 + i} | place for i, place in enumerate(places)), ping]
        calm = [ping, ping, ping, {"set": changed}, {"set": range_m},
                *(one | place for one, place in zip(stay, places)), ping]
        surfaces = SURFACES if "embree" not in scene["run"].get("intersector", "") else ("static",)
        # Instances of the scene's own objects and features come first.
        first = self.first_instance(ping)
        last = []
        for requests in (busy, calm):
            for request in requests:
                for verb in ("move", "remove"):
                    if verb in request:
                        request[verb] += first - 1
            code, out, message = self.answers(["-D", f"run.surface={draw.choice(surfaces)}"], requests)
            if code == 2:
                return 0  # the scene does not allow that surface
            if code != 0:
                raise Failed(self.kept(f"exit code {code}; {message}"))
            pings = [line for line in out.splitlines() if line.startswith(b'{"ping"')]
            last.append([line for line in pings if json.loads(line)["ping"] == 3])
        if not last[0] or last[0] != last[1]:
            raise Failed(self.kept(f"other lines after {json.dumps(busy)}"))
        return 1

    def first_instance(self, ping):
        _, out, _ = self.answers([], [{"add": {"shape": "box"}} | ping])
        return json.loads(out.splitlines()[-1])["added"]

    def thing(self, draw):
        keys = {"shape": draw.choice(self.shapes), "shape_seed": draw.randrange(100)}
        if draw.random() < 0.4:
            keys["scale"] = draw.choice([0.1, 0.5, 3])
        return keys

    @staticmethod
    def pose(draw, scene):
        depth_m = scene["seafloor"]["depth_m"]
        return {"x_m": draw.uniform(-8, 8), "y_m": draw.uniform(-8, 8),
                "z_m": -depth_m * draw.uniform(0.1, 0.9), "heading_deg": draw.uniform(0, 360),
                "roll_deg": draw.choice([0, 0, draw.uniform(-30, 30)]), "vx_mps": draw.choice([0, 2])}

    def answers(self, args, requests):
        text = b"".join(json.dumps(request).encode() + b"\n" for request in requests)
        code, out, message = self.command("stream", "scene.toml", "--json", "--quiet", "--layers",
                                          self.layers, *args, text=text)
        return code, out, message


class RandomDatasets(RandomRow):
    title = "recipes of random keys: masks, boxes, outlines and areas agree, and shards and the " \
            "sample's own scene make the same files"
    unit = "samples"

    def trial(self, draw):
        scene = self.recipe(draw)

        def make():
            shutil.rmtree(self.folder / "whole", ignore_errors=True)
            code, _, message = self.command("generate", "scene.toml", "-o", "whole", "--quiet",
                                            "--threads", 2)
            return code, message

        if not self.is_made_valid(scene, make, fixed=("track",)):
            return 0
        try:
            self.check_shards(draw)
            samples = sorted((self.folder / "whole/samples").iterdir())
            for sample in samples:
                for file in sample.rglob("*.json"):
                    if file.name not in ("manifest.json", "sample.json") and \
                            not file.name.endswith("_targets.json"):
                        check_labels(file, sample)
            self.check_scene_of(draw.choice(samples))
            code, _, message = self.command("merge", "whole", "--quiet")
            if code != 0:
                raise Failed(f"merge: {message}")
            for file in (self.folder / "whole/coco").glob("*.json"):
                check_coco(json.loads(file.read_text()), file.name)
        except Failed as problem:
            raise Failed(self.kept(problem)) from None
        return len(samples)

    def recipe(self, draw):
        scene = self.scenes.draw(draw)
        bed = scene["seafloor"]
        for name in ("extent_east_m", "extent_north_m"):
            bed[name] = max(bed[name], 10.0)
        bed["cell_m"] = max(bed["cell_m"], bed["extent_north_m"] / 300)
        pings = draw.choice([20, 40, 80])
        scene["track"] = {"pings": pings, "ping_interval_s": 0.2, "altitude_m": 0.4 * bed["depth_m"],
                          "speed_mps": 3 * bed["extent_north_m"] / pings}
        scene["motion"] = {name: keys for name, keys in scene["motion"].items()
                           if name in ("roll", "pitch", "heading", "heave")}
        scene["artefacts"].pop("lost", None)
        scene["display"].pop("slant_range_correction", None)
        scene["output"] = {"exr": False}
        for sonar in scene["sonar"].values():
            sonar |= {"bins": draw.randint(30, 120), "range_m": draw.uniform(5, 30)}
        scene["objects"].append({"shape": draw.choice(["box", "boulder", "sphere"]),
                                 "count": draw.randint(1, 5)})
        scene["dataset"] = {"samples": draw.randint(2, 3), "seafloors": draw.choice([0, 0, 1]),
                            "renders": draw.choice([1, 2]), "least_visible": draw.choice([0, 0.25, 0.6]),
                            "least_px": draw.choice([0, 3, 10]), "shadow_class": draw.random() < 0.4,
                            "ground_px_m": draw.choice([0, 0, 0.1, 0.3])}
        if draw.random() < 0.5:
            scene["dataset"]["tiles"] = {"width_px": draw.randint(5, 40), "height_px": draw.randint(3, 20),
                                         "stride": draw.choice([0.5, 1, 1.5])}
        if draw.random() < 0.6:
            scene["dataset"]["chips"] = {"size_px": draw.randint(8, 20), "backgrounds": draw.choice([0, 1]),
                                         "with_shadow": draw.random() < 0.5,
                                         "hard_negatives": draw.choice([0, 1])}
        return scene

    def check_shards(self, draw):
        shutil.rmtree(self.folder / "shards", ignore_errors=True)
        count = draw.randint(1, 3)
        for shard in draw.sample(range(count), count):
            code, _, message = self.command("generate", "scene.toml", "-o", "shards", "--quiet",
                                            "--threads", 1, "--shard", f"{shard}/{count}")
            if code != 0:
                raise Failed(f"shard {shard}/{count}: {message}")
        check_same(tree(self.folder / "shards"), tree(self.folder / "whole"), f"{count} shards")

    def check_scene_of(self, sample):
        shutil.rmtree(self.folder / "again", ignore_errors=True)
        code, _, message = self.command("run", sample / "scene.toml", "-o", "again", "--quiet")
        if code != 0:
            raise Failed(f"{sample.name}/scene.toml: {message}")
        expected = tree(sample)
        for name, hash in tree(self.folder / "again").items():
            if expected.get(name) != hash:
                raise Failed(f"{sample.name}/scene.toml makes another {name}")


def check_labels(file, sample):
    """Compares the labels of an image with its masks."""
    labels = json.loads(file.read_text())
    masks = {name: numpy.array(PIL.Image.open(file.with_suffix(f".{name}.png")))
             for name in ("instance", "class", "region", "sediment")}
    place = f"{sample.name}/{labels['image']}"
    if any(mask.shape != (labels["height"], labels["width"]) for mask in masks.values()):
        raise Failed(f"{place}: a mask of another size")
    instances = masks["instance"]
    for target in labels["targets"]:
        shown = instances == target["instance"]
        body = None if target.get("ignored") else target["body"]
        if (body is not None) != shown.any():
            raise Failed(f"{place}: instance {target['instance']} is in its mask or has a box, not both")
        if body is None:
            continue
        rows, columns = numpy.nonzero(shown)
        box = [columns.min(), rows.min(), numpy.ptp(columns) + 1, numpy.ptp(rows) + 1]
        outline = body.get("rle") or body["polygons"]
        if box != body["box"] or {body["area_px"], area_px(outline)} != {len(rows)}:
            raise Failed(f"{place}: instance {target['instance']} has another box or area than its mask")
    known = {target["instance"] for target in labels["targets"]} | {0, 65535}
    if not set(numpy.unique(instances).tolist()) <= known:
        raise Failed(f"{place}: an instance without a target")


def check_coco(coco, name):
    images = {image["id"]: image for image in coco["images"]}
    categories = {category["id"] for category in coco["categories"]}
    for one in coco["annotations"]:
        image = images[one["image_id"]]
        x, y, width, height = one["bbox"]
        inside = 0 <= x < x + width <= image["width"] and 0 <= y < y + height <= image["height"]
        if not inside or one["area"] != area_px(one["segmentation"]) or one["category_id"] not in categories:
            raise Failed(f"{name}: annotation {one['id']}")


def area_px(outline):
    """The pixels of COCO run lengths, or inside polygons whose edges lie between pixels."""
    if isinstance(outline, dict):
        return sum(outline["counts"][1::2])
    area = 0.0
    for polygon in outline:
        x, y = numpy.array(polygon[0::2], float), numpy.array(polygon[1::2], float)
        area += abs(numpy.dot(x, numpy.roll(y, -1)) - numpy.dot(y, numpy.roll(x, -1))) / 2
    return area
