"""The table of controllers: each by its name, with how it is loaded and what it is for. No ROS.

Another controller is one file in `fulmar_core/controllers`, one YAML with its gains, and one line here.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from fulmar_core.config.errors import BundleError, ConfigError, UnknownNameError
from fulmar_core.config.own_class import is_own, load_class
from fulmar_core.controllers.by_kind import LAWS, exciting
from fulmar_core.controllers.classical import check_pair, has_law, load_classical
from fulmar_core.controllers.controller import Controller
from fulmar_core.controllers.excite import Excite
from fulmar_core.loop.controller_settings import POLICY
from fulmar_core.loop.policy_bundle import PASSPORT, read_passport
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal_files import load_torques
from policy_server.own_controller import MEMBERS, OwnController

CLASSICAL = "classical"  # the law of a robot's family
EXTERNAL = "external"  # any node that publishes the robot's commands


@dataclass(frozen=True)
class Choice:
    """What a controller is loaded with, beside robot and task."""

    control_hz: float  # command rate [Hz]
    policy: str = ""  # folder of a bundle; empty: the shipped one
    trusted_keys: str = ""  # file or folder of public keys, one of which must have signed the bundle
    excitation: str = ""  # goal file of torques, for `excite` on satellites; empty: our own profile
    seed: int = 0  # of the noise that a controller draws


@dataclass(frozen=True)
class ControllerEntry:
    """One line of the table."""

    title: str
    load: Callable[[Robot, Task, Choice], Controller]
    check: Callable[[Robot, Task], None]  # raises ConfigError for a pair that it has nothing for
    needs: tuple[str, ...] = ()  # modules that an extra brings
    strives: bool = True  # whether it means to meet the goal
    runs_bundle: bool = False  # whether a learned policy drives
    draws: bool = False  # whether its commands depend on a seed
    is_law: bool = False  # whether it has gains, and may take over from a policy that is refused
    is_external: bool = False  # whether it is a node of the user's own, which Fulmar neither loads nor starts


def _load_policy(robot: Robot, task: Task, choice: Choice) -> Controller:
    from policy_server.policy import Policy

    folder = Path(choice.policy) if choice.policy else shipped_policy(robot.name, task.name)
    if folder is None:
        raise BundleError(
            f"no policy is shipped for '{robot.name}' and '{task.name}'. Set the parameter 'policy'."
        )
    trusted = Path(choice.trusted_keys) if choice.trusted_keys else None
    return Policy(folder, robot, task, control_hz=choice.control_hz, trusted=trusted)


def _any_pair(robot: Robot, task: Task) -> None:
    """Accept any pair: a bundle names its own, and what an external node is for its owner knows."""


def _load_law(law: str | None, robot: Robot, task: Task, choice: Choice) -> Controller:
    return load_classical(robot, task, control_hz=choice.control_hz, law=law, seed=choice.seed)


def _check_law(law: str | None, robot: Robot, task: Task) -> None:
    check_pair(robot, task, law=law)


def _law(title: str, law: str | None, *, draws: bool = False) -> ControllerEntry:
    return ControllerEntry(title, partial(_load_law, law), partial(_check_law, law), is_law=True, draws=draws)


def _load_excite(robot: Robot, task: Task, choice: Choice) -> Controller:
    torques: Any = load_torques(choice.excitation) if choice.excitation else None
    return exciting(robot)(robot, task, torques, control_hz=choice.control_hz)


def _check_excite(robot: Robot, task: Task) -> None:
    tasks = exciting(robot).TASKS
    if task.kind not in tasks:
        raise ConfigError(
            f"controller 'excite' stays around one place, '{task.name}' has none. "
            f"Use --task with one of: {', '.join(tasks)}."
        )


def _load_external(robot: Robot, task: Task, choice: Choice) -> Controller:
    raise ConfigError(
        f"controller '{EXTERNAL}' is a node of your own, which is not loaded here: it goes with `fulmar run`, systems "
        "and launch files. Give another controller, or a class: docs/own-controller.md."
    )


def _load_own(name: str, robot: Robot, task: Task, choice: Choice) -> Controller:
    return OwnController(name, robot, task, choice.control_hz)


def _check_own(name: str, robot: Robot, task: Task) -> None:
    load_class(name, members=MEMBERS, what="controller")


_USUAL = [next(iter(laws.values())).law.title for families in LAWS.values() for laws in families.values()]
CONTROLLERS = {
    "policy": ControllerEntry(
        "a learned policy bundle", _load_policy, _any_pair, ("onnxruntime",), runs_bundle=True
    ),
    "lqr": _law("linear-quadratic regulator with valve allocation", "lqr"),
    "lqi": _law("linear-quadratic regulator of aircraft with integral action", "lqi"),
    "mppi": _law("predictive control of aircraft by the mean of many random flights", "mppi", draws=True),
    "pid": _law("cascaded loops of aircraft", "pid"),
    "pd": _law("proportional-derivative control of bodies in space and satellites", "pd"),
    "adaptive": _law("control of a satellite's attitude with its estimated inertia", "adaptive"),
    "mpc": _law("predictive control that tries combinations of valves", "mpc"),
    "lqr_drift": _law("the published LQR of DRIFT, to compare with", "lqr_drift"),
    "classical": _law(f"the law of the robot's family: {'; '.join(dict.fromkeys(_USUAL))}", None),
    "excite": ControllerEntry(Excite.title, _load_excite, _check_excite, strives=False),
    EXTERNAL: ControllerEntry(
        "any node that publishes commands, started by you", _load_external, _any_pair, is_external=True
    ),
}
FALLBACKS = tuple(name for name, entry in CONTROLLERS.items() if entry.is_law)


def controller_entry(name: str) -> ControllerEntry:
    """The line of a controller, or one for a user's own class.

    Args:
        name: Of the table, or the dotted path of a class, `mypackage.mymodule:MyController`.

    Raises:
        UnknownNameError: There is none of this name.
    """
    if is_own(name):
        return ControllerEntry(
            "a controller of your own", partial(_load_own, name), partial(_check_own, name)
        )
    if name not in CONTROLLERS:
        raise UnknownNameError("controller", name, CONTROLLERS)
    return CONTROLLERS[name]


def load_controller(name: str, robot: Robot, task: Task, choice: Choice) -> Controller:
    """Load a controller by its name.

    Args:
        name: As in `controller_entry`.
        robot: The robot.
        task: What it does.
        choice: Rate and bundle.

    Raises:
        FulmarError: There is none of this name, or it cannot control this robot at this task.
    """
    return controller_entry(name).load(robot, task, choice)


def policies_directory() -> Path:
    """Folder of the shipped bundles."""
    return Path(__file__).resolve().parent / "policies"


def shipped_policies() -> list[Path]:
    """Every shipped bundle, sorted by name."""
    return sorted(path.parent for path in policies_directory().glob(f"*/{PASSPORT}"))


def shipped_policy(robot: str, task: str) -> Path | None:
    """The shipped bundle for a robot and a task, or None."""
    folder = policies_directory() / f"{robot}_{task}"
    return folder if (folder / PASSPORT).is_file() else None


def usual_controller(robot: Robot, task: Task, policy: str = "") -> str:
    """The controller of a pair where none is asked for: one that exists.

    Args:
        robot: The robot.
        task: What it does.
        policy: Folder of a bundle that was given; empty: none.

    Returns:
        What runs that bundle; else what the robot's file says, a shipped policy, or the law of its kind. Where there is
        none of these it is `policy`, which nothing can load.
    """
    if policy:
        return POLICY
    law = has_law(robot, task)
    if robot.usual_controller and (law or is_own(robot.usual_controller)):
        return robot.usual_controller
    if law and shipped_policy(robot.name, task.name) is None:
        return robot.kind.usual_law or CLASSICAL
    return POLICY


def usual_hz(controller: str, robot: Robot, task: Task, policy: Path | None = None) -> float:
    """Rate that a controller runs at: that of a policy's bundle, else the robot's own [Hz].

    Of a bundle that cannot be read it is the robot's; loading the bundle raises the error.

    Args:
        controller: Its name.
        robot: The robot.
        task: The task.
        policy: Bundle; the shipped one by default.
    """
    folder = policy or shipped_policy(robot.name, task.name)
    if controller_entry(controller).runs_bundle and folder is not None:
        with contextlib.suppress(BundleError):
            return read_passport(folder).control_hz
    return robot.timing.control_hz
