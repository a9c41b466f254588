"""Run record and attachments of a bag: the plan, and the files that made the run."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fulmar_bringup.camera_row import CAMERA
from fulmar_bringup.goal_plan import is_endless, shown_path
from fulmar_bringup.node_table import OPTIONS, USUALLY_ON
from fulmar_bringup.system import System
from fulmar_core.config.paths import config_path
from fulmar_core.config.provenance import fulmar_version, git_revision
from fulmar_core.controllers.classical import gains_of, gains_path
from fulmar_core.estimators.kinds import estimator_path
from fulmar_core.loop.policy_bundle import PASSPORT
from fulmar_core.robots.calibration import calibration_path
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.own_sensor import own_sensor_source
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal_files import goal_file_path, load_goals
from fulmar_core.tasks.own_task import OwnTask
from fulmar_core.worlds.scenario import scenario_path
from policy_server.controllers import controller_entry, shipped_policy

if TYPE_CHECKING:
    from fulmar_bringup.run_plan import RunPlan

CALIBRATION = "calibration.yaml"  # name of the attachment
# Fields of a plan that its bag does not name: how it was launched, and what the bag itself holds.
NOT_KEPT = (
    "supervised",
    "intercepted",
    "mission",
    "start_drawn",
    "standing",
    "end_on_estop",
    "extras",
    "record",
    "recording_mode",
)


def run_info(plan: RunPlan) -> str:
    """The plan and what made it, as the JSON object that the recorder is given."""
    made_by = {"fulmar_version": fulmar_version(), "git_revision": git_revision()}
    own = {"name": plan.robot_name, "calibration": str(calibration_path() or "")}
    extras = {name: name in plan.extras for name in OPTIONS if name in (*USUALLY_ON, *plan.extras)}
    plans = {key: value for key, value in asdict(replace(plan, mission=None)).items() if key not in NOT_KEPT}
    return json.dumps(plans | extras | own | _goal_path(plan.goals) | made_by)


def _goal_path(goals: str) -> dict[str, Any]:
    """What the evaluation of a run needs to know of its goal file."""
    if not goals:
        return {}
    file = load_goals(goals)
    return {"path": shown_path(file), "endless": is_endless(file)}


def attachments(plan: RunPlan) -> str:
    """Files to attach, as the JSON object that the recorder is given: paths by name, or the content of YAML files."""
    calibration, estimator = calibration_path(), plan.guards.estimator
    files = {
        "robot.yaml": config_path("robots", plan.robot),
        **_of_task(plan.task),
        "scenario.yaml": scenario_path(plan.scenario),
        **({"thing.yaml": config_path("things", plan.thing)} if plan.thing else {}),
        **_of_goals(plan.goals or plan.excitation),
        **({"hardware.yaml": Path(plan.hardware)} if plan.hardware else {}),
        **_of_estimator(estimator),
        **_of_sensors(plan.robot),
        **({CALIBRATION: calibration} if calibration else {}),
        **_of_controller(plan),
    }
    carried = {name: str(what.absolute()) if isinstance(what, Path) else what for name, what in files.items()}
    return json.dumps({**carried, "system.yaml": asdict(effective_system(plan))})


def effective_system(plan: RunPlan) -> System:
    """The settings of a run as a file of `configs/systems`."""
    return System(
        f"{plan.robot_name}, {plan.task}, {plan.controller} on {plan.backend}, as it was run",
        *(plan.robot, plan.task, plan.controller, plan.backend),
        control_hz=plan.control_hz,
        name=plan.robot_name,
        guards=plan.guards,
        recorder=plan.recording,
        camera=CAMERA in plan.extras,
        origin=plan.origin,
    )


def _of_estimator(name: str | None) -> dict[str, Path]:
    """The file of the estimator that says where the robot is: settings, or the source of a class."""
    if not name:
        return {}
    path = estimator_path(name)
    return {f"estimator{path.suffix}": path}


def _of_sensors(robot: str) -> dict[str, Path]:
    """The sources of a robot's sensors of the user's own, by the names of the sensors."""
    return {
        f"sensor_{name}.py": own_sensor_source(spec) for name, spec in load_robot(robot).sensors.own.items()
    }


def _of_goals(goals: str) -> dict[str, Path]:
    """The goal file, by its name or its path; none where it is empty."""
    if not goals:
        return {}
    return {"goals.yaml": goal_file_path(goals)}


def _of_task(name: str) -> dict[str, Path]:
    """The file of a task; of a user's own class, its module."""
    task = load_task(name)
    return (
        {"task.py": task.source} if isinstance(task, OwnTask) else {"task.yaml": config_path("tasks", name)}
    )


def _of_controller(plan: RunPlan) -> dict[str, Path | dict[str, Any]]:
    """The passport of a policy, which has the hash of its weights, or the gains of a law."""
    entry = controller_entry(plan.controller)
    if entry.is_law:
        robot, law = load_robot(plan.robot), plan.controller
        return {"controller.yaml": gains_path(robot, law) or asdict(gains_of(robot, law))}
    if not entry.runs_bundle:
        return {}
    folder = Path(plan.policy) if plan.policy else shipped_policy(plan.robot, plan.task)
    return {"passport.json": folder / PASSPORT} if folder else {}
