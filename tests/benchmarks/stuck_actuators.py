"""Table of valves and fans that stick: how many are named, and what becomes of their robots.

Each seed is one episode of the nominal scenario in MuJoCo, of which one actuator sticks after 3 to 6 s.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from fulmar_core.worlds.scenario import load_scenario
from tests.watched_actuators import CLOSED, OPEN, Simulators, Watched, sticking, watch

SYSTEMS = (
    ("floating_platform", "go_to_pose", "lqr", 25.0),
    ("floating_platform", "go_to_pose", "policy", 25.0),
    ("modular_freeflyer", "go_to_pose", "lqr", 25.0),
    ("spacecraft_16", "go_to_pose_3d", "lqr", 45.0),
    ("spacecraft_16", "go_to_pose_3d", "policy", 45.0),
    ("int_ball2", "go_to_pose_3d", "lqr", 45.0),
    ("int_ball2", "go_to_pose_3d", "policy", 45.0),
)
STATES = {"sound": None, "stuck open": OPEN, "stuck closed": CLOSED}
SOON_S = 15.0  # after the fault
HEADS = (
    "robot, controller", "actuator", "named", "wrong", "s to the name", "stopped", "at its goal",
    "stopped or at its goal within 15 s", "of robots that are at their goal by then with sound actuators",
    "in the end",
)  # fmt: skip


def settled_s(each: Watched) -> float:
    """When a robot stopped in words or stayed at its goal, after the fault; infinite if it did not [s]."""
    times = [time for time in (each.stopped_s, each.at_goal_s) if time is not None]
    return min(times, default=np.inf) - each.from_s


def row(name: str, state: str, at: float | None, found: list[Watched], sound: list[Watched]) -> list[str]:
    """Cells of one line of the table; `sound` are the same episodes without a fault."""
    count = len(found)
    wrong = sum(bool(each.wrong(at)) for each in found)
    stopped = sum(each.stopped_s is not None for each in found)
    there = sum(each.stopped_s is None and each.at_goal_s is not None for each in found)
    if at is None:
        return [name, state, "", f"{wrong}", "", f"{stopped}", f"{there}", "", "", ""]
    named = [
        (each.dead if at == CLOSED else each.open)[each.part] - each.from_s
        for each in found
        if each.right(at)
    ]
    times = [settled_s(each) for each in found]
    near = [
        time <= SOON_S
        for time, each, twin in zip(times, found, sound, strict=True)
        if twin.at_goal_s is not None and twin.at_goal_s <= each.from_s + SOON_S
    ]
    return [
        name,
        state,
        f"{len(named)} of {count}",
        f"{wrong}",
        f"{np.median(named):.1f}, at most {max(named):.1f}" if named else "",
        f"{stopped}",
        f"{there}",
        f"{sum(time <= SOON_S for time in times)}",
        f"{sum(near)} of {len(near)}",
        f"{sum(np.isfinite(time) for time in times)}",
    ]


def _say(cells: Sequence[str]) -> None:
    sys.stdout.write(f"| {' | '.join(cells)} |\n")
    sys.stdout.flush()


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20, help="episodes of each line")
    parser.add_argument("--seed", type=int, default=11, help="that they are drawn from")
    asked = parser.parse_args()
    _say(HEADS)
    _say(["---"] * len(HEADS))
    for robot, task, controller, seconds in SYSTEMS:
        sound: list[Watched] = []
        for state, at in STATES.items():
            scenario = load_scenario("nominal") if at is None else sticking(at, from_s=(3.0, 6.0))
            found = watch(
                robot,
                task,
                controller,
                scenario,
                episodes=asked.seeds,
                seconds=seconds,
                seed=asked.seed,
                simulator=Simulators,
            )
            sound = found if at is None else sound
            _say(row(f"{robot}, {controller}", state, at, found, sound))


if __name__ == "__main__":
    main()
