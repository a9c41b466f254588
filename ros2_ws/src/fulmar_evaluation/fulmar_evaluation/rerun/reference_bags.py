"""Reference bags: short lock-step runs kept with the tests, which every later version must answer the same way."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fulmar_bags.comparison import Field, first_difference
from fulmar_bags.contents import Bag, open_bag
from fulmar_bags.control_steps import control_steps_of
from fulmar_bags.decode import stamps_ns
from fulmar_bags.gathered import Topic
from fulmar_bringup.domains import own_domain
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import (
    ACTION,
    COMMAND,
    GOAL_WIRES,
    METADATA,
    OBSERVATION,
    OBSTACLES,
    ODOMETRY,
    SENSOR_WIRES,
    VELOCITY_COMMAND,
)
from fulmar_core.tasks import Task, load_task
from fulmar_evaluation.rerun.replay_controllers import answers_of
from fulmar_evaluation.rerun.rerun_result import compare_answers

STEPS = 100  # control steps of each
SEED = 11
LARGEST = 200_000  # bytes of the MCAP file
STEPPED = (ODOMETRY, COMMAND, VELOCITY_COMMAND)
MEASURED = tuple(wire for wire in SENSOR_WIRES.values() if wire != ODOMETRY)
KEPT = (*STEPPED, *MEASURED, OBSERVATION, ACTION, METADATA, OBSTACLES, *GOAL_WIRES.values())
# What a machine and a moment leave in a record, and what therefore stays out of one that is kept.
OF_THE_MACHINE = ("policy", "command", "git_revision", "fulmar_version", "goals", "path")
# Another processor adds float32 sums of a network in another order, and rounds a sine otherwise in the last bit.
# A valve that opens differs by 1.
TOLERANCES = {"decision": 0.0, "observation": 1e-9, "action": 1e-5, "command": 1e-5}


@dataclass(frozen=True)
class Reference:
    """One run to keep."""

    robot: str
    task: str
    controller: str
    guards: Mapping[str, Any] = field(default_factory=dict)
    backend: str = "mujoco"
    control_hz: float | None = None  # None: the robot's own [Hz]

    @property
    def name(self) -> str:
        """Of its bag."""
        estimator = self.guards.get("estimator", "")
        guarded = f"_{estimator}" if estimator else "_guarded" if self.guards else ""
        simulated = "" if self.backend == "mujoco" else f"_{self.backend.partition(':')[0]}"
        return f"{self.robot}_{self.task}_{self.controller}{guarded}{simulated}"


REFERENCES = (
    Reference("floating_platform", "go_to_pose", "policy"),
    Reference("floating_platform", "go_to_pose", "lqr"),
    Reference("floating_platform", "go_to_pose", "lqr", {"max_run_time_s": 15.0}),
    Reference("kingfisher", "go_to_position", "policy"),
    Reference("turtlebot2", "go_to_position", "policy"),
    Reference("modular_freeflyer", "go_to_position", "policy"),
    Reference("jetbot", "go_to_position", "policy"),
    Reference("leatherback", "go_to_position", "policy"),
    Reference("spacecraft_16", "go_to_pose_3d", "policy"),
    Reference("spacecraft_16", "go_to_pose_3d", "lqr", {"estimator": "mocap_imu_3d"}),
    Reference("cubesat_wheels", "point", "lqr", {"estimator": "attitude"}),
    Reference("airship_v7", "fly_hold", "lqi"),
    Reference("airship_v7", "fly_hold", "policy", control_hz=25.0),
    Reference("airship_v7", "fly_hold", "lqi", backend="jsbsim"),
)


def record_reference(reference: Reference, folder: Path) -> Path:
    """Run through the deployed nodes in MuJoCo, and keep what a controller received and answered.

    Args:
        reference: What to run.
        folder: Where the reference bags are; an older one of the same name is replaced.

    Raises:
        RunFailed: The run did not come to its end.
        BagError: The bag cannot be written.
    """
    with tempfile.TemporaryDirectory(prefix="fulmar_reference_") as scratch:
        new = Path(scratch) / "kept" / reference.name
        _write_kept(open_bag(run_reference(reference, Path(scratch))), new, load_task(reference.task))
        first = first_difference(check_reference(new))
        if first is not None:
            raise RunFailed(
                f"reference '{reference.name}': not answered as recorded from step {first.first_step} on "
                f"({first.field} {first.name}). Was the machine busy? Record it once more."
            )
        target = folder / reference.name
        shutil.rmtree(target, ignore_errors=True)
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copytree(new, target)
    return target


def run_reference(reference: Reference, folder: Path) -> Path:
    """Run through the deployed nodes in lock step, and return the whole bag, which lies in a folder.

    Raises:
        RunFailed: The run did not come to its end.
    """
    from fulmar_bringup.completion import completed
    from fulmar_bringup.plan_checks import checked
    from fulmar_bringup.run_plan import RunPlan
    from fulmar_bringup.system import Guards
    from fulmar_evaluation.run_outcome import run_and_evaluate

    control_hz = reference.control_hz or load_robot(reference.robot).timing.control_hz
    asked = RunPlan(
        reference.robot,
        reference.task,
        reference.controller,
        reference.backend,
        control_hz,
        duration_s=STEPS / control_hz,
        lockstep=True,
        seed=SEED,
        record=str(folder / reference.name),
        guards=Guards(**reference.guards),
    )
    plan = checked(completed(asked))
    with own_domain():
        outcome = run_and_evaluate(plan)
    if outcome.failure:
        raise RunFailed(f"reference '{reference.name}': {outcome.failure}")
    return Path(plan.record)


def _write_kept(bag: Bag, folder: Path, task: Task) -> None:
    from fulmar_bags.writer import BagWriter

    info = {key: value for key, value in (bag.info or {}).items() if key not in OF_THE_MACHINE}
    writer = BagWriter(folder, run_info=info)
    kept = (*KEPT, *(thing.wire for thing in task.things))
    topics = [(wire, bag.of(wire)) for wire in kept if len(bag.of(wire))]
    for wire, topic in topics:
        writer.add_topic(topic.name, topic.type, wire.delivery)
    # A machine that was slow to start refuses its first odometry as too old: a reference begins where it is believed.
    begin_ns = min(_stamps(bag.of(OBSERVATION)), default=0)
    every = sorted(
        (log, topic.name, index)
        for wire, topic in topics
        for index, (log, stamp) in enumerate(zip(topic.log_ns, _stamps(topic), strict=True))
        if wire not in STEPPED or stamp >= begin_ns
    )
    by_name = {topic.name: topic for _, topic in topics}
    for log, name, index in every:
        topic = by_name[name]
        writer.write(name, topic.data[index], log_ns=log, publish_ns=topic.publish_ns[index])
    writer.close()


def _stamps(topic: Topic) -> list[int]:
    found = stamps_ns(topic)
    return list(topic.log_ns) if found is None else [int(stamp) for stamp in found]


def check_reference(path: Path) -> list[Field]:
    """Run a reference bag again, from its odometry on: gates, observations, actions, commands.

    Returns:
        Every field, with where it differs.

    Raises:
        BagError: The bag cannot be read whole.
    """
    from policy_server.controllers import shipped_policy

    bag = open_bag(path)
    record = control_steps_of(bag)
    name = str((bag.info or {}).get("controller"))
    folder = shipped_policy(record.robot.name, record.task.name) if name == "policy" else None
    answers, _ = answers_of(record, name, str(folder or ""), "odometry")
    return compare_answers(record, answers, TOLERANCES)
