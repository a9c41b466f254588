"""ROS parameters of a plant node, and the first episode that they describe."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.dynamics.by_kind import begin_of
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.geofence import NO_AREA, check_area
from fulmar_core.safety.watchdog import checked_timeout
from fulmar_core.simulation.episode import Episode, draw_episode
from fulmar_core.tasks import load_task
from fulmar_core.wires.origin import HERE, check_origin
from fulmar_core.wires.silence import default_timeout
from fulmar_core.worlds.scenario import load_scenario

MOST_MOCAP_HZ = 1000.0  # the fastest cameras; a plant could not publish more often in real time [Hz]
BY_RATE = -1.0  # stands for a value that follows from the control rate


@dataclass(frozen=True)
class PlantSettings:
    """ROS parameters of a plant node."""

    robot: str = "floating_platform"
    task: str = "go_to_position"  # what the robot is to do: it may bring obstacles, or something to push
    thing: str = ""  # in space, in the place of that of the task; empty: as the task has it
    backend: str = "mujoco"
    scenario: str = "nominal"
    seed: int = 0
    # x [m], y [m], heading [deg]; in space x, y, z [m], and roll, pitch, yaw [deg] unless they are 0
    start: tuple[float, ...] = (0.0, 0.0, 0.0)
    control_hz: float = 0.0  # 0: the robot's own [Hz]
    lockstep: bool = False
    rate: float = 1.0  # simulated seconds a wall-clock second, where not in lock step
    duration_s: float = 0.0  # simulated time after which the plant stops; 0: never [s]
    command_timeout_s: float = BY_RATE  # 0 switches the watchdog off
    answer_timeout_s: float = 5.0  # longest wait for a controller in lock step [s]
    wait_for_subscribers: int = 0  # of odom, an estimator's inputs or periods, before the first step
    estimated: bool = False  # publish mocap/pose in the place of odom: an estimator makes odom of it
    captured: bool = True  # where `estimated`: poses of motion capture take the odometry's place
    truth_in_period: bool = (
        False  # in lock step: simulated cameras between plant and controller wait for the truth
    )
    mocap_hz: float = 0.0  # publish mocap/pose so often, also beside odom; 0: at every tick in its place [Hz]
    mocap_late_s: float = 0.0  # by which a pose is stamped and sent after its capture [s]
    chain: tuple[str, ...] = ("",)  # nodes between plant and controller that answer each period of lock step
    transforms: bool = (
        True  # publish /tf and /tf_static, where tf2_msgs is installed; off where another node does
    )
    estop: bool = False  # nothing moves before a message of an e-stop
    # Of the system that the plant is part of, for `robot_info`: the plant does nothing with them.
    controller: str = ""  # that was started with it; empty: not known
    fallback: str = ""  # law that takes over by itself; empty: none
    bundle: bool = False  # a policy is shipped for robot and task, or was given
    emulated: bool = False  # an emulator stands in for the device
    origin: tuple[float, ...] = HERE  # where `odom` lies in `map`, as in `origin.FORMS` [m, deg]
    area: tuple[float, ...] = NO_AREA  # that the controller keeps the robot in [m]
    clock: bool = True  # publish /clock, where no other node does; off where the fleet's node does
    fleet: bool = False  # listen to the e-stop of a fleet, too
    neighbours: bool = False  # publish where the other robots of the fleet are
    autostart: bool = True

    def __post_init__(self) -> None:
        """Refuse values without meaning."""
        if len(self.start) not in (3, 6) or not all(math.isfinite(value) for value in self.start):
            raise ValueError(
                f"start = {list(self.start)} must be three finite numbers: x [m], y [m], heading [deg]; "
                "or six in space: x, y, z [m], roll, pitch, yaw [deg]."
            )
        for name in (
            "control_hz", "rate", "duration_s", "command_timeout_s", "answer_timeout_s", "mocap_hz", "mocap_late_s",
        ):  # fmt: skip
            if not math.isfinite(getattr(self, name)):
                raise ValueError(f"{name} = {getattr(self, name)} must be a finite number.")
        if self.rate <= 0.0:
            raise ValueError(f"rate = {self.rate:g} must be greater than 0.")
        if min(self.mocap_hz, self.mocap_late_s) < 0.0:
            raise ValueError("mocap_hz and mocap_late_s must not be negative.")
        if self.mocap_hz > MOST_MOCAP_HZ:
            raise ValueError(f"mocap_hz = {self.mocap_hz:g} Hz must be at most {MOST_MOCAP_HZ:g} Hz.")
        if self.estimated and self.lockstep and not self.between:
            raise ValueError(
                "in lock step, the nodes that make odometry of poses must be named: give 'chain', such as [estimator]."
            )
        check_origin(self.origin)
        if self.area != NO_AREA:
            check_area(self.area)
        if self.seed < 0:
            raise ValueError(f"seed = {self.seed} must not be negative.")

    @property
    def publishes_odometry(self) -> bool:
        """Whether this plant says where it is, rather than an estimator or somebody else."""
        return not self.estimated

    @property
    def between(self) -> tuple[str, ...]:
        """Nodes that take part in lock step between plant and controller."""
        return tuple(name for name in self.chain if name) if self.lockstep else ()

    def control_rate(self, robot: Robot) -> float:
        """Command rate [Hz]."""
        return self.control_hz or robot.timing.control_hz

    def timeout_s(self, robot: Robot) -> float:
        """Silence after which actuators go to their safe state, in wall-clock time [s]."""
        if self.command_timeout_s != BY_RATE:
            return checked_timeout(self.command_timeout_s)
        # Simulated slower than life, commands come later than any clock on a real robot would allow.
        return default_timeout(1.0 / self.control_rate(robot)) / min(self.rate, 1.0)


def first_episode(robot: Robot, settings: PlantSettings) -> Episode:
    """The seed's episode, begun where the parameters say: at rest, or, of an aircraft, in level flight through its air.

    Raises:
        ConfigError: A name is unknown, a file is wrong, the task is of the other space, or six numbers are the start
            of a robot in the plane.
    """
    task, scenario, form = (
        load_task(settings.task, settings.thing),
        load_scenario(settings.scenario),
        robot.state_type,
    )
    if len(settings.start) > len(form.NUMBERS):
        raise ConfigError(
            f"start = {list(settings.start)}: robot '{robot.name}' moves in {form.WORLD}, where a start is "
            f"{', '.join(form.NUMBERS)} [m, deg]."
        )
    if task.state_type is not form:
        task.check(robot)
    episode = draw_episode(robot, task, scenario, seed=settings.seed, number=0)
    pose, begin = np.asarray(form.target_at(settings.start)), begin_of(robot)
    worlds = episode.world.mapped(lambda part: np.asarray(part)[..., None])
    starts, commands = begin.in_world(robot, begin.at(robot, pose)[None], worlds)
    return Episode(starts[0], episode.goal, episode.world, commands[0])
