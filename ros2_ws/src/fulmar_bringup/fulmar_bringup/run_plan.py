"""The plan of a run or of a standing system: everything that it is started with, in five parts.

The command line, a system file, the launch file, the fault suite and benchmarks fill it; `completion.completed` adds
what they leave out, and `plan_checks.checked` refuses what cannot work.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path

from fulmar_bringup.node_spec import ENDS, RESTARTS, NodeSpec
from fulmar_bringup.system import NONE, Guards
from fulmar_core.config.recording import Recording
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.goal import Goal, PoseTuple
from fulmar_core.tasks.goal_files import load_goals
from fulmar_core.tasks.goal_words import attitude_words, number, pose_words
from fulmar_core.wires.robot_name import Frames, frames_of, namespace_of

ORIGIN = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Who:
    """A robot, what it does, and what controls it."""

    robot: str
    task: str  # empty: as goal, goal file or kind of robot ask for
    controller: str  # empty: the usual one of robot and task
    _: KW_ONLY
    name: str = ""  # what the robot is called; empty: as its type
    policy: str = ""  # folder of a bundle; empty: the shipped one

    @property
    def robot_name(self) -> str:
        """What the robot is called."""
        return self.name or self.robot

    @property
    def namespace(self) -> str:
        """Namespace of every node and topic of the robot."""
        return namespace_of(self.robot_name)

    @property
    def frames(self) -> Frames:
        """Names of the robot's frames."""
        return frames_of(self.robot_name, self.robot)


@dataclass(frozen=True)
class Where:
    """Simulator or device, and which nodes run beside it, where, with which topics."""

    backend: str
    _: KW_ONLY
    hardware: str = ""  # file of `configs/hardware`, where the backend is hardware; empty: the robot's own
    emulated: bool = False  # an emulator stands in for the device
    # Hardware file of an adapter, whose commands an external controller speaks; empty: none.
    adapter: str = ""
    adapter_topic: str = ""  # topic that it takes them from; empty: the file's
    only: str = ""  # plant or controller: the other one runs in another place; empty: both
    controller_network: str = ""  # namespace of Linux, as another computer; empty: ours
    copies: int = 1  # of each command on the wire
    nodes: tuple[NodeSpec, ...] = ()  # of the system's own, beside those that every system has
    extras: tuple[str, ...] = ()  # nodes of the table with an option that run, by name: `node_table.OPTIONS`
    remappings: tuple[tuple[str, str], ...] = ()  # topics and their other names, for every node
    # Outputs of a node that another process takes and passes on: node, topic, and what it is called instead.
    intercepted: tuple[tuple[str, str, str], ...] = ()


@dataclass(frozen=True)
class How:
    """Rates, disturbances, start, goal and length."""

    control_hz: float = 0.0  # 0: as the system file, the policy or the robot have it [Hz]
    _: KW_ONLY
    scenario: str = "nominal"
    along: str = ""  # path that the task follows, of `named_paths.NAMED`; empty: as the task has it
    thing: str = ""  # in space, of `configs/things`; empty: as the task has it
    seed: int = 0
    start: PoseTuple = ()  # as `State.NUMBERS`, or a place alone; empty: as the seed draws it [m, deg]
    # Where `odom` lies in `map`, as in `fulmar_core.wires.origin.FORMS`; empty: they are one [m, deg]
    origin: tuple[float, ...] = ()
    goal: PoseTuple | None = None  # the same; None: as the seed draws it, or not one place [m, deg]
    velocity: tuple[float, ...] = ()  # the goal of a task of velocities, as `Kind.velocity_form` [m/s, deg/s]
    height: float = (
        0.0  # above the ground, that a craft which flies holds or starts at; 0: as the task has it [m]
    )
    start_drawn: bool = False  # of a complete plan: the start was not given
    goals: str = ""  # goal file that a node of its own publishes; empty: the goal comes from outside
    excitation: str = ""  # goal file of torques that the controller plays; empty: none
    duration_s: float = 0.0  # 0: as goal file or task ask for; of a complete plan, until it is stopped [s]
    standing: bool = False  # it has no end, and goals come from outside
    lockstep: bool = False  # plant and controller wait for each other
    rate: float = 1.0  # simulated seconds a wall-clock second
    mocap_hz: float = 0.0  # simulated motion capture beside the odometry; 0: only for an estimator [Hz]
    supervised: bool = False  # the supervisor activates the plant when all are ready
    mission: Goal | None = field(default=None, compare=False)  # every target and obstacle of a complete plan


@dataclass(frozen=True)
class Guarded:
    """What keeps the robot safe."""

    _: KW_ONLY
    guards: Guards = NONE
    arm: bool = False  # an autopilot may be armed, whatever the hardware file says
    unattended: bool = False  # begun by a service: the e-stop is pressed, and nothing is armed
    end_on_estop: bool = False  # the run ends, and fails, when an e-stop stops the robot


@dataclass(frozen=True)
class Recorded:
    """What is kept of it."""

    _: KW_ONLY
    recording: Recording = Recording()
    recording_mode: str = ""  # in the place of that of `recording`; empty: that
    record: str = ""  # folder of the bag, or of all bags, which must not exist; empty: the recorder names one
    command: str = ""  # command line, for the record


@dataclass(frozen=True)
class RunPlan(Recorded, Guarded, How, Where, Who):
    """Who, where, how, guarded and recorded: the fields of all five parts."""

    @property
    def is_real(self) -> bool:
        """Whether a real robot moves."""
        return self.backend == "hardware" and not self.emulated

    @property
    def loss_of_helpers(self) -> str:
        """What the loss of a node means that takes no robot's control away; lock step does not go on without it."""
        return ENDS if self.lockstep else RESTARTS

    @property
    def asked_task(self) -> Task:
        """The task, with the thing, the path and the height that were asked for.

        Raises:
            ConfigError: As in `load_task`, or it has no such choice.
        """
        task = load_task(self.task, self.thing)
        task = task.along(self.along) if self.along else task
        return task.at_height(self.height) if self.height else task

    @property
    def line(self) -> str:
        """What a complete plan was understood as, in one line: goal, task, start, controller, surroundings, length."""
        real = "in real time" if self.rate == 1.0 else f"at {self.rate:g} times real time"
        pace = "in lock step" if self.lockstep else real
        length = f"{number(self.duration_s)} s" if self.duration_s else "until it is stopped"
        return (
            f"goal: {self._goal_words}; robot {self.robot_name}; task {self.task}; start: {self._start_words}; "
            f"controller {self.controller} at {self.control_hz:g} Hz on {self.backend}; "
            f"scenario {self.scenario}, seed {self.seed}; {pace}; {length}"
        )

    @property
    def _goal_words(self) -> str:
        task = self.asked_task
        if self.excitation:
            return f"torques of '{self.excitation}'"
        if self.goals:
            return f"'{Path(self.goals).stem}', {load_goals(self.goals).title}"
        if self.standing:
            return f"awaited on {task.goal_topic}"
        assert self.mission is not None  # as in `completed`
        return task.said(self.mission)

    @property
    def _start_words(self) -> str:
        robot = load_robot(self.robot)
        if self.is_real:
            return "where it stands"
        words = attitude_words if not robot.kind.goes_anywhere else pose_words
        drawn = f", drawn by seed {self.seed}" if self.start_drawn else ""
        return f"{words(robot.state_type, self.start)}{drawn}"
