"""What a robot is: body, actuators, sensors, rates and limits, as read from its YAML."""

from __future__ import annotations

import functools
from dataclasses import dataclass, field
from typing import Annotated, Any, TypeVar

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.strict_yaml import Kinds, Named
from fulmar_core.robots.actuators.families import FAMILIES
from fulmar_core.robots.actuators.family import Actuators
from fulmar_core.robots.actuators.parts import check_part_names
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.robots.airframe.airframe import Airframe
from fulmar_core.robots.hydrodynamics import Hydrodynamics
from fulmar_core.robots.kinds import kind_of
from fulmar_core.robots.kinds.kind import Kind
from fulmar_core.robots.look import Part, check_look
from fulmar_core.robots.morphology import Morphology
from fulmar_core.robots.sensors.camera import PROFILES, CameraConfig
from fulmar_core.robots.sensors.event_camera import EventCamera
from fulmar_core.robots.sensors.imu import ImuSpec
from fulmar_core.robots.sensors.kind import SensorKind
from fulmar_core.robots.sensors.odometer import OdometrySpec
from fulmar_core.robots.sensors.own_sensor import OwnSensorSpec
from fulmar_core.robots.sensors.table import SENSORS, sensor_kind
from fulmar_core.states.state import State
from fulmar_core.wires.robot_name import check_robot_name

Range = tuple[float, float]
Vector3 = tuple[float, float, float]
Class = TypeVar("Class", bound=type)
Family = TypeVar("Family", bound=Actuators)


@dataclass(frozen=True)
class Body:
    """Mass properties and outline of a rigid body."""

    mass: float  # [kg]
    inertia: tuple[float, ...]  # about the body axes: xx, yy, zz, or with xy, xz, yz [kg·m²]
    radius: float  # of the circle around the outline seen from above; what must not touch anything [m]
    height: float  # [m]
    planar: bool  # True: only x, y and yaw move
    footprint: tuple[float, float] | None = None  # length and width of a box; None: a disc of `radius` [m]
    footprint_x: float = 0.0  # of the box's centre, ahead of the body's origin [m]
    center_of_mass: tuple[float, ...] = (0.0, 0.0)  # ahead of the body's origin, to its left, and above [m]
    as_printed: bool = False  # the inertia is a source's, though no body has such moments

    def __post_init__(self) -> None:
        if len(self.inertia) not in (3, 6) or len(self.center_of_mass) not in (2, 3):
            raise ValueError("'inertia' needs three or six values, 'center_of_mass' two or three.")
        for name in ("mass", "radius", "height"):
            if getattr(self, name) <= 0.0:
                raise ValueError(f"'{name}' = {getattr(self, name):g} must be greater than 0.")
        if min(self.inertia[:3]) <= 0.0:
            raise ValueError(f"'inertia' = {list(self.inertia)}: xx, yy and zz must be greater than 0 kg·m².")
        if sum(part * part for part in self.center_of_mass) > self.radius**2:
            raise ValueError(f"'center_of_mass' = {list(self.center_of_mass)} lies outside of the outline.")
        moments = np.linalg.eigvalsh(self.inertia_matrix)
        impossible = 2.0 * moments[2] > moments.sum() * (1.0 + 1e-9) and not self.as_printed
        if moments[0] <= 0.0 or impossible:
            found = ", ".join(f"{moment:.4g}" for moment in moments)
            raise ValueError(
                f"'inertia' = {list(self.inertia)} has principal moments of {found} kg·m²: no body has a moment beyond "
                "the sum of the two others, or of 0 or less. Take them about the centre of mass, from one source."
            )

    @property
    def tensor(self) -> tuple[float, ...]:
        """Entries xx, yy, zz, xy, xz, yz of the inertia tensor about the centre of mass [kg·m²]."""
        return (*self.inertia, 0.0, 0.0, 0.0)[:6]

    @property
    def inertia_matrix(self) -> np.ndarray:
        """Inertia tensor about the centre of mass in the body's frame, shape (3, 3) [kg·m²]."""
        xx, yy, zz, xy, xz, yz = self.tensor
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    @property
    def com(self) -> tuple[float, ...]:
        """Centre of mass in the body's frame: x, y, z [m]."""
        return (*self.center_of_mass, 0.0)[:3]


