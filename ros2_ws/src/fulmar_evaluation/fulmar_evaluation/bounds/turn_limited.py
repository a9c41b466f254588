"""Bound on visits of a robot that moves along its heading and turns no faster than it can.

Relaxed: turn rate and speed may be any that the robot can hold, and change at once, so yaw inertia and the slew of
propellers, steering and turn rates cost nothing. Only where a robot starts, stops, or changes from ahead to astern, it
needs the time that this takes at full thrust or at the slew of its wheels (`surge`). Leg by leg the way is a turn, a
straight and a turn, ahead or astern (Dubins 1957, Reeds and Shepp 1990, here with several radii and turning on the
spot). Where each disc is touched, with which heading, and whether ahead, astern or at rest, is found by dynamic
programming: on a coarse grid with a table of legs, then on ever finer grids around the plan with exact legs.
"""

from __future__ import annotations

import numpy as np

from fulmar_evaluation.bounds.leg_table import LegTable, leg_table, table_scale
from fulmar_evaluation.bounds.motions import Motions
from fulmar_evaluation.bounds.top_speed import top_speed_bound
from fulmar_evaluation.bounds.turn_plans import TurnTour, coarse_plans, refined
from fulmar_evaluation.bounds.visits import Bound, Route, route_of

_BATCH = 256  # episodes at once


def turn_limited_bound(
    start_xy: np.ndarray,
    waypoints: np.ndarray,
    *,
    motions: Motions,
    radius: float,
    duration_s: float,
    start_yaw: np.ndarray | None = None,
    loop: bool = True,
) -> Bound:
    """Most waypoints that a point can visit in order which moves along its heading, ahead and astern.

    What is relaxed only makes ways quicker, but for hulls that slide in turns; that the search finds the quickest is
    measured, not proven. All times are taken shorter by what this may cost (`Motions.shorter`), so that means over
    episodes err towards too many goals:

    - Hulls that lose time at stops 5 %: twice as fine a grid finds 3 % more in 16 tours (22 % in the worst), and the
      better of both 4 %; in the first 48 evaluated episodes of kingfisher 0.8 % (22 %) and 2.1 %. Several radii cost
      1.5 %, against linear programming. That a turning hull slides sideways (`motions`) makes it slower, but its circle
      tighter, 1.53 m and not 1.67 m: with it those 48 episodes have 1.3 % more.
    - Others 2 %. On two wheels two finer grids find 0.2 % and 0.4 % more goals in 32 tours of a minute (5 % in the
      worst), and optimal control (multiple shooting) finds 0.7 % fewer in 12 of them.

    The bound at top speed holds besides. What the relaxation gives away is at most what is missing to drives that
    optimal control found with all the dynamics, inertia and slew, and that the core's batch repeats: in episodes
    of go_through_positions they reach 0.97 of turtlebot2's bound (12 episodes) and 0.87 of kingfisher's (9).

    One thing is not relaxed: a hull that is faster than it can hold in a turn keeps some of that speed for a while. It
    pays for it when it speeds up again, and for slew at both ends of the turn, but that it pays enough is not proven.

    Args:
        start_xy: Where episodes start, shape (..., 2) [m].
        waypoints: Shape (..., K, 2) [m].
        motions: What the robot can hold.
        radius: How near a visit is [m].
        duration_s: Length of an episode [s].
        start_yaw: Heading at the start, shape (...,); any by default [rad].
        loop: The first waypoint comes after the last again.

    Returns:
        The bound, shapes (...,). Beyond the last whole waypoint, progress is the share of time to the next.

    Raises:
        ValueError: Something is not positive, or the number has no bound.
    """
    route = route_of(start_xy, waypoints, radius=radius, duration_s=duration_s, loop=loop)
    yaw = None if start_yaw is None else np.broadcast_to(start_yaw, route.shape).reshape(-1).astype(float)
    budget = duration_s / motions.shorter
    first, legs = (np.maximum(leg - 2.0 * radius, 0.0) / motions.ahead for leg in route.legs())
    most = route.goals_after(first, legs, budget)  # nothing exceeds top speed
    longest = np.max(
        np.concatenate([leg.reshape(route.episodes, -1) for leg in route.legs()], axis=1), axis=1
    )
    scale = table_scale(longest + 2.0 * radius)
    progress = np.zeros(route.episodes)
    for number in np.unique(scale):
        table, alike = leg_table(motions, int(number)), np.flatnonzero(scale == number)
        order = alike[np.argsort(most[alike], kind="stable")]
        for begin in range(0, len(order), _BATCH):
            some = order[begin : begin + _BATCH]
            centres = route.centres(some, int(most[some].max())).transpose(2, 0, 1)
            tour = TurnTour(route.start[some], None if yaw is None else yaw[some], centres, radius)
            progress[some] = _progress(tour, motions, table, budget, route)
    fastest = top_speed_bound(
        route.start, route.waypoints, radius=radius, top_speed=motions.ahead, duration_s=duration_s, loop=loop
    )
    progress = np.minimum(progress, fastest.progress).reshape(route.shape)
    return Bound(np.floor(progress).astype(int), progress)


def _progress(tour: TurnTour, motions: Motions, table: LegTable, duration: float, route: Route) -> np.ndarray:
    """Go up and down in the number of waypoints until one is in time and the next is late."""
    coarse = coarse_plans(tour, table, 1.1 * duration)
    count = len(tour.start)
    in_time, late, share = np.zeros(count, dtype=int), np.full(count, coarse.goals + 1), np.zeros(count)
    goals = np.clip(np.sum(coarse.times <= duration, axis=1) + 1, 1, coarse.goals)
    todo = np.arange(count)
    while todo.size:
        number = goals[todo]
        part = tour.of(todo, int(number.max()))
        _, times = refined(part, motions, coarse.plan_to(todo, number), number)
        last, before = (np.take_along_axis(times, (number - i)[:, None], axis=1)[:, 0] for i in (0, 1))
        reached = last <= duration
        late[todo] = np.where(reached, late[todo], number)
        share[todo] = np.where(reached, share[todo], (duration - before) / np.maximum(last - before, 1e-12))
        counted = np.arange(1, times.shape[1]) <= number[:, None]
        passed = np.sum((times[:, 1:] <= duration) & counted, axis=1)
        in_time[todo] = np.maximum(in_time[todo], passed)  # also those of a late plan are in time
        goals[todo] = np.where(reached, number + 1, in_time[todo] + 1)
        todo = todo[(in_time[todo] + 1 < late[todo]) & (in_time[todo] < route.most)]
    return in_time + np.where(in_time < route.most, np.clip(share, 0.0, 1.0 - 1e-9), 0.0)
