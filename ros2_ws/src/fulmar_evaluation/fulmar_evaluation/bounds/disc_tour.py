"""A tour of discs, a plan through it, and what the plan must keep to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_evaluation.bounds.reachable_set import reach_slack

# Where the variables of one link lie: position and velocity before and after it, and its duration.
P0, V0, P1, V1, H = slice(0, 2), slice(2, 4), slice(4, 6), slice(6, 8), 8


@dataclass(frozen=True, slots=True)
class DiscTour:
    """Discs to touch in order, for E episodes at once, in units in which the largest acceleration is 1."""

    start: np.ndarray  # (4, E) position and velocity
    centres: np.ndarray  # (goals, 2, E)
    counts: np.ndarray  # (E,) discs that count, 1 to goals; a shorter tour leaves the last ones out
    radius: float
    top_speed: float  # infinite: no limit

    @property
    def active(self) -> np.ndarray:
        """Which links count, shape (links, E)."""
        return np.asarray(np.arange(len(self.centres))[:, None] < self.counts)

    @property
    def constraints(self) -> np.ndarray:
        """Degree of all barriers together, shape (E,): what one unit of their weight costs at most."""
        return self.counts * (3.0 if np.isinf(self.top_speed) else 7.0)

    def of(self, episodes: np.ndarray) -> DiscTour:
        """Some of the episodes."""
        return DiscTour(
            self.start[:, episodes],
            self.centres[:, :, episodes],
            self.counts[episodes],
            self.radius,
            self.top_speed,
        )


@dataclass(frozen=True, slots=True)
class Plan:
    """States after each link, and how long each takes."""

    states: np.ndarray  # (links, 4, E) position and velocity
    durations: np.ndarray  # (links, E)

    def of(self, episodes: np.ndarray) -> Plan:
        """Some of the episodes."""
        return Plan(self.states[:, :, episodes], self.durations[:, episodes])

    def write(self, episodes: np.ndarray, other: Plan) -> None:
        """Overwrite some of the episodes in place."""
        self.states[:, :, episodes] = other.states
        self.durations[:, episodes] = other.durations


@dataclass(frozen=True, slots=True)
class Links:
    """What a plan does in each link; shapes (2, links, E)."""

    move: np.ndarray  # change of position
    gain: np.ndarray  # change of velocity
    mean: np.ndarray  # mean of first and last velocity
    moment: np.ndarray  # what the acceleration adds to the move: `reach`


@dataclass(frozen=True, slots=True)
class Limit:
    """One inequality `slack >= 0` a link; derivatives by the link's nine variables, those that are not zero."""

    slack: np.ndarray  # (links, E)
    first: dict[int, np.ndarray | float]
    second: dict[tuple[int, int], np.ndarray | float]  # i <= j


def links_of(tour: DiscTour, plan: Plan) -> Links:
    """Changes along a plan."""
    before = np.concatenate((tour.start[None], plan.states[:-1]))
    change = (plan.states - before).swapaxes(0, 1)
    mean = 0.5 * (plan.states + before)[:, 2:4].swapaxes(0, 1)
    return Links(change[0:2], change[2:4], mean, change[0:2] - plan.durations * mean)


def limits(tour: DiscTour, plan: Plan, links: Links) -> list[Limit]:
    """Every inequality but that of `reach`.

    Each link ends in its disc. A top speed V holds the last velocity and the mean velocity of each link, and on the
    line u between two discs it also costs the time to speed up and to slow down: with the gaps g = V - v·u at both
    ends, a link is shorter than V h by (g0² + g1²) / 2, less what the two triangles share where it is brief.
    """
    offset = plan.states[:, 0:2].swapaxes(0, 1) - tour.centres.swapaxes(0, 1)
    found = [_round(tour.radius, offset, at=4)]
    if np.isinf(tour.top_speed):
        return found
    V, h = tour.top_speed, plan.durations
    found.append(_round(V, plan.states[:, 2:4].swapaxes(0, 1), at=6))
    dx, dy = links.move
    first: dict[int, np.ndarray | float] = {0: 2.0 * dx, 1: 2.0 * dy, 4: -2.0 * dx, 5: -2.0 * dy}
    first[8] = 2.0 * V * V * h
    second: dict[tuple[int, int], np.ndarray | float] = {
        (i, j): -2.0 if i == j else 2.0 for i, j in ((0, 0), (1, 1), (4, 4), (5, 5), (0, 4), (1, 5))
    }
    second[8, 8] = 2.0 * V * V
    found.append(Limit(V * V * h * h - dx * dx - dy * dy, first, second))
    found.append(_speeding_up(V, h, _directions(tour).swapaxes(0, 1), links))
    return found