@dataclass(frozen=True)
class Uncertainty:
    """Spans over which the body is not known; scenarios draw from them."""

    mass: Range  # [kg]
    yaw_inertia: Range  # [kg·m²]
    center_of_mass: float = 0.0  # how far from the body's origin, in any direction [m]
    drag: Range = (1.0, 1.0)  # factor on the damping of the water [-]

    def __post_init__(self) -> None:
        for name in ("mass", "yaw_inertia", "drag"):
            low, high = getattr(self, name)
            if not 0.0 < low <= high:
                raise ValueError(f"'{name}' must be [low, high] with 0 < low <= high, found [{low}, {high}].")
        if self.center_of_mass < 0.0:
            raise ValueError("'center_of_mass' must not be negative.")


@dataclass(frozen=True)
class Performance:
    """What the robot can do at its best; tasks, scenarios and scores scale with it."""

    force: float  # push in its strongest direction; 0: it only turns, and the speeds are 0 too [N]
    torque: float  # largest yaw moment [N·m]
    top_speed: float  # the fastest it goes in a straight line [m/s]
    speed: float  # ahead, that tasks ask for [m/s]
    reverse_speed: float  # astern, that tasks ask for [m/s]
    lateral_speed: float  # to either side, that tasks ask for; 0: it cannot [m/s]
    yaw_rate: float  # that tasks ask for [rad/s]
    turning_acceleration: float  # speed times turn rate that it can sustain [m/s²]

    def __post_init__(self) -> None:
        if min(self.torque, self.yaw_rate) <= 0.0:
            raise ValueError("torque and yaw_rate must be greater than 0.")
        if min(self.reverse_speed, self.lateral_speed) < 0.0:
            raise ValueError("reverse_speed and lateral_speed must not be negative.")


@dataclass(frozen=True)
class Costs:
    """What using the actuators costs a learner, in the units of the tasks' rewards, per control step."""

    effort: float  # times the sum of the shares of full command
    change: float  # times the sum of their squared changes


@dataclass(frozen=True)
class Timing:
    """How often the physics and the controller run."""

    physics_dt: float  # integration step of the simulators [s]
    control_hz: float  # default command rate [Hz]

    def __post_init__(self) -> None:
        if self.physics_dt <= 0.0 or self.control_hz <= 0.0:
            raise ValueError("physics_dt and control_hz must be greater than 0.")
        self.substeps(self.control_hz)

    @property
    def control_s(self) -> float:
        """A control step at the default rate [s]."""
        return 1.0 / self.control_hz

    def is_over_within(self, time_s: float) -> bool:
        """Whether a control step is over before a time has passed [s]."""
        return time_s > self.control_s + 1e-9

    def substeps(self, control_hz: float) -> int:
        """Physics steps in one control step.

        Args:
            control_hz: Command rate, > 0 [Hz].

        Returns:
            Whole number of steps, >= 1.

        Raises:
            ValueError: If the rate is not positive, or the control period is no multiple of the physics step.
        """
        if not control_hz > 0.0:
            raise ValueError(f"control_hz = {control_hz:g} must be greater than 0.")
        ratio = 1.0 / (control_hz * self.physics_dt)
        if ratio < 0.999 or abs(ratio - round(ratio)) > 1e-6:
            raise ValueError(
                f"control_hz = {control_hz:g} must divide the physics rate of {1.0 / self.physics_dt:g} Hz evenly."
            )
        return round(ratio)


def _with_every_sensor(cls: Class) -> Class:
    """Give a class a field for each row of the table of sensors; a robot has those that its file names."""
    for name, kind in SENSORS.items():
        if name not in cls.__annotations__:
            cls.__annotations__[name] = kind.spec  # not optional: a key without a value is a mistake
            setattr(cls, name, None)
    return cls


