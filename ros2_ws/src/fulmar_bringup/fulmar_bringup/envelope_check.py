"""Whether a robot, as its file or its calibration describes it, lies inside the certified set of a bundle."""

from __future__ import annotations

from pathlib import Path

from fulmar_bringup.core_probe import alike, ends_of
from fulmar_core.config.errors import BundleError
from fulmar_core.config.paths import config_path
from fulmar_core.config.source_hash import core_sha256, robot_sha256
from fulmar_core.loop.controller_settings import ENVELOPE
from fulmar_core.loop.policy_bundle import read_passport
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot, load_robot_file
from fulmar_core.safety.certified_set import CertifiedSet, set_of_bundle
from fulmar_core.safety.declared_conditions import certified_body, declared_conditions
from fulmar_core.safety.envelope.braking import IDENTIFIED, floats
from fulmar_core.tasks import load_task
from policy_server.controllers import Choice, load_controller

HINT = "Certify it for this robot: fulmar certify"
OTHER_CORE = (
    "it was measured with another version of Fulmar's core, which moves the robot otherwise. Test it again: "
    "fulmar certify {} --again --write"
)


def envelope_problems(folder: Path, robot: Robot, task: str) -> tuple[str, ...]:
    """In words, each way in which a robot leaves the certified set of a bundle; empty where it lies inside.

    Args:
        folder: The bundle.
        robot: As identified where a calibration is used, else as declared.
        task: Name of the task.

    Raises:
        BundleError: The bundle has no certified set, or one of another robot or task.
        ConfigError: The set cannot be read.
    """
    found = set_of_bundle(read_passport(folder).envelope, robot, task, str(folder))
    changed = found.plain.get("hashes", {}).get("robot") not in ("", None, robot_sha256(found.robot))
    outside = found.outside(declared_conditions(robot, _body(found)))
    return (*outside, *([f"the file of '{found.robot}' was changed since"] if changed else []))


def late_problem(folder: Path, robot: Robot, task: str) -> str:
    """In words, that commands of a robot act later than those that the bundle was certified with; empty if not.

    Arguments and errors are those of `envelope_problems`.
    """
    found = set_of_bundle(read_passport(folder).envelope, robot, task, str(folder))
    late_s = declared_conditions(robot, _body(found))["delay"]
    outside = found.outside({"delay": late_s})
    if not outside:
        return ""
    return (
        f"policy '{folder}': commands of '{robot.name}' act {late_s:.3g} s later than those of the robot that it was "
        f"certified for: {outside[0]}. {HINT}, or make the delay shorter."
    )


def guard_note(robot: Robot, guard: str) -> str:
    """A warning where a robot may differ from its file by more than the envelope guard believes; empty where not.

    Args:
        robot: As identified where a calibration is used, else as declared.
        guard: As in `ControllerSettings`.
    """
    if guard != ENVELOPE or not floats(robot):
        return ""
    its = declared_conditions(robot, certified_body(robot))
    most = {"mass": IDENTIFIED.mass, "inertia": IDENTIFIED.inertia}
    beyond = [
        f"{name} by a factor of {its[name]:.3g}, more than {limit:g}"
        for name, limit in most.items()
        if its[name] > limit + 1e-9
    ]
    if not beyond:
        return ""
    return (
        f"guard '{ENVELOPE}' believes in a body that was identified; that of '{robot.name}' may differ from its file "
        f"in {' and in '.join(beyond)}. Identify it: fulmar identify, then --calibration FILE."
    )


def beyond_box(folder: Path, robot: Robot, task: str) -> tuple[str, ...]:
    """In words, what of a robot lies beyond the box, within which every start and disturbance is certified too.

    Arguments and errors are those of `envelope_problems`.
    """
    found = set_of_bundle(read_passport(folder).envelope, robot, task, str(folder))
    return found.beyond(declared_conditions(robot, _body(found)))


def _body(found: CertifiedSet) -> dict[str, object]:
    """The body that was certified; of a set that does not hold it, the one of the robot's file."""
    body = found.plain.get("body")
    return (
        body
        if isinstance(body, dict)
        else certified_body(load_robot_file(config_path("robots", found.robot)))
    )


def other_core(folder: Path) -> str:
    """In words, that the set of a bundle was measured with a core that moves its robot otherwise; empty if not.

    Sources that differ are no such core by themselves: the bundle then drives its robot through the episodes that the
    set has a record of, about 0.1 s, see `core_probe`.

    Raises:
        BundleError, ConfigError: The bundle cannot be loaded.
    """
    passport = read_passport(folder)
    envelope = passport.envelope or {}
    if envelope.get("hashes", {}).get("core") in ("", None, core_sha256()):
        return ""
    robot, task = load_robot(passport.robot), load_task(passport.task)
    choice = Choice(passport.control_hz, str(folder))
    ends = ends_of(load_controller("policy", robot, task, choice), robot, task)
    return "" if alike(envelope.get("probe"), ends) else OTHER_CORE.format(folder)


def envelope_note(policy: str, robot: Robot, task: str, *, required: bool) -> str:
    """A warning where a robot leaves the certified set of the bundle that drives it; empty where there is none.

    Args:
        policy: Folder of the bundle; empty for a law.
        robot: The robot.
        task: Name of the task.
        required: Whether a bundle without a set, a set of another version of the core, and a robot outside are refused.

    Raises:
        BundleError: They are refused; so is a robot that answers later than the set holds, whatever is required.
    """
    if not policy:
        if required:
            raise BundleError(
                "--require-envelope needs a policy bundle; a law has its set in a file of its own."
            )
        return ""
    folder = Path(policy)
    if not required and read_passport(folder).envelope is None:
        return ""
    late = late_problem(folder, robot, task)
    problems = envelope_problems(folder, robot, task)
    older = other_core(folder) if required else ""
    if not (late or problems):
        if older:
            raise BundleError(f"policy '{folder}': of its certified set: {older}")
        return ""
    line = f"policy '{folder}': '{robot.name}' is outside of its certified set: {'; '.join(problems)}. {HINT}"
    if late or (problems and required):
        raise BundleError(late or line)
    return line
