"""Messages of XPlaneConnect, the plugin of X-Plane, in both directions; `xplane_protocol` has their bytes."""

from __future__ import annotations

from dataclasses import dataclass

KEEP = -998.0  # of a number that the plugin leaves as it is
KEEP_GEAR = -1
RUN, PAUSE, TOGGLE = 0, 1, 2  # of `Simulation`; 100 + n pauses aircraft n alone, 200 + n lets it go on


@dataclass(frozen=True)
class Connect:
    """CONN: answers are to go to this port of the sender's host."""

    port: int


@dataclass(frozen=True)
class Connected:
    """CONF: the answer to CONN."""

    connection: int


@dataclass(frozen=True)
class Simulation:
    """SIMU: `RUN`, `PAUSE` or `TOGGLE` the physics."""

    state: int


@dataclass(frozen=True)
class AskPosition:
    """GETP: send `Position` of an aircraft."""

    aircraft: int = 0


@dataclass(frozen=True)
class AskControls:
    """GETC: send `Controls` of an aircraft."""

    aircraft: int = 0


@dataclass(frozen=True)
class Position:
    """POSI: where an aircraft is to be, or is."""

    latitude: float  # [deg]
    longitude: float  # [deg]
    altitude: float  # above mean sea level [m]
    pitch: float  # nose up [deg]
    roll: float  # right wing down [deg]
    heading: float  # clockwise from true north [deg]
    gear: float = KEEP  # 0 up to 1 down
    aircraft: int = 0  # 0: the user's own; in an answer the gear's handle
    coarse: bool = False  # the first three as float32, good to 0.5 m


@dataclass(frozen=True)
class PositionAskTerrain:
    """POST: as POSI, and send `Terrain` there."""

    position: Position


@dataclass(frozen=True)
class Controls:
    """CTRL: sticks and levers, to be set or as they are."""

    pitch: float  # of the stick, back is 1
    roll: float  # of the stick, right is 1
    yaw: float  # of the pedals, right is 1
    throttle: float  # of all engines; in an answer that of the first
    gear: int = KEEP_GEAR  # 0 up, 1 down
    flaps: float = KEEP  # 0 to 1
    aircraft: int | None = 0  # None: an old sender leaves it out
    speed_brake: float | None = None  # -0.5 to 1.5; None: left out


@dataclass(frozen=True)
class References:
    """DREF: data references to set."""

    values: tuple[tuple[str, tuple[float, ...]], ...]


@dataclass(frozen=True)
class AskReferences:
    """GETD: send `Values` of data references; without a name those of the last time."""

    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class Values:
    """RESP: values of the data references that were asked for; none of an unknown one."""

    values: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Rows:
    """DATA: rows of X-Plane's own output table, each its number and eight values."""

    rows: tuple[tuple[int, tuple[float, ...]], ...]


@dataclass(frozen=True)
class Text:
    """TEXT: words on the screen; none clears it."""

    words: str
    x: int = -1  # pixels from the left; -1: the usual place
    y: int = -1  # pixels from the bottom


@dataclass(frozen=True)
class Camera:
    """Where the cameras of the views of runway and chase are."""

    place: tuple[float, float, float]
    direction: tuple[float, float, float]
    zoom: float


@dataclass(frozen=True)
class View:
    """VIEW: number of a view, by X-Plane's key strokes."""

    view: int
    camera: Camera | None = None


@dataclass(frozen=True)
class Waypoints:
    """WYPT: waypoints to draw: 1 adds, 2 removes, 3 clears all."""

    operation: int
    points: tuple[tuple[float, float, float], ...] = ()  # latitude, longitude [deg], altitude [m]


@dataclass(frozen=True)
class Commands:
    """COMM: commands of X-Plane by name."""

    names: tuple[str, ...]


@dataclass(frozen=True)
class AskTerrain:
    """GETT: send `Terrain` of a place; `KEEP` anywhere: below the aircraft."""

    latitude: float = KEEP  # [deg]
    longitude: float = KEEP  # [deg]
    altitude: float = KEEP  # [m]
    aircraft: int = 0


@dataclass(frozen=True)
class Terrain:
    """TERR: ground or water at a place."""

    latitude: float  # [deg]
    longitude: float  # [deg]
    altitude: float  # above mean sea level [m]
    normal: tuple[float, float, float]
    velocity: tuple[float, float, float]  # [m/s]
    wet: int
    result: int  # of the probe; 0: it hit
    aircraft: int = 0


@dataclass(frozen=True)
class Beacon:
    """BECN: what the plugin multicasts about itself."""

    port: int
    xplane: int  # version, such as 11260
    plugin: str  # version


Message = (
    Connect | Connected | Simulation | AskPosition | AskControls | Position | PositionAskTerrain | Controls
    | References | AskReferences | Values | Rows | Text | View | Waypoints | Commands | AskTerrain | Terrain | Beacon
)  # fmt: skip
