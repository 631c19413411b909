"""Sidescan sonar, simulated by tracing rays.

    import ensonify
    image = ensonify.simulate("scenes/ripples.toml")
"""

from ._ensonify import EchoLine, Image, MeshError, Pose, SceneError, Simulator, _images, layers

__all__ = ["EchoLine", "Image", "MeshError", "Pose", "SceneError", "Simulator", "layers", "simulate"]


def simulate(scene, *, sonar=None, layer="intensity", keys=None, data="", cache=None, threads=0, progress=None):
    """Every ping of a scene, as an image of (pings, samples): port far to near, then starboard.

    scene: a scene file's path, or a dict of the same keys. sonar: whose image, by name (the scene's only
    one, or the first by name). layer: which of `layers`; or a list of them, or "all", for a dict of arrays,
    which share the image's memory. keys: changes, as {"track.altitude_m": 4}. data: the folder of
    `data:` paths (default: ENSONIFY_DATA). progress(stage, done, of) is called now and then.
    Raises SceneError and MeshError (both ValueErrors) for what is wrong with scene and files.
    """
    images = _images(scene, keys or {}, data, cache, threads, progress)
    if sonar is None:
        sonar = next(iter(images))
    if sonar not in images:
        raise KeyError(f"there is no sonar {sonar!r}; there are: {', '.join(images)}")
    image = images[sonar]
    if isinstance(layer, str) and layer != "all":
        return image[layer]
    return {name: image[name] for name in (layers if layer == "all" else layer)}
