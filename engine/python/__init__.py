"""Sidescan sonar, simulated by tracing rays::

    import ensonify
    image = ensonify.simulate("scenes/ripples.toml")     # a NumPy array of (pings, samples)

`simulate` gives a scene's image, `images` the images of all its sonars with their poses, targets and
attributes, and a `Simulator` pings from any pose. `read_recording` reads a real recording. `layers`
lists what is known of each sample.
"""

from ._ensonify import (EchoLine, Error, Image, MemoryError, MeshError, Pose, RecordedLine, RecordingError,
                        SceneError, Simulator, __version__, _sonars, images, layers, read_recording)

__all__ = ["EchoLine", "Error", "Image", "MemoryError", "MeshError", "Pose", "RecordedLine",
           "RecordingError", "SceneError", "Simulator", "images", "layers", "read_recording", "simulate"]

for _public in (EchoLine, Error, Image, MemoryError, MeshError, Pose, RecordedLine, RecordingError, SceneError,
                Simulator, images, read_recording):
    _public.__module__ = __name__


def simulate(scene, *, sonar=None, layer="intensity", keys=None, data="", cache=None, threads=0, progress=None):
    """Simulates every ping of a scene.

    Returns an array of (pings, samples): port from far to near, then starboard from near to far. If
    the scene has several sonars and `sonar` is not given, returns a dict from each sonar's name to
    its array, in the scene's order.

    scene: a scene file's path, or a dict of the same keys. sonar: the name of the only sonar to
    return. layer: a name from `layers`. For a list of names or "all", each array is replaced by a
    dict from layer names to arrays, which share the image's memory. keys: keys to change, such as
    {"track.altitude_m": 4}. data: the folder of `data:` paths (default: ENSONIFY_DATA). cache: the
    folder for analysed seafloors (default: ~/.cache/ensonify). threads: 0 for one per core.
    progress(stage, done, of) is called repeatedly, from any thread.

    Raises SceneError or MeshError (both are ValueErrors) if the scene or one of its files is wrong,
    KeyError for an unknown sonar or layer, ValueError for a wrong number of threads, and TypeError
    for a value whose type no key of a scene has.
    """
    single = isinstance(layer, str) and layer != "all"
    wanted = [layer] if single else layers if layer == "all" else list(layer)
    for name in wanted:
        if name not in layers:
            raise KeyError(f"there is no layer {name!r}; there are: {', '.join(layers)}")
    if sonar is not None and sonar not in (names := _sonars(scene, keys, data)):
        raise KeyError(f"there is no sonar {sonar!r}; there are: {', '.join(names)}")
    made = images(scene, keys=keys, data=data, cache=cache, threads=threads, progress=progress)

    def arrays(image):
        return image[layer] if single else {name: image[name] for name in wanted}

    if sonar is None and len(made) > 1:
        return {name: arrays(image) for name, image in made.items()}
    return arrays(made[next(iter(made)) if sonar is None else sonar])
