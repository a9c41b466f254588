"""Policies that are not what they say, at the start of a controller, or offered to one that acts."""

from __future__ import annotations

import shutil
import time
from dataclasses import replace
from pathlib import Path

from std_msgs.msg import String

from fulmar_core.config.errors import RunFailed
from fulmar_core.loop.policy_bundle import NETWORK, Passport, read_golden, read_passport, write_bundle
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import SWAP
from fulmar_evaluation.faults.fault import STAYS_S, Fault, Outcome, went_on
from fulmar_evaluation.faults.fault_environment import FaultEnvironment, task_of
from fulmar_evaluation.faults.live_system import LiveSystem
from fulmar_evaluation.faults.observer import wait_for
from fulmar_ros.qos import publisher_qos
from policy_server.controllers import shipped_policy

ANSWER_S = 15.0  # to load a network on a busy machine
GOES_ON_S = 1.0


def flip_a_byte(bundle: Path) -> None:
    """A byte of the network is another than its hash says."""
    path = bundle / NETWORK
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(bytes(data))


def swap_to_the_same_policy(live: LiveSystem) -> Outcome:
    """A copy of the bundle that runs takes over, without a pause."""
    return _offer(live, _copy(live), wanted="done")


def swap_to_a_wrong_hash(live: LiveSystem) -> Outcome:
    """A byte of the network is another."""
    folder = _copy(live)
    flip_a_byte(folder)
    return _offer(live, folder, wanted="refused")


def swap_to_another_robot(live: LiveSystem) -> Outcome:
    """The passport names another robot, with hashes that fit."""
    other = "jetbot" if live.plan.robot != "jetbot" else "turtlebot2"
    return _offer(live, _resealed(live, robot=other), wanted="refused")


def swap_to_another_rate(live: LiveSystem) -> Outcome:
    """Trained at twice the rate."""
    return _offer(live, _resealed(live, control_hz=2.0 * live.plan.control_hz), wanted="refused")


def swap_to_another_shape(live: LiveSystem) -> Outcome:
    """It sees one thing less than its network takes."""
    names = _passport(live).observation_names[:-1]
    return _offer(live, _resealed(live, observation_names=names), wanted="refused")


def bundle_refused(live: LiveSystem) -> Outcome:
    """The bundle is damaged and nothing stands in for it: its node ends, and nothing ever moves."""
    began_s = time.monotonic()
    try:
        live.begin()
    except RunFailed:
        time.sleep(STAYS_S)
        ended = live.failure.startswith("controller ended with")
        stands = not any(moves for _, moves in live.observer.applied_since(began_s))
        reaction = live.said("[controller]", live.plan.policy).partition("]: ")[2]
        who = "controller" if ended else ""
        words = reaction.replace(live.plan.policy, "the bundle") or live.failure
        return Outcome(who, words, ended and stands, 0.0 if stands else None, limit_s=0.0)
    return Outcome("", "the controller took the bundle", False)


def bundle_refused_with_fallback(live: LiveSystem) -> Outcome:
    """The bundle is damaged and a classical controller stands in for it: it drives, and says why."""
    since_s = live.until_it_moves()
    time.sleep(STAYS_S)
    statuses = [status for status in live.observer.statuses_since(since_s) if status.who == "controller"]
    why = statuses[-1].values.get("fell_back", "") if statuses else ""
    reaction = why.replace(live.plan.policy, "the bundle")
    return went_on(
        live, since_s, detected_by="controller" if why else "", reaction=reaction, correct=bool(why)
    )


def _without_policy(robot: Robot) -> str:
    shipped = shipped_policy(robot.name, task_of(robot).name)
    return "" if shipped else f"no policy is shipped for '{robot.name}'"


POLICY_FAULTS = (
    Fault(bundle_refused, FaultEnvironment(bundle=flip_a_byte), begins=False),
    Fault(bundle_refused_with_fallback, FaultEnvironment(fallback="classical", bundle=flip_a_byte)),
    Fault(swap_to_the_same_policy, why_not=_without_policy),
    Fault(swap_to_a_wrong_hash, why_not=_without_policy),
    Fault(swap_to_another_robot, why_not=_without_policy),
    Fault(swap_to_another_rate, why_not=_without_policy),
    Fault(swap_to_another_shape, why_not=_without_policy),
)


def _passport(live: LiveSystem) -> Passport:
    return read_passport(Path(live.plan.policy))


def _copy(live: LiveSystem) -> Path:
    return Path(shutil.copytree(live.plan.policy, live.record.parent / "offered"))


def _resealed(live: LiveSystem, **changes: object) -> Path:
    """A copy whose passport says something else, and whose hashes fit."""
    folder, old = _copy(live), Path(live.plan.policy)
    passport = replace(_passport(live), **changes)  # type: ignore[arg-type]
    write_bundle(folder, (old / NETWORK).read_bytes(), read_golden(old), passport)
    return folder


def _offer(live: LiveSystem, folder: Path, *, wanted: str) -> Outcome:
    with live.stranger() as node:
        publisher = node.create_publisher(String, SWAP.name, publisher_qos(SWAP))
        wait_for(lambda: publisher.get_subscription_count() > 0, ANSWER_S)
        since_s = live.until_it_moves()
        publisher.publish(String(data=str(folder)))

        def answer() -> str:
            answers = [status.values.get("swap", "") for status in live.observer.statuses_since(since_s)]
            return next((text for text in reversed(answers) if str(folder) in text), "")

        reported = wait_for(lambda: answer().startswith(("done", "refused")), ANSWER_S)
        time.sleep(GOES_ON_S)
    reaction = answer().replace(str(folder), "the bundle")
    return went_on(
        live,
        since_s,
        detected_by="controller" if reported else "",
        reaction=reaction,
        correct=reaction.startswith(wanted),
    )
