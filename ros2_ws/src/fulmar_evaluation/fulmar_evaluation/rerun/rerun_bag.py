"""A bag re-run by a controller, and what differs from the record."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fulmar_bags.comparison import as_json, first_difference
from fulmar_bags.contents import Bag
from fulmar_bags.control_steps import ControlSteps, control_steps_of, policy_folder
from fulmar_bags.envelope_events import envelope_events
from fulmar_bags.figures import controllers_of
from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.config.own_class import is_own
from fulmar_core.tasks.goal import PoseTuple
from fulmar_evaluation.rerun.embedded_configs import calibrated_as, knowing_what_it_carries
from fulmar_evaluation.rerun.replay_controllers import answers_of
from fulmar_evaluation.rerun.rerun import FROM
from fulmar_evaluation.rerun.rerun_result import (
    check_answers_file,
    compare_answers,
    compare_trips,
    pauses,
    sums,
    write_answers,
)
from policy_server.controllers import controller_entry, shipped_policy

THROUGH = ("direct", "node")


@dataclass(frozen=True)
class RerunRequest:
    """Which controller re-runs a bag, and how; None where the bag decides."""

    controller: str | None
    policy: Path | None
    source: str  # one of `FROM`
    through: str  # one of `THROUGH`
    robot: str | None
    task: str | None
    goal: PoseTuple | None  # as `State.NUMBERS` of the robot [m, deg]
    control_hz: float | None  # [Hz]
    odometry: str | None  # topic
    out: Path | None  # file for the answers

    def __post_init__(self) -> None:
        """Reject unknown names, before a bag is opened."""
        for what, given, known in (("--from", self.source, FROM), ("--through", self.through, THROUGH)):
            if given not in known:
                raise UnknownNameError(what, given, known)
        if self.out is not None:
            check_answers_file(self.out)

    def check(self, *, foreign: bool) -> None:
        """Reject options without effect on a bag, `foreign` if another program recorded it.

        Raises:
            ConfigError: On the first one.
        """
        fed = self.source == "observations" and self.through == "direct" and not foreign
        for option, value in (("--goal", self.goal), ("--odometry", self.odometry)):
            if fed and value is not None:
                raise ConfigError(
                    f"{option} changes nothing where observations are fed. Add --from odometry."
                )


def rerun_bag(
    bag: Bag,
    request: RerunRequest,
    tolerances: Mapping[str, float],
    warn: Callable[[Iterable[str]], None],
) -> dict[str, Any]:
    """Re-run a bag and compare every field.

    Args:
        bag: The bag.
        request: Checked.
        tolerances: Of each field.
        warn: Receives warnings at once, so that they stand before an error that they explain.

    Returns:
        The result, ready for JSON; beside it `sums`, a line for each kind of field.

    Raises:
        FulmarError: The bag lacks what is needed, or the controller cannot be loaded.
    """
    began = time.monotonic()
    source = "odometry" if bag.info is None else request.source
    with knowing_what_it_carries(bag), calibrated_as(bag):
        record = control_steps_of(
            bag,
            robot=request.robot,
            task=request.task,
            goal=request.goal,
            control_hz=request.control_hz,
            odometry=request.odometry,
        )
        warn(record.warnings)
        name, folder = _chosen(bag, record, request, warn)
        if request.through == "node":
            from fulmar_evaluation.rerun.live_node import rerun_through_node, without_repeats

            record = without_repeats(record)
            answers, sha256 = rerun_through_node(bag, record, name, folder, request.odometry)
        else:
            follow = request.policy is None and name == (bag.info or {}).get("controller")
            if record.changes and not follow:
                warn(["the run changed its controller on the way; here one controller re-runs all of it"])
            answers, sha256 = answers_of(record, name, folder, source, follow=follow)
    fields = compare_answers(record, answers, tolerances)
    first = first_difference(fields)
    recorded = [each.get("sha256") for each in controllers_of(bag)]
    if request.out is not None:
        write_answers(record, answers, request.out)
    compared = bool(fields) and record.answered
    trips = compare_trips(envelope_events(bag), answers)
    return {
        "robot": record.robot.name,
        "task": record.task.name,
        "controller": name,
        "policy": folder or None,
        "sha256": sha256,
        "recorded_sha256": recorded[0] if recorded else None,
        "recorded_sha256s": recorded,
        "from": source,
        "through": request.through,
        "steps": len(record),
        "asked": int(answers.acted.sum()),
        "not_asked": [vars(each) for each in pauses(answers)],
        "answers": None if request.out is None else str(request.out),
        "compared": compared,
        "same": compared and first is None and (trips is None or trips["same"]),
        "trips": trips,
        "first_difference": None if first is None else as_json([first])[0],
        "fields": as_json(fields),
        "sums": [vars(each) for each in sums(fields)],
        "warnings": list(record.warnings),
        "elapsed_s": time.monotonic() - began,
    }


def _chosen(
    bag: Bag, record: ControlSteps, request: RerunRequest, warn: Callable[[Iterable[str]], None]
) -> tuple[str, str]:
    """Name of the controller, and folder of its bundle, empty where it has none."""
    policy = request.policy
    name = request.controller or ("policy" if policy else (bag.info or {}).get("controller"))
    if not isinstance(name, str):
        raise ConfigError(f"{bag.path}: the bag does not name its controller. Give --controller.")
    if is_own(name) and request.controller is None:  # a bag from elsewhere must not have its code run
        raise ConfigError(
            f"{bag.path}: its controller '{name}' is a class that only this bag names. To run it: --controller {name}."
        )
    if controller_entry(name).is_external:
        raise ConfigError(
            f"{bag.path}: an external controller drove, which is no part of Fulmar and cannot be run again. "
            "To compare another one: --controller classical --from odometry."
        )
    if not controller_entry(name).runs_bundle:
        if policy is not None:
            raise ConfigError(
                f"--policy is for --controller policy, not for '{name}'. Leave one of them out."
            )
        return name, ""
    recorded = policy_folder(bag)
    folder = policy or recorded or shipped_policy(record.robot.name, record.task.name)
    if folder is None:
        raise ConfigError(
            f"no policy is shipped for '{record.robot.name}' and '{record.task.name}'. Give one: --policy DIR."
        )
    named = (bag.info or {}).get("policy")
    if named and not policy and not recorded:
        warn([f"the recorded bundle, {named}, is gone; {folder} is used instead. Or give --policy DIR."])
    return name, str(folder)
