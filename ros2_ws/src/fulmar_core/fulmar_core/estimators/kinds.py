"""The table of estimators: what each takes and publishes, its settings, and how it is made. Knows no ROS."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from fulmar_core.config.errors import ConfigError, did_you_mean
from fulmar_core.config.own_class import is_own, source_of
from fulmar_core.config.paths import config_path
from fulmar_core.config.strict_yaml import line_of, load_config
from fulmar_core.estimators.motion.estimator import Estimator
from fulmar_core.estimators.motion.settings import (
    AttitudeSettings,
    EstimatorSettings,
    EventRateSettings,
    InertiaSettings,
    MotionSettings,
    PlanarMotionSettings,
    SpatialMotionSettings,
)
from fulmar_core.estimators.readings import READINGS, readings_of
from fulmar_core.robots.kinds import GOING
from fulmar_core.robots.kinds import KINDS as ROBOT_KINDS
from fulmar_core.robots.kinds.aircraft import AIRCRAFT
from fulmar_core.robots.kinds.kind import Kind
from fulmar_core.robots.kinds.satellite import SATELLITE
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.repetition import without_noise
from fulmar_core.robots.topics import (
    EVENTS,
    EVENTS_2,
    IMU,
    INERTIA,
    INERTIA_COVARIANCE,
    INERTIA_STATUS,
    MOCAP,
    ODOMETRY,
    RATE,
    RATE_STATUS,
    SENSOR_WIRES,
    Wire,
)
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.spatial import SpatialState

Motion = TypeVar("Motion", bound=MotionSettings)

FAR_ABOVE = 2.0  # times the noise of the settings: their poses would be outliers
DEFAULT_KIND = "planar_motion"  # of a file that names none


@dataclass(frozen=True)
class EstimatorKind:
    """One row: everything that nodes, plans and scripts need to know of a kind of estimator."""

    settings: type[EstimatorSettings]  # keys of its files
    make: Callable[[Any, Robot], Estimator]  # from such settings
    takes: Mapping[str, Wire]  # readings without which it is of no use, by name
    publishes: tuple[Wire, ...]  # each from the same estimate
    takes_if_there: Mapping[str, Wire] = field(default_factory=dict)  # readings that improve the estimate
    needs: tuple[str, ...] = ()  # modules of extras
    kinds: tuple[Kind, ...] = tuple(ROBOT_KINDS.values())  # of robots that it is for
    every_s: float = 0.0  # time between two estimates that are published, at least [s]
    status: Wire | None = None  # where its `status()` is published
    node: str = "estimator"  # name of the node that runs it

    @property
    def readings(self) -> dict[str, Wire]:
        """All that it takes, by name."""
        return {**self.takes, **self.takes_if_there}


def _fitted(settings: Motion, robot: Robot) -> Motion:
    """Settings whose poses have the noise and the delay of a robot's file, where those are above theirs."""
    odometry = robot.sensors.odometry
    turn = "heading_std" if isinstance(settings, PlanarMotionSettings) else "attitude_std"
    theirs = {"position_std": odometry.position.std, turn: odometry.heading.std}
    more = {name: std for name, std in theirs.items() if std > FAR_ABOVE * getattr(settings, name)}
    if odometry.delay_s > settings.latency_s:
        more["latency_s"] = odometry.delay_s
    return replace(settings, **more) if more else settings  # type: ignore[arg-type]


def _motion(make: Callable[..., Estimator], settings: Motion, robot: Robot) -> Estimator:
    from fulmar_core.estimators.motion.frozen import noise_of

    gyroscope_range, noise = robot.sensors.imu.gyroscope_range, noise_of(robot.sensors)
    return make(_fitted(settings, robot), robot.limits, gyroscope_range=gyroscope_range, noise=noise)


def _planar_motion(settings: PlanarMotionSettings, robot: Robot) -> Estimator:
    from fulmar_core.estimators.motion.planar_motion import PlanarMotionEstimator

    return _motion(PlanarMotionEstimator, settings, robot)


def _spatial_motion(settings: SpatialMotionSettings, robot: Robot) -> Estimator:
    from fulmar_core.estimators.motion.spatial_motion import SpatialMotionEstimator

    return _motion(partial(SpatialMotionEstimator, kind=robot.kind), settings, robot)


def _attitude(settings: AttitudeSettings, robot: Robot) -> Estimator:
    from fulmar_core.estimators.motion.attitude import AttitudeEstimator

    return AttitudeEstimator(settings, robot)


def _inertia(settings: InertiaSettings, robot: Robot) -> Estimator:
    from fulmar_core.estimators.inertia.estimator import InertiaEstimator

    return InertiaEstimator(settings, robot)


def _event_rate(settings: EventRateSettings, robot: Robot) -> Estimator:
    from fulmar_core.estimators.event_rate.estimator import EventRateEstimator

    return EventRateEstimator(settings, tuple(each.camera for each in robot.event_cameras))


