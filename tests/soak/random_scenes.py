"""Scenes of random keys, drawn from the program's own schema."""

import json
import math
import re

# Keys that need a file or a text of their own.
NOT_DRAWN = {"version", "seed", "kind", "survey", "mesh", "progressive", "profile", "file", "table",
             "vertical_pattern", "image", "instruction_set", "start_time", "class_names",
             "sediment_names", "layers", "extent_east_m", "extent_north_m", "cell_m"}
# So that a trial takes a second or two.
MOST = {"pings": 9, "bins": 200, "elevations": 300, "planes": 8, "legs": 3, "beams": 3,
        "side_lobes": 3, "count": 6, "number": 20, "per_hectare": 400, "fish_per_hectare": 400,
        "looks": 8, "range_m": 60, "pings_per_file": 5, "penetration_m": 2}
LEAST = {"sample_rate_hz": 1000}
LAYERS = ("patches", "roughness", "crests", "trawl_marks", "pits", "outcrops", "boulders")
MATERIALS = ("medium sand", "silt", "sandy gravel", "clay", "rock", "cobble")


class RandomScenes:
    def __init__(self, json_schema):
        self.schema = json.loads(json_schema)["properties"]

    def draw(self, random):
        """A scene as nested dictionaries. Most are not valid at once: see repair()."""
        often = random.choice((0.02, 0.05, 0.1, 0.2))
        scene = {"version": 1, "seed": random.randrange(1 << 20)}
        scene |= self.table(random, {k: self.schema[k] for k in ("conditions", "speckle", "texture")}, 0.3)
        for name in ("sea", "seafloor", "track", "motion", "navigation", "arrivals", "artefacts",
                     "run", "display", "output"):
            scene[name] = self.table(random, self.schema[name]["properties"], often)
        cell_m = random.choice((0.05, 0.1, 0.2, 0.5, 2))
        bed = scene["seafloor"]
        bed |= {"cell_m": cell_m, "extent_east_m": random.randint(40, 300) * cell_m,
                "extent_north_m": random.randint(40, 300) * cell_m,
                "depth_m": random.choice((5, 10, 20, 60))}
        for layer in LAYERS:
            if random.random() < 0.25:
                keys = self.schema["seafloor"]["properties"][layer]["items"]["properties"]
                bed[layer] = [self.table(random, keys, 0.25) for _ in range(random.randint(1, 2))]
        scene["track"] |= {"pings": random.randint(1, 9),
                           "altitude_m": random.uniform(0.1, 0.9) * bed["depth_m"]}
        (keys,) = (table["properties"] for table in self.schema["sonar"]["patternProperties"].values())
        scene["sonar"] = {}
        for name in ("first", "second")[:random.choice((1, 1, 1, 2))]:
            scene["sonar"][name] = self.table(random, keys, often) | {
                "bins": random.randint(1, 200), "elevations": random.randint(2, 300),
                "range_m": random.uniform(1, 60)}
        keys = self.schema["objects"]["items"]["properties"]
        scene["objects"] = [self.table(random, keys, 0.12) |
                            {"shape": random.choice(keys["shape"]["enum"])}
                            for _ in range(random.choice((0, 0, 1, 2, 3)))]
        scene["output"]["npz"] = True
        return scene

    def table(self, random, keys, often):
        table = {}
        for name, key in keys.items():
            if name in NOT_DRAWN or key.get("type") == "array":
                continue
            if "properties" in key:
                table[name] = self.table(random, key["properties"], 2 * often)
            elif random.random() < often:
                value = self.value(random, name, key)
                if value is not None:
                    table[name] = value
        return table

    @staticmethod
    def value(random, name, key):
        if "enum" in key:
            return random.choice([word for word in key["enum"] if not word.startswith("brute")])
        if key.get("type") == "boolean":
            return random.random() < 0.5
        if name == "material":
            return random.choice(MATERIALS)
        if key.get("type") not in ("number", "integer"):
            return None
        low = max(key["minimum"], LEAST.get(name, -math.inf))
        high = min(key["maximum"], MOST.get(name, math.inf))
        kind = random.random()
        if kind < 0.1:
            value = low
        elif kind < 0.2:
            value = high
        elif kind < 0.7:
            value = min(max(random.lognormvariate(0, 1.5), low), high)
        else:
            value = random.uniform(low, min(high, max(low + 1, 20)))
        return round(value) if key["type"] == "integer" else float(f"{value:.6g}")


def toml(scene, prefix=""):
    """A scene as TOML."""
    keys, tables = [], []
    for name, value in scene.items():
        if isinstance(value, dict):
            tables.append(f"[{prefix}{name}]\n{toml(value, f'{prefix}{name}.')}")
        elif isinstance(value, list):
            tables += [f"[[{prefix}{name}]]\n{toml(table, f'{prefix}{name}.')}" for table in value]
        else:
            keys.append(f"{name} = {json.dumps(value)}")
    return "\n".join([*keys, *tables]) + "\n"


def repair(scene, message):
    """Removes a key or a table that a message of the program names. False if it names none."""
    for path in re.findall(r"[a-z_]+(?:\.[a-z0-9_]+)+", message):
        *tables, last = path.split(".")
        at = scene
        for name in tables:
            at = at[int(name)] if isinstance(at, list) and name.isdigit() and int(name) < len(at) else \
                at.get(name, {}) if isinstance(at, dict) else {}
        if isinstance(at, list) and last.isdigit() and int(last) < len(at):
            del at[int(last)]
            return True
        if isinstance(at, dict) and last in at:
            del at[last]
            return True
    bed = scene["seafloor"]
    if "track: " in message:
        return strip(scene["track"], ("pings", "altitude_m")) or scene.pop("motion", None) is not None or \
            bed.pop("water_level_m", None) is not None
    if "the bed rises" in message:
        return any(bed.pop(name, None) for name in ("slope_deg", "fractal", "ripples", *LAYERS,
                                                      "water_level_m"))
    words = set(re.findall(r"[a-z_]+", message))
    if any(layer in words and bed.pop(layer, None) for layer in LAYERS) or remove_named(scene, words):
        return True
    sonar = re.search(r"'sonar\.(\w+)", message)
    return sonar is not None and strip(scene["sonar"][sonar[1]], ("bins", "elevations", "range_m"))


def strip(table, kept):
    """Leaves only these keys. False if there were no others."""
    others = [name for name in table if name not in kept]
    for name in others:
        del table[name]
    return bool(others)


def remove_named(table, words):
    for name, value in list(table.items()) if isinstance(table, dict) else enumerate(table):
        if isinstance(value, (dict, list)):
            if remove_named(value, words):
                return True
        elif name in words and name != "version":
            del table[name]
            return True
    return False
