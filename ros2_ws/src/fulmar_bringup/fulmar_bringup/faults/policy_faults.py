"""Policies that are not what they say, offered to a controller that acts."""

from __future__ import annotations

import shutil
import time
from dataclasses import replace
from pathlib import Path

import rclpy
from std_msgs.msg import String

from fulmar_bringup.faults.finding import Finding, went_on
from fulmar_bringup.faults.live_system import LiveSystem
from fulmar_bringup.faults.witness import wait_for
from fulmar_core.policy_bundle import NETWORK, Passport, read_golden, read_passport, write_bundle
from fulmar_core.topics import SWAP
from fulmar_ros.qos import publisher_qos

ANSWER_S = 15.0  # to load a network on a busy machine
GOES_ON_S = 1.0


def swap_to_the_same_policy(live: LiveSystem) -> Finding:
    """A copy of the bundle that runs takes over, without a pause."""
    return _offer(live, "swap_to_the_same_policy", _copy(live), wanted="done")


def swap_to_a_wrong_hash(live: LiveSystem) -> Finding:
    """A byte of the network is another."""
    folder = _copy(live)
    path = folder / NETWORK
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(bytes(data))
    return _offer(live, "swap_to_a_wrong_hash", folder, wanted="refused")


def swap_to_another_robot(live: LiveSystem) -> Finding:
    """The passport names another robot, with hashes that fit."""
    other = "jetbot" if live.plan.robot != "jetbot" else "turtlebot2"
    return _offer(live, "swap_to_another_robot", _resealed(live, robot=other), wanted="refused")


def swap_to_another_rate(live: LiveSystem) -> Finding:
    """Trained at twice the rate."""
    return _offer(
        live, "swap_to_another_rate", _resealed(live, control_hz=2.0 * live.plan.control_hz), wanted="refused"
    )


def swap_to_another_shape(live: LiveSystem) -> Finding:
    """It sees one thing less than its network takes."""
    names = _passport(live).observation_names[:-1]
    return _offer(live, "swap_to_another_shape", _resealed(live, observation_names=names), wanted="refused")


POLICY_FAULTS = (
    swap_to_the_same_policy,
    swap_to_a_wrong_hash,
    swap_to_another_robot,
    swap_to_another_rate,
    swap_to_another_shape,
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


def _offer(live: LiveSystem, name: str, folder: Path, *, wanted: str) -> Finding:
    node = rclpy.create_node("stranger", namespace=f"/{live.plan.robot}")
    try:
        publisher = node.create_publisher(String, SWAP.name, publisher_qos(SWAP))
        wait_for(lambda: publisher.get_subscription_count() > 0, ANSWER_S)
        since_s = live.until_it_moves()
        publisher.publish(String(data=str(folder)))

        def said() -> str:
            answers = [word.values.get("swap", "") for word in live.witness.words_since(since_s)]
            return next((text for text in reversed(answers) if str(folder) in text), "")

        told = wait_for(lambda: said().startswith(("done", "refused")), ANSWER_S)
        time.sleep(GOES_ON_S)
    finally:
        node.destroy_node()
    answer = said().replace(str(folder), "the bundle")
    return went_on(
        live,
        name,
        since_s,
        detected_by="controller" if told else "",
        reaction=answer,
        told=answer.startswith(wanted),
    )
