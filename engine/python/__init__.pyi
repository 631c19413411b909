from os import PathLike
from typing import Any, Callable, Mapping, Sequence, overload

from numpy import float32, uint32
from numpy.typing import ArrayLike, NDArray

Array = NDArray[float32] | NDArray[uint32]
Scene = str | PathLike[str] | Mapping[str, Any]

layers: list[str]

class SceneError(ValueError): ...
class MeshError(ValueError): ...

class Pose:
    """Local metres (x east, y north, z up, the sea surface at 0); degrees; turned clockwise from north,
    then nose up, then starboard down."""
    t_s: float
    position_m: tuple[float, float, float]
    def __init__(self, x_m: float, y_m: float, z_m: float, *, t_s: float = 0, roll_deg: float = 0,
                 pitch_deg: float = 0, heading_deg: float = 0,
                 velocity_mps: Sequence[float] = (0, 0, 0),
                 rates_degps: Sequence[float] = (0, 0, 0)) -> None: ...

class EchoLine:
    """One side of one ping: line["intensity"] and every other layer, bins from near to far."""
    @property
    def sonar(self) -> str: ...
    @property
    def side(self) -> str: ...
    @property
    def first_return(self) -> int: ...
    @property
    def starved(self) -> int: ...
    def __getitem__(self, layer: str) -> Array: ...

class Image:
    """All pings of a sonar: image["intensity"] and every other layer, (pings, samples)."""
    @property
    def sonar(self) -> str: ...
    @property
    def shape(self) -> tuple[int, int]: ...
    def __getitem__(self, layer: str) -> Array: ...

class Simulator:
    """A scene made ready. One thread at a time is inside; others wait."""
    def __init__(self, scene: Scene, *, keys: Mapping[str, Any] = {}, data: str | PathLike[str] = "",
                 cache: str | PathLike[str] | None = None, threads: int = 0) -> None: ...
    def ping(self, pose: Pose, number: int | None = None) -> list[EchoLine]:
        """The lines of every sonar's sides. Without a number it is the session's next."""
    def set(self, keys: Mapping[str, Any]) -> None:
        """Sonars' keys from the next ping on, as {"sonar.sidescan.range_m": 40}."""
    def add(self, object: Mapping[str, Any], pose: Pose) -> int:
        """Puts an object in, with the keys of a scene's [[objects]]: {"shape": "barrel"}. Returns its instance."""
    def add_mesh(self, vertices: ArrayLike, faces: ArrayLike, pose: Pose, *, material: str = "steel",
                 class_name: str = "object") -> int:
        """The same of a mesh in metres: z up, y where its heading points."""
    def move(self, instance: int, pose: Pose) -> None: ...
    def remove(self, instance: int) -> None: ...
    def altitude_m(self, pose: Pose) -> float: ...
    def track(self) -> list[Pose]: ...
    @property
    def classes(self) -> list[str]: ...
    @property
    def materials(self) -> list[str]: ...
    @property
    def warnings(self) -> list[str]: ...

@overload
def simulate(scene: Scene, *, sonar: str | None = None, layer: str = "intensity",
             keys: Mapping[str, Any] | None = None, data: str | PathLike[str] = "",
             cache: str | PathLike[str] | None = None, threads: int = 0,
             progress: Callable[[str, int, int], object] | None = None) -> Array: ...
@overload
def simulate(scene: Scene, *, sonar: str | None = None, layer: Sequence[str],
             keys: Mapping[str, Any] | None = None, data: str | PathLike[str] = "",
             cache: str | PathLike[str] | None = None, threads: int = 0,
             progress: Callable[[str, int, int], object] | None = None) -> dict[str, Array]: ...
