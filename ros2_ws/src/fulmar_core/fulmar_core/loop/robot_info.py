"""What a robot is and does, as one JSON object: the content of the wire `robot_info`.

Pure functions of a robot, a task and how they were started. The plant publishes it, and readers of older bags make the
same of what a bag has attached.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import Any

from fulmar_core.config.provenance import fulmar_version
from fulmar_core.loop.controller_choices import TELEOPERATION, ControllerChoice, controller_choices
from fulmar_core.loop.teleop import resting_words
from fulmar_core.robots.actuator_parts import actuators_as_json
from fulmar_core.robots.look_of import look_as_json
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.geofence import NO_AREA
from fulmar_core.simulation.disturbances import disturbance_choices
from fulmar_core.tasks import Task
from fulmar_core.wires.origin import origin_pose
from fulmar_core.wires.robot_name import frames_of

WALL, SIMULATED = "wall", "simulated"
HARDWARE = "hardware"
FORMS = ("pose", "point", "pose3", "point3", "attitude", "velocity", "velocity3", "path", "flight")
IMAGES = ("rgb", "depth", "ids")  # of a camera
# What a person asks for by hand: name, keys up and down of a keyboard, and words.
AXES = (
    {"name": "ahead", "keys": "ws", "words": "ahead and back"},
    {"name": "left", "keys": "qe", "words": "to the left and right"},
    {"name": "turn", "keys": "ad", "words": "turn left and right"},
)


@dataclass(frozen=True)
class RobotSetup:
    """How a robot was started, as far as it is known."""

    name: str = ""  # what the robot is called; empty: as its type
    backend: str = "mujoco"
    emulated: bool = False  # an emulator stands in for the device
    scenario: str = "nominal"
    controller: str = ""  # that it was started with; empty: not known
    fallback: str = ""  # law that takes over by itself; empty: none
    bundle: bool = False  # whether a policy is shipped for robot and task, or was given
    origin: tuple[
        float, ...
    ] = ()  # where `odom` lies in `map`, as in `origin.FORMS`; empty: they are one [m, deg]
    area: tuple[float, ...] = NO_AREA  # that the robot must not leave [m]
    control_hz: float = 0.0  # 0: the robot's own [Hz]
    lockstep: bool = False
    rate: float = 1.0  # simulated seconds a wall-clock second
    started_ns: int = 0  # when the plant was started, by the wall clock [ns]
    operator: str = ""  # who drives it by hand; empty: no person does

    @property
    def simulated(self) -> bool:
        """Whether a simulator stands in for the robot."""
        return self.backend != HARDWARE


def robot_info(robot: Robot, task: Task, setup: RobotSetup) -> dict[str, Any]:
    """What a robot is and does, as values that JSON has.

    Lengths are in metres, angles in degrees where a key says so, and positions in the body's frame.

    Args:
        robot: The robot.
        task: What it does.
        setup: How both were started.

    Returns:
        The keys of docs/robot_info.md, all of them.
    """
    name = setup.name or robot.name
    frames = frames_of(name, robot.name)
    choices = controller_choices(
        robot, task, bundle=setup.bundle, fallback=setup.fallback, running=setup.controller
    )
    driven = not setup.lockstep and any(choice.name == TELEOPERATION for choice in choices)
    return {
        "name": name,
        "type": robot.name,
        "title": robot.title,
        "kind": robot.kind.name,
        "space": space_of(robot),
        "task": task.name,
        "task_title": task.title,
        "tolerance": tolerance_of(task, robot),
        "geofence": robot.limits.geofence,
        "area": [] if tuple(setup.area) == NO_AREA else list(setup.area),
        "backend": setup.backend,
        "simulated": setup.simulated,
        "emulated": setup.emulated,
        "scenario": setup.scenario,
        "controllers": [asdict(choice) for choice in _offered(choices, driven=driven)],
        "controller": setup.controller,
        "fallback": setup.fallback,
        "control_hz": setup.control_hz or robot.timing.control_hz,
        "clock": SIMULATED if setup.simulated else WALL,
        "lockstep": setup.lockstep,
        "rate": setup.rate,
        "started_ns": setup.started_ns,
        "version": fulmar_version(),
        "operator": setup.operator,
        "stops": stopping_words(robot),
        "goal": goal_info(task, robot),
        "radius": robot.body.radius,
        "height": robot.body.height,
        "actuators": actuators_as_json(robot),
        "teleop": {"axes": [dict(axis) for axis in AXES] if driven else []},
        "disturbances": disturbances_of(robot, simulated=setup.simulated),
        "camera": camera_of(robot),
        "look": look_as_json(robot),
        "structures": structures_of(task),
        "things": [thing.name for thing in task.things],
        "frames": {"map": "map", "odom": frames.odom, "base": frames.base},
        "origin": list(origin_pose(setup.origin)),
    }


def as_json(info: dict[str, Any]) -> str:
    """The text of the wire."""
    return json.dumps(info, sort_keys=True, allow_nan=False)


def _offered(choices: tuple[ControllerChoice, ...], *, driven: bool) -> list[ControllerChoice]:
    """In lock step no person drives: the plant waits for the controller."""
    return [choice for choice in choices if driven or choice.name != TELEOPERATION]


def space_of(robot: Robot) -> str:
    """Where a robot moves: plane, water, space, attitude or flight."""
    swims = robot.kind.room == "plane" and robot.hydrodynamics is not None
    return "water" if swims else robot.kind.room


def stopping_words(robot: Robot) -> str:
    """What happens when a robot is stopped, in words."""
    if robot.kind.stops:
        return robot.kind.stops
    what = resting_words(robot)
    if robot.drifts:
        return f"{what}; it keeps its velocity and its turn rate, and drifts on"
    return f"{what}; it drifts to rest"


def tolerance_of(task: Task, robot: Robot) -> dict[str, float]:
    """What counts as success, by quantity; those that do not count are left out."""
    wanted = task.fitted(robot).tolerance
    values = {
        "position_m": wanted.position,
        "heading_deg": wanted.heading_deg,
        "attitude_deg": wanted.attitude_deg,
        "velocity_m_s": wanted.velocity,
        "yaw_rate_deg_s": wanted.yaw_rate_deg,
        "rate_deg_s": wanted.rate_deg,
        "hold_s": wanted.hold_s,
    }
    return {name: value for name, value in values.items() if value > 0.0}


def goal_info(task: Task, robot: Robot) -> dict[str, Any]:
    """How goals of a task are given: topic, form, and what of a goal counts."""
    tolerance = task.tolerance
    numbers = robot.kind.velocity_form if task.goal_topic == "goal_velocity" else robot.state_type.NUMBERS
    return {
        "topic": task.goal_topic,
        "form": goal_form(task, robot),
        "subject": task.subject,
        "faces": tolerance.heading_deg + tolerance.attitude_deg > 0.0,
        "moves": task.moves,
        "required": task.required,
        "numbers": list(numbers or ("ahead",)),
        "speed": robot.performance.speed,
        "yaw_rate": robot.performance.yaw_rate,
        "reach": f"{robot.state_type.AXES}d",
    }


def goal_form(task: Task, robot: Robot) -> str:
    """How goals of a task look: one of `FORMS`."""
    in_space = "3" if robot.state_type.AXES == 3 else ""
    if task.goal_topic == "goal_velocity":
        return f"velocity{in_space}"
    if task.goal_topic == "goal_path":
        holds = task.name == robot.kind.height_task and not task.moves
        return "flight" if holds else "path"
    return f"point{in_space}" if task.goal_topic == "goal_point" else robot.kind.pose_form


def camera_of(robot: Robot) -> dict[str, Any] | None:
    """Kinds and size of a robot's images; None without a camera."""
    camera = robot.sensors.camera
    if camera is None:
        return None
    return {"kinds": list(IMAGES), "width": camera.width, "height": camera.height}


def disturbances_of(robot: Robot, *, simulated: bool) -> dict[str, Any]:
    """What can be done to a simulated robot while it runs, by name, with the fields of each request."""
    return disturbance_choices(robot) if simulated else {}


def structures_of(task: Task) -> list[dict[str, Any]]:
    """Things in space of a task's world, each with its parts and its keep-out volume."""
    return [
        {
            "name": structure.name,
            "title": structure.title,
            "half_size": structure.half_size,
            "keep_out": asdict(structure.keep_out),
            "parts": [asdict(part) for part in structure.parts],
        }
        for structure in task.structures
    ]