@dataclass(frozen=True)
@_with_every_sensor
class Sensors:
    """What the robot measures: two that every robot has, by name any other row of `SENSORS`, and users' own."""

    odometry: OdometrySpec
    imu: ImuSpec
    own: dict[str, OwnSensorSpec] = field(default_factory=dict, hash=False)  # by a name that no row has
    # In simulation a node of its own, which runs where it is asked for, shows what it sees.
    camera: Annotated[CameraConfig | None, Named(PROFILES)] = None

    @property
    def specs(self) -> dict[str, Any]:
        """The robot's sensors by name, in the order of the table."""
        return {name: spec for name in SENSORS if (spec := getattr(self, name)) is not None} | self.own

    @functools.cached_property
    def kinds(self) -> dict[str, SensorKind]:
        """Their rows; a user's own class is loaded here.

        Raises:
            ConfigError: Such a class cannot be loaded.
        """
        return {name: sensor_kind(name, spec) for name, spec in self.specs.items()}

    def __getstate__(self) -> dict[str, Any]:
        """What another process gets: not the rows, whose functions have no name to be found by."""
        return {key: value for key, value in vars(self).items() if key != "kinds"}

    def __post_init__(self) -> None:
        for name in self.own:
            if name in (*SENSORS, "camera") or not name.isidentifier():
                raise ValueError(
                    f"'own' has a sensor '{name}': a name of letters, digits and _ is needed that is none of "
                    f"{', '.join(SENSORS)}."
                )


@dataclass(frozen=True)
class Limits:
    """What the safety gates take for possible."""

    geofence: float  # largest distance from the goal at which control goes on [m]
    speed: float  # largest believable speed [m/s]
    yaw_rate: float  # largest believable turn rate [rad/s]

    def __post_init__(self) -> None:
        if min(self.geofence, self.speed, self.yaw_rate) <= 0.0:
            raise ValueError("geofence, speed and yaw_rate must be greater than 0.")


@dataclass(frozen=True)
class Robot:
    """Everything that is known about one robot, one definition for every user of it."""

    name: str
    title: str  # what it is, in a few words
    body: Body
    uncertainty: Uncertainty
    timing: Timing
    actuators: Annotated[Actuators, Kinds(FAMILIES)]
    performance: Performance
    costs: Costs
    sensors: Sensors
    limits: Limits
    hydrodynamics: Hydrodynamics | None = None  # of a hull that swims
    airframe: Airframe | None = None  # of an aircraft
    event_cameras: tuple[EventCamera, ...] = ()  # that look at the stars, at most two
    usual_controller: str = ""  # that drives it where none is asked for; empty: a shipped policy, else a law
    air_bearing: bool = False  # it floats on air that `air_bearing/enable` switches
    # How far bodies of its kind differ, of thrusters that open by degrees.
    morphology: Morphology | None = None
    look: tuple[Part, ...] = ()  # what people see; empty: its hull and its nozzles

    @functools.cached_property
    def kind(self) -> Kind:
        """What it has in common with others."""
        return kind_of(self.actuators, planar=self.body.planar, swims=self.hydrodynamics is not None)

    def actuated_by(self, family: type[Family]) -> Family:
        """Its actuators, for callers that are about one family, or one base of families.

        Raises:
            ValueError: It has others.
        """
        if not isinstance(self.actuators, family):
            fitting = " or ".join(name for name, each in FAMILIES.items() if issubclass(each, family))
            raise ValueError(f"'{self.name}' has {self.actuators.kind}; this is for {fitting}.")
        return self.actuators

    def check_kind(self, what: str, kinds: tuple[Kind, ...], otherwise: str) -> None:
        """Refuse what is not for this kind of robot.

        Args:
            what: A task or an estimator, in words.
            kinds: That it is for.
            otherwise: What to do instead.

        Raises:
            ConfigError: The robot is of none of the kinds.
        """
        if self.kind not in kinds:
            fitting = " and ".join(kind.plural for kind in kinds)
            raise ConfigError(
                f"{what} is for {fitting}; '{self.name}' is one of the {self.kind.plural}. {otherwise}"
            )

    @property
    def wings(self) -> Airframe:
        """The airframe, for callers that are about aircraft.

        Raises:
            ValueError: It is none.
        """
        if self.airframe is None:
            raise ValueError(f"'{self.name}' is no aircraft: its file has no 'airframe'.")
        return self.airframe

    @property
    def state_type(self) -> type[State]:
        """Form of its states: in the plane, or, of bodies that neither the floor nor water carries, in space."""
        return self.kind.state_type

    @property
    def flies(self) -> bool:
        """Whether it is an aircraft: it cannot stop."""
        return self.actuators.flies

    @property
    def drifts(self) -> bool:
        """Whether it keeps its motion when its actuators are at rest: neither the floor nor water slows it down."""
        return self.hydrodynamics is None and self.kind.drifts

    @property
    def hull_span(self) -> tuple[float, float]:
        """Bottom and top of the hull in the body's frame [m].

        The body's origin lies at the height of the axles, at the waterline, or half way up.
        """
        if self.hydrodynamics is None:
            return self.actuators.hull_span(self.body.height)
        low = -self.hydrodynamics.hydrostatics.draught
        return low, low + self.body.height

    @property
    def recipe(self) -> str:
        """Training settings where a robot and task have none of their own: a file of `configs/training`."""
        return self.kind.recipe or self.actuators.recipe

    def __post_init__(self) -> None:
        check_robot_name(self.name)
        check_part_names(self.actuators.names)
        check_look(self.look, self.actuators.names)
        _CHECKS.get(self.kind.name, _check_pushed)(self)
        axes = self.state_type.AXES
        if len(self.body.inertia) > 3 * (axes - 1) or len(self.body.center_of_mass) > axes:
            raise ValueError(
                f"'body.inertia' has {len(self.body.inertia)} values and 'body.center_of_mass' "
                f"{len(self.body.center_of_mass)}; a robot on a floor or on water has xx, yy, zz and x, y. Leave out "
                "the others."
            )
        if len(self.event_cameras) > 2:
            raise ValueError("'event_cameras' has more than two; a rate is estimated from one or two.")
        if self.morphology is not None:
            self.morphology.check_part_of(self.actuators)
        if self.air_bearing and not self.drifts:
            raise ValueError("'air_bearing' is for robots on the floor with thrusters or fans; leave it out.")
        if self.limits.yaw_rate >= self.sensors.imu.gyroscope_range:
            raise ValueError(
                f"'limits.yaw_rate' = {self.limits.yaw_rate:g} rad/s must be below the gyroscope's range, "
                f"{self.sensors.imu.gyroscope_range:g} rad/s: a faster tumble would look like that, and pass the gates."
            )
        late_s = self.actuators.response.latest_s
        if self.actuators.response.opening_delay_s > 0.0 and self.timing.is_over_within(late_s):
            raise ValueError(
                f"'delay_s' and 'opening_delay_s' add up to {late_s:g} s; at most one control step, "
                f"{self.timing.control_s:g} s."
            )
        gains = self.actuators.response.gain
        if gains and len(gains) != len(self.actuators.names):
            raise ValueError(f"'gain' needs {len(self.actuators.names)} values, one for each actuator.")