def _round(size: float, vector: np.ndarray, *, at: int) -> Limit:
    """Limit on the length of a vector whose variables begin at index `at`."""
    x, y = vector
    return Limit(
        size * size - x * x - y * y,
        {at: -2.0 * x, at + 1: -2.0 * y},
        {(at, at): -2.0, (at + 1, at + 1): -2.0},
    )


def _directions(tour: DiscTour) -> np.ndarray:
    """Unit vectors from each disc to the next, shape (goals, 2, E); 0 between equal ones."""
    leg = np.diff(tour.centres, axis=0, prepend=tour.start[None, 0:2])
    length = np.linalg.norm(leg, axis=1, keepdims=True)
    return np.asarray(leg / np.maximum(length, 1e-12))


def _speeding_up(V: float, h: np.ndarray, u: np.ndarray, links: Links) -> Limit:
    """Limit from the speeds along u, shape (2, links, E), at both ends."""
    gaps = [V - np.sum((links.mean + side * links.gain) * u, axis=0) for side in (-0.5, 0.5)]
    shared = np.maximum(gaps[0] + gaps[1] - h, 0.0)
    some = 0.5 * (shared > 0.0)
    lost = 0.5 * (gaps[0] ** 2 + gaps[1] ** 2) - 0.25 * shared * shared
    first: dict[int, np.ndarray | float] = {0: u[0], 1: u[1], 4: -u[0], 5: -u[1], 8: V - 0.5 * shared}
    second: dict[tuple[int, int], np.ndarray | float] = {(8, 8): some}
    for i in range(2):
        for at, gap in ((2, gaps[0]), (6, gaps[1])):
            first[at + i] = (gap - 0.5 * shared) * u[i]
            second[at + i, 8] = some * u[i]
            for j in range(i, 2):
                second[at + i, at + j] = (some - 1.0) * u[i] * u[j]
        for j in range(2):
            second[2 + i, 6 + j] = some * u[i] * u[j]
    return Limit(V * h - np.sum(links.move * u, axis=0) - lost, first, second)


def all_slacks(tour: DiscTour, plan: Plan) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Slacks whose logarithms are the barrier, and those that must be positive besides; shapes (links, E)."""
    links = links_of(tour, plan)
    room, slack = reach_slack(links.gain, links.moment, plan.durations)
    return [slack, *(limit.slack for limit in limits(tour, plan, links))], [room, plan.durations]


def is_inside(tour: DiscTour, plan: Plan) -> np.ndarray:
    """Which links keep all limits, shape (links, E); links that do not count do."""
    barrier, others = all_slacks(tour, plan)
    kept = np.logical_and.reduce([slack > 0.0 for slack in (*barrier, *others)])
    return np.asarray(kept | ~tour.active)


def stop_and_go(tour: DiscTour) -> Plan:
    """A plan that keeps all limits: straight lines from centre to centre, at rest after each link."""
    states = np.concatenate((tour.centres, np.zeros_like(tour.centres)), axis=1)
    change = np.diff(states[:, 0:2], axis=0, prepend=tour.start[None, 0:2])
    length = np.linalg.norm(change, axis=1)
    # From rest to rest takes 2 √length.
    plan = Plan(states, np.maximum(2.2 * np.sqrt(length) + 0.1, 1.5 * length / tour.top_speed))
    for _ in range(200):
        outside = ~is_inside(tour, plan)
        if not outside.any():
            break
        plan.durations[outside] *= 1.2
    return plan
