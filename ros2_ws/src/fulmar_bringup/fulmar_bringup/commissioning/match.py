"""Match of each wire's pulse response to the nozzle, wheel or propeller behind it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from fulmar_bringup.commissioning.response import Response
from fulmar_core.robots.actuators.thrusters import Thrusters
from fulmar_core.robots.robot import Robot

CLEARLY = 5.0  # standard errors that a change must exceed to count
# Of one nozzle's impulse; a seventh of it is what a nozzle takes away when all of eight blow
LEAST_SHARE = 0.07
# Below it, valves are inverted or the pressure is low: by more than mass and thrust are uncertain
WEAK_SHARE = 0.35
# Of a unit force and a unit torque; neighbouring directions of eight nozzles are 1.4 apart
WORST_MISMATCH = 0.75
# Of the turn that the other side gives: sides are alike, and a base that still settles turns by a few hundredths of it
LEAST_OF_OTHER = 0.1
SAME = 1e-3  # nozzles whose forces and torques differ by less cannot be distinguished
ROUNDS = 3  # of matching and scaling the torque, since yaw inertias are known badly


@dataclass(frozen=True)
class Match:
    """What the pulses show.

    Attributes:
        drives: Index of the actuator behind each wire, None where it did not answer.
        signs: 1.0, or -1.0 where it works backwards.
        dead: Wires that did not answer.
        strength: Median share of the expected motion; 0 where nothing answered or nothing is expected.
        problems: What is wrong, in words; empty if every wire has an actuator of its own.
    """

    drives: tuple[int | None, ...]
    signs: tuple[float, ...]
    dead: tuple[int, ...]
    strength: float
    problems: tuple[str, ...]


def match_nozzles(
    robot: Robot,
    thrusters: Thrusters,
    found: Sequence[Response],
    lasts_s: Sequence[float],
    order: Sequence[int],
) -> Match:
    """Find the nozzle that each wire opens: the assignment whose forces and torques fit the changes best.

    Args:
        robot: The robot.
        thrusters: Its actuators.
        found: Change of velocity by each wire's pulse.
        lasts_s: How long each pulse was [s].
        order: What the hardware file says; it decides between nozzles of equal force and torque.

    Returns:
        Which nozzle each wire opens.
    """
    wrenches = thrusters.wrench_per_newton[:, [0, 1, 5]]
    arm = float(np.sqrt(np.mean(wrenches[:, 2] ** 2))) or 1.0
    nozzles = wrenches / (1.0, 1.0, arm)
    impulse = thrusters.thrust * np.asarray(lasts_s)[:, None]
    changes = np.array([one.change for one in found]) / impulse
    scaled = changes * (robot.body.mass, robot.body.mass, robot.body.inertia[2] / arm)
    alive = np.array([_answers(one, share) for one, share in zip(found, scaled, strict=True)])
    dead = tuple(int(wire) for wire in np.flatnonzero(~alive))
    drives: list[int | None] = [None] * len(found)
    if not alive.any():
        return Match(tuple(drives), (1.0,) * len(found), dead, 0.0, ("no wire moves the robot",))
    flat = np.hypot(scaled[alive, 0], scaled[alive, 1])
    strength = float(np.median(flat))
    answers = scaled[alive] / (strength, strength, float(np.median(np.abs(scaled[alive, 2]))) or 1.0)
    wires = np.flatnonzero(alive)
    prefers = np.array(
        [[1e-6 * (order[int(wire)] != nozzle) for nozzle in range(len(nozzles))] for wire in wires]
    )
    for _ in range(ROUNDS):
        cost = np.sum((answers[:, None, :] - nozzles[None, :, :]) ** 2, axis=2)
        rows, columns = linear_sum_assignment(cost + prefers)
        torque = nozzles[columns, 2]
        fit = float(answers[rows, 2] @ torque) / max(float(torque @ torque), 1e-9)
        answers[:, 2] /= fit if fit > 0.1 else 1.0
    problems = []
    for row, nozzle in zip(rows, columns, strict=True):
        drives[wires[row]] = int(nozzle)
        if np.sqrt(cost[row, nozzle]) > WORST_MISMATCH:
            problems.append(
                f"wire {wires[row]} moves the robot as none of its nozzles would (the nearest is "
                f"{thrusters.names[nozzle]}): do positions and directions in the robot file hold?"
            )
    if strength < WEAK_SHARE:
        problems.append(
            f"a pulse moves the robot by {100.0 * strength:.0f} % of what one nozzle gives: the valves are open "
            "where they should be closed (inverted), or the pressure is low"
        )
    return Match(tuple(drives), (1.0,) * len(found), dead, strength, tuple(problems))


def match_sides(found: Sequence[Response]) -> Match:
    """Find the side of a base or boat that each channel drives, and whether forwards.

    A left side that drives ahead turns the robot to the right, a right one to the left; backwards it is the reverse.
    `found` has the change by each channel's pulse of a positive value.

    Returns:
        0 for left and 1 for right, with signs.
    """
    drives: list[int | None] = []
    signs = []
    most = max(abs(one.change[2]) for one in found)
    for one in found:
        ahead, _, turn = one.change
        moves = min(one.clearly[0], one.clearly[2]) > CLEARLY and abs(turn) > LEAST_OF_OTHER * most
        drives.append((0 if ahead * turn < 0.0 else 1) if moves else None)
        signs.append(-1.0 if moves and ahead < 0.0 else 1.0)
    dead = tuple(channel for channel, side in enumerate(drives) if side is None)
    known = [side for side in drives if side is not None]
    problems = ("two channels drive the same side",) if len(set(known)) < len(known) else ()
    if len(dead) == len(drives):
        problems = ("no channel moves the robot",)
    return Match(tuple(drives), tuple(signs), dead, 0.0, problems)


def left_over(match: Match, count: int) -> int | None:
    """The one actuator that no wire drives, where one wire alone did not answer; None otherwise."""
    if len(match.dead) != 1:
        return None
    (missing,) = set(range(count)) - set(match.drives)
    return missing


def indistinct(thrusters: Thrusters) -> list[tuple[str, ...]]:
    """Groups of nozzles whose forces and torques are equal, so that no motion distinguishes them."""
    wrenches = thrusters.wrench_per_newton
    groups: dict[int, list[str]] = {}
    for name, wrench in zip(thrusters.names, wrenches, strict=True):
        first = int(np.argmax(np.abs(wrenches - wrench).max(axis=1) < SAME))
        groups.setdefault(first, []).append(name)
    return [tuple(group) for group in groups.values() if len(group) > 1]


def _answers(one: Response, share: np.ndarray) -> bool:
    """Whether a wire moved the robot: far more than by noise, and not by a tiny part of a nozzle's impulse."""
    clear = one.clearly
    flat = np.hypot(clear[0], clear[1]) > CLEARLY and np.hypot(share[0], share[1]) > LEAST_SHARE
    turned = clear[2] > CLEARLY and abs(share[2]) > LEAST_SHARE
    return bool(flat or turned)