def _check_pushed(robot: Robot) -> None:
    can = robot.performance
    if min(can.force, can.top_speed, can.speed, can.turning_acceleration) <= 0.0:
        raise ValueError(
            "force, top_speed, speed, turning_acceleration of 'performance' must be greater than 0."
        )
    if (robot.airframe is None) is not robot.kind.stays:
        raise ValueError(_WINGS)
    if robot.actuators.tank is not None:
        robot.actuators.tank.check_part_of(robot.body.mass)


def _check_rolling(robot: Robot) -> None:
    _check_pushed(robot)
    track = robot.actuated_by(Rolling).track
    if track > 2.0 * robot.body.radius:
        raise ValueError(
            f"'track' = {track:g} m puts the wheels outside of the outline: at most {2.0 * robot.body.radius:g} m, two "
            "'radius'."
        )
    if robot.hydrodynamics is not None:
        raise ValueError("'hydrodynamics' and wheels exclude one another.")


def _check_satellite(robot: Robot) -> None:
    can = robot.performance
    moves = max(can.force, can.top_speed, can.speed, can.turning_acceleration) > 0.0
    if robot.body.planar or moves or any(robot.body.com) or robot.airframe is not None:
        raise ValueError(
            f"{robot.actuators.kind} only turn a body: it needs 'planar: false', its centre of mass at its origin, no "
            "'airframe', and in 'performance' 0 for all but torque and yaw_rate."
        )
    robot.actuated_by(ReactionWheels).check_carried(robot.body.inertia[:3], any_moments=robot.body.as_printed)


def _check_aircraft(robot: Robot) -> None:
    _check_pushed(robot)
    if robot.body.planar or any(robot.body.com):
        raise ValueError(_WINGS)


_WINGS = (
    "control_surfaces and 'airframe' need one another, with 'planar: false' and the centre of mass at the body's "
    "origin."
)
_CHECKS = {"rolling": _check_rolling, "satellite": _check_satellite, "aircraft": _check_aircraft}