KINDS: dict[str, EstimatorKind] = {
    "planar_motion": EstimatorKind(
        PlanarMotionSettings,
        _planar_motion,
        takes={"mocap": MOCAP, "imu": IMU},
        publishes=(ODOMETRY,),
        takes_if_there={"star_tracker": SENSOR_WIRES["star_tracker"]},
        kinds=GOING[PlanarState],
        needs=("filterpy",),
    ),
    "spatial_motion": EstimatorKind(
        SpatialMotionSettings,
        _spatial_motion,
        takes={"mocap": MOCAP, "imu": IMU},
        publishes=(ODOMETRY,),
        takes_if_there={"star_tracker": SENSOR_WIRES["star_tracker"]},
        kinds=(*GOING[SpatialState], AIRCRAFT),
        needs=("filterpy",),
    ),
    "attitude": EstimatorKind(
        AttitudeSettings,
        _attitude,
        takes={"star_tracker": SENSOR_WIRES["star_tracker"]},
        publishes=(ODOMETRY,),
        takes_if_there={"imu": IMU, "wheels": SENSOR_WIRES["wheels"], "rate": RATE},
        kinds=(SATELLITE,),
    ),
    "inertia": EstimatorKind(
        InertiaSettings,
        _inertia,
        takes={"imu": IMU, "wheels": SENSOR_WIRES["wheels"]},
        publishes=(INERTIA, INERTIA_COVARIANCE),
        kinds=(SATELLITE,),
        every_s=1.0,
        status=INERTIA_STATUS,
        node="inertia_estimator",
    ),
    "event_rate": EstimatorKind(
        EventRateSettings,
        _event_rate,
        takes={"events": EVENTS},
        publishes=(RATE,),
        takes_if_there={"events_2": EVENTS_2},
        kinds=(SATELLITE,),
        status=RATE_STATUS,
        node="rate_estimator",
    ),
}


def _own_kind(path: str, robot: Robot | None) -> EstimatorKind:
    """The row of a user's own estimator, which says where a robot is; without a robot, less sensors of one's own."""
    from fulmar_core.estimators.own_estimator import OwnEstimator, own_takes

    known = READINGS if robot is None else readings_of(robot)
    takes, more = (
        own_takes(path, attribute, known, strict=robot is not None)
        for attribute in ("takes", "takes_if_there")
    )
    return EstimatorKind(
        EstimatorSettings,
        lambda _settings, robot: OwnEstimator(path, robot),
        takes={name: known[name].wire for name in takes},
        publishes=(ODOMETRY,),
        takes_if_there={name: known[name].wire for name in more},
    )


def default_estimator(robot: Robot) -> str:
    """Name of the file of a robot that names no estimator."""
    return robot.kind.usual_estimator


def estimator_path(name: str) -> Path:
    """Path of `configs/estimators/<name>.yaml`; of a name that ends in `.yaml` itself; of a class its source."""
    if is_own(name):
        from fulmar_core.estimators.own_estimator import own_class

        return source_of(own_class(name))
    return Path(name) if name.endswith(".yaml") else config_path("estimators", name)


def estimator_kind(name: str, robot: Robot | None = None) -> EstimatorKind:
    """The row of an estimator's file; `name` as in `load_estimator`.

    Args:
        name: Of the file, or the dotted path of a class.
        robot: Whose sensors a class may take; without one, sensors of one's own are left out.

    Raises:
        ConfigError: No such file, kind or class, or the file is not YAML.
    """
    if is_own(name):
        return _own_kind(name, robot)
    path = estimator_path(name)
    kind = load_config(dict[str, Any], path).get("kind", DEFAULT_KIND)
    if kind not in KINDS:
        raise ConfigError(
            f"{path}:{line_of(path, ['kind'])}: unknown kind of estimator '{kind}'. "
            f"Known: {', '.join(KINDS)}.{did_you_mean(str(kind), KINDS)}"
        )
    return KINDS[kind]


def load_estimator(name: str) -> EstimatorSettings:
    """Read `configs/estimators/<name>.yaml`, or the file itself where the name ends in `.yaml`.

    A dotted path names a user's own class, whose attributes they are then.

    Raises:
        ConfigError: Unknown name or kind, or a mistake in the file.
    """
    if is_own(name):
        from fulmar_core.estimators.own_estimator import own_settings

        return own_settings(name)
    return load_config(estimator_kind(name).settings, estimator_path(name))


def check_estimator(name: str, robot: Robot) -> None:
    """Refuse a file that cannot be read, and an estimator that does not estimate how a robot moves.

    Raises:
        ConfigError: As in `load_estimator`, or the estimator is for other kinds of robots.
    """
    load_estimator(name)
    kind = estimator_kind(name, robot)
    otherwise = f"Use '{default_estimator(robot)}' of configs/estimators, or leave it out."
    robot.check_kind(f"estimator '{name}'", kind.kinds, otherwise)
    if kind.takes.get("events") and not robot.event_cameras:
        raise ConfigError(
            f"estimator '{name}' takes the events of a camera, and '{robot.name}' has none: add 'event_cameras' to its "
            "file."
        )


def make_estimator(name: str, robot: Robot, *, exact_sensors: bool = False) -> Estimator:
    """A new estimator of a robot with the settings of a file.

    Args:
        name: See `load_estimator`.
        robot: The robot; its file says which sensors have noise, so that a value that they repeat is no measurement.
        exact_sensors: Whether none has any, as in a simulation without noise.

    Raises:
        ConfigError: See `check_estimator`.
    """
    check_estimator(name, robot)
    if exact_sensors:
        robot = replace(robot, sensors=without_noise(robot.sensors))
    return estimator_kind(name).make(load_estimator(name), robot)
