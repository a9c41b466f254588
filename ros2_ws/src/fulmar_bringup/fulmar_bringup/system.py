"""What one can start: a robot, a task, a controller and a backend, as read from `configs/systems`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from fulmar_core.config import load_config
from fulmar_core.controllers.classical import LAWS, check_pair, default_gains_note, load_classical, load_lqr
from fulmar_core.controllers.controller import Controller
from fulmar_core.controllers.excite import TASKS as EXCITE_TASKS
from fulmar_core.controllers.excite import Excite
from fulmar_core.errors import ConfigError, UnknownNameError, did_you_mean
from fulmar_core.paths import config_names, config_path
from fulmar_core.recording import Recording
from fulmar_core.robot import Robot, load_robot
from fulmar_core.safety.area import NO_AREA, check_area
from fulmar_core.tasks import Task, load_task
from hardware_drivers.settings import hardware_of, hardware_path, load_hardware


def _load_policy(robot: Robot, task: Task, control_hz: float, policy: str) -> Controller:
    from policy_server.policy import Policy

    return Policy(Path(policy), robot, task, control_hz=control_hz)


def _load_planner(robot: Robot, task: Task, control_hz: float, policy: str) -> Controller:
    from policy_server.planning.loading import load_planner

    return load_planner(robot, task, Path(policy), control_hz=control_hz)


def _check_planner(robot: Robot, task: Task) -> None:
    from policy_server.planning.loading import check_planner

    check_planner(robot, task)


def _load_lqr(robot: Robot, task: Task, control_hz: float, _policy: str) -> Controller:
    return load_lqr(robot, task, control_hz=control_hz)


def _load_mpc(robot: Robot, task: Task, control_hz: float, _policy: str) -> Controller:
    return load_classical(robot, task, control_hz=control_hz, law="mpc")


def _load_lqr_drift(robot: Robot, task: Task, control_hz: float, _policy: str) -> Controller:
    return load_classical(robot, task, control_hz=control_hz, law="lqr_drift")


def _load_classical(robot: Robot, task: Task, control_hz: float, _policy: str) -> Controller:
    return load_classical(robot, task, control_hz=control_hz)


def _load_excite(robot: Robot, task: Task, control_hz: float, _policy: str) -> Controller:
    return Excite(robot, task, control_hz=control_hz)


def _check_lqr(robot: Robot, task: Task) -> None:
    check_pair(robot, task, law="lqr")


def _check_mpc(robot: Robot, task: Task) -> None:
    check_pair(robot, task, law="mpc")


def _check_lqr_drift(robot: Robot, task: Task) -> None:
    check_pair(robot, task, law="lqr_drift")


def _check_excite(robot: Robot, task: Task) -> None:
    if task.kind not in EXCITE_TASKS:
        raise ConfigError(
            f"controller 'excite' stays around one place, '{task.name}' has none. "
            f"Use --task with one of: {', '.join(EXCITE_TASKS)}."
        )


def _any_pair(robot: Robot, task: Task) -> None:
    """A bundle says itself what it was made for."""


@dataclass(frozen=True)
class ControllerEntry:
    """One line of the table of controllers."""

    title: str
    node: str  # script and module in policy_server
    load: Callable[[Robot, Task, float, str], Controller]  # with the command rate and the folder of a bundle
    check: Callable[[Robot, Task], None]  # refuses a robot and a task that it has nothing for
    needs: tuple[str, ...] = ()  # modules that an extra brings
    strives: bool = True  # whether it means to meet the goal
    runs_bundle: bool = False  # whether a learned policy drives, or helps
    together: int | None = None  # episodes that a batch has at once at most, where each takes seconds


_LAWS = ", ".join(f"{entry.law.title} ({family})" for family, entry in LAWS.items())
CONTROLLERS = {
    "policy": ControllerEntry(
        "a learned policy bundle",
        "policy_node",
        _load_policy,
        _any_pair,
        ("onnxruntime",),
        runs_bundle=True,
    ),
    "planner": ControllerEntry(
        "a learned policy whose drive of the whole course optimal control makes quicker (boats)",
        "planner_node",
        _load_planner,
        _check_planner,
        ("onnxruntime", "casadi"),
        runs_bundle=True,
        together=32,
    ),
    "lqr": ControllerEntry(
        "linear-quadratic regulator with valve allocation", "lqr_node", _load_lqr, _check_lqr
    ),
    "mpc": ControllerEntry(
        "predictive control that tries combinations of valves", "mpc_node", _load_mpc, _check_mpc
    ),
    "lqr_drift": ControllerEntry(
        "the published LQR of DRIFT, to compare with", "lqr_drift_node", _load_lqr_drift, _check_lqr_drift
    ),
    "classical": ControllerEntry(
        f"the law of the robot's family: {_LAWS}", "classical_node", _load_classical, check_pair
    ),
    "excite": ControllerEntry(Excite.title, "excite_node", _load_excite, _check_excite, strives=False),
}
FALLBACKS = tuple(name for name, entry in CONTROLLERS.items() if not entry.runs_bundle)
SIMULATED = ("mujoco", "mock")
BACKENDS = (*SIMULATED, "hardware")


@dataclass(frozen=True)
class Guards:
    """What watches over a system, and what feeds it, beside what every system has."""

    estimator: str | None = (
        None  # file of configs/estimators: odometry comes from poses and inertial readings
    )
    estop: bool = False  # an e-stop node runs, and nothing moves without it
    fallback: str | None = None  # classical controller that takes over from a policy that is refused
    trusted_keys: str | None = None  # file or folder of public keys: only bundles that one of them has signed
    max_run_time_s: float = 0.0  # 0: none [s]
    area: tuple[float, float, float, float] = NO_AREA  # x_min, x_max, y_min, y_max [m]

    def __post_init__(self) -> None:
        """Refuse what has no meaning."""
        if self.fallback is not None and self.fallback not in FALLBACKS:
            raise ValueError(
                f"'fallback' = '{self.fallback}' is not known.{did_you_mean(self.fallback, FALLBACKS)}"
            )
        if self.trusted_keys is not None and not self.trusted_keys.strip():
            raise ValueError(
                "'trusted_keys' is empty: name a file or a folder, or leave it out, and any bundle runs."
            )
        if self.max_run_time_s < 0.0:
            raise ValueError(f"'max_run_time_s' = {self.max_run_time_s:g} must not be negative.")
        if self.area != NO_AREA:
            check_area(self.area)


NONE = Guards()
DEFAULT_ESTIMATOR = "mocap_imu"


@dataclass(frozen=True)
class System:
    """One file of `configs/systems`."""

    title: str
    robot: str
    task: str
    controller: str
    backend: str
    control_hz: float  # [Hz]
    guards: Guards = NONE
    recorder: Recording = Recording()

    def __post_init__(self) -> None:
        """Refuse a rate that nothing could run at."""
        if self.control_hz <= 0.0:
            raise ValueError(f"control_hz = {self.control_hz:g} must be greater than 0.")


def load_system(name: str) -> System:
    """Read `configs/systems/<name>.yaml` and check that everything it names exists.

    Raises:
        ConfigError: Unknown name, or a mistake in the file.
    """
    system = load_config(System, config_path("systems", name))
    check_names(system.robot, system.task, system.controller, system.backend)
    return system


def modules_of(
    controller: str, backend: str, *, guards: Guards = NONE, hardware: str = "", emulated: bool = False
) -> tuple[str, ...]:
    """Modules of extras that the nodes of a controller, a backend, its guards and a hardware file import."""
    simulated = ("mujoco",) if backend == "mujoco" or emulated else ()
    driven = load_hardware(hardware).needs if hardware else ()
    estimated = ("filterpy",) if guards.estimator else ()
    return (*CONTROLLERS[controller].needs, *simulated, *driven, *estimated)


def system_of(controller: str, backend: str) -> System | None:
    """The system file for a controller on a backend, or None."""
    name = f"{backend}_{controller}"
    return load_system(name) if name in config_names("systems") else None


def check_names(robot: str, task: str, controller: str, backend: str) -> None:
    """Refuse unknown names, and controllers and backends that do not exist for a robot and a task.

    Raises:
        ConfigError: On the first wrong one.
    """
    the_robot, the_task = load_robot(robot), load_task(task)
    if controller not in CONTROLLERS:
        raise UnknownNameError("controller", controller, CONTROLLERS)
    CONTROLLERS[controller].check(the_robot, the_task)
    if backend not in BACKENDS:
        raise UnknownNameError("backend", backend, BACKENDS)
    if backend == "hardware":
        default_hardware(robot)


def gains_note(robot: str, controller: str | None) -> str:
    """What to say where a law drives a robot with default gains; empty where none does.

    Args:
        robot: The robot.
        controller: Name of a controller; None where there is none.

    Raises:
        ConfigError: As of `gains_of`.
    """
    if controller is None or CONTROLLERS[controller].runs_bundle or not CONTROLLERS[controller].strives:
        return ""
    return default_gains_note(load_robot(robot), controller)


def default_hardware(robot: str, asked: str | None = None) -> str:
    """The hardware file to use, as a path.

    Args:
        robot: The robot.
        asked: A name of `configs/hardware`, or a path that ends in `.yaml`; by default the robot's own file.

    Raises:
        ConfigError: There is none, it has a mistake, or it is of another robot.
    """
    if asked is not None:
        found = load_hardware(asked).robot
        if found != robot:
            raise ConfigError(f"{asked} is the hardware of '{found}', and the robot is '{robot}'.")
        return str(hardware_path(asked).absolute())
    mine = hardware_of(robot)
    if not mine:
        known = ", ".join(sorted({load_hardware(name).robot for name in config_names("hardware")}))
        raise ConfigError(
            f"there is no hardware driver for '{robot}' (there is one for: {known}). Use --backend mujoco or mock."
        )
    return str(hardware_path(mine[0]).absolute())


def default_control_hz(robot: str, task: str, controller: str, backend: str) -> float:
    """Command rate of the matching system file, else the robot's own [Hz]."""
    system = system_of(controller, backend)
    if system is not None and (system.robot, system.task) == (robot, task):
        return system.control_hz
    return load_robot(robot).timing.control_hz


def default_guards(controller: str, backend: str, hardware: str = "") -> Guards:
    """Guards of the matching system file; where there is none, nothing in simulation, and on hardware an e-stop.

    Where motion capture alone knows where a robot is, an estimator makes odometry of it.

    Args:
        controller: Name of the controller.
        backend: Name of the backend.
        hardware: Hardware file, where the backend is hardware.
    """
    system = system_of(controller, backend)
    if system is not None:
        return system.guards
    if backend != "hardware":
        return NONE
    seen = load_hardware(hardware).seen_from_outside
    return Guards(estop=True, estimator=DEFAULT_ESTIMATOR if seen else None)
