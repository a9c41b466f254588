"""Bounds on visits of waypoints: exact where paper can state, and never beaten."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq, minimize, minimize_scalar

from fulmar_evaluation.bounds import goals_reached, shortest_lengths, time_optimal_bound, top_speed_bound
from fulmar_evaluation.bounds.disc_tour import DiscTour, is_inside, stop_and_go
from fulmar_evaluation.bounds.least_time import least_times
from fulmar_evaluation.bounds.reachable_set import log_barrier, reach_slack

RADIUS = 0.2
PLATFORM = 1.0 / 5.32  # m/s²: 1 N on 5.32 kg
STILL = np.zeros(2)


def tours(episodes: int, waypoints: int = 8, seed: int = 0) -> np.ndarray:
    """Waypoints 1 to 5 m apart, shape (episodes, waypoints, 2)."""
    rng = np.random.default_rng(seed)
    length = rng.uniform(1.0, 5.0, (episodes, waypoints))
    angle = rng.uniform(-np.pi, np.pi, (episodes, waypoints))
    return np.cumsum(np.stack((length * np.cos(angle), length * np.sin(angle)), axis=-1), axis=1)


def platform_bound(waypoints, duration_s, start_velocity=STILL, acceleration=PLATFORM, **more):
    return time_optimal_bound(
        STILL,
        start_velocity,
        waypoints,
        radius=more.pop("radius", RADIUS),
        acceleration=acceleration,
        duration_s=duration_s,
        **more,
    )


def assert_last_goal_takes(seconds: float, waypoints, **more) -> None:
    """The last waypoint is in time at 0.2 % more than `seconds`, and late at 1 % less."""
    count = len(waypoints)
    assert platform_bound(waypoints, seconds * 1.002, loop=False, **more).goals == count
    assert platform_bound(waypoints, seconds * 0.99, loop=False, **more).goals == count - 1


@pytest.mark.parametrize("acceleration", [0.05, PLATFORM, 3.0])
@pytest.mark.parametrize("distance", [1.0, 3.0, 5.0])
def test_a_straight_way_from_rest_takes_the_root_of_twice_its_length_over_the_acceleration(
    distance, acceleration
):
    seconds = np.sqrt(2.0 * (distance - RADIUS) / acceleration)
    assert_last_goal_takes(seconds, np.array([[0.6 * distance, 0.8 * distance]]), acceleration=acceleration)


@pytest.mark.parametrize("speed", [-0.4, 0.3, 0.8])
def test_a_straight_way_with_a_speed_along_it_takes_what_the_parabola_says(speed):
    seconds = brentq(lambda t: speed * t + 0.5 * PLATFORM * t * t - 2.8, 0.0, 30.0)
    assert_last_goal_takes(seconds, np.array([[3.0, 0.0]]), start_velocity=np.array([speed, 0.0]))


def test_there_and_back_takes_what_the_best_speed_at_the_turn_gives():
    def seconds(speed):
        peak = np.sqrt(PLATFORM * 2.8 + 0.5 * speed**2)
        return (2.0 * peak - speed + speed + np.sqrt(speed**2 + 2.0 * PLATFORM * 2.6)) / PLATFORM

    best = minimize_scalar(seconds, bounds=(0.0, 0.5), method="bounded").fun
    assert_last_goal_takes(best, np.array([[3.0, 0.0], [0.0, 0.0]]))


@pytest.mark.parametrize("top_speed", [0.2, 0.5, 0.8])
def test_a_straight_way_with_a_top_speed_takes_the_ramp_and_the_cruise(top_speed):
    seconds = top_speed / PLATFORM + (2.8 - 0.5 * top_speed**2 / PLATFORM) / top_speed
    assert_last_goal_takes(seconds, np.array([[3.0, 0.0]]), top_speed=top_speed)


def test_whatever_keeps_to_the_acceleration_is_inside_the_reachable_set():
    rng = np.random.default_rng(1)
    s, weight = np.polynomial.legendre.leggauss(200)  # time from -1 to 1
    motions = rng.normal(size=(800, 4)) * np.exp(rng.normal(size=(800, 4)))
    switches = np.sort(rng.uniform(-1.0, 1.0, (800, 3)), axis=1)
    piece = np.sum(s[None, :, None] > switches[:, None], axis=-1)
    bangs = np.take_along_axis(rng.uniform(-np.pi, np.pi, (800, 4)), piece, axis=1)
    tangent = motions[:, None, :2] + motions[:, None, 2:] * s[:, None]  # the set's boundary is made of these
    directions = [
        tangent / np.linalg.norm(tangent, axis=-1, keepdims=True),
        np.stack((np.cos(bangs), np.sin(bangs)), axis=-1),
    ]
    for duration in (0.3, 5.0):
        for a in directions:
            change = 0.5 * duration * np.einsum("s,nsi->in", weight, a)
            moment = 0.25 * duration**2 * np.einsum("s,nsi->in", weight * s, a)
            _, slack = reach_slack(change, moment, np.full(800, duration))
            assert np.all(slack > -1e-3 * duration**2)  # the quadrature errs where an acceleration jumps


def test_the_reachable_set_is_exact_along_a_line_and_eight_percent_too_wide_at_most():
    def slack(change, along, across):
        return reach_slack(np.array([change, 0.0]), np.array([along, across]), np.array(1.0))[1]

    for change in (0.0, 0.3, 0.7, 0.95):
        assert slack(change, 0.25 * (1.0 - change**2), 0.0) == pytest.approx(0.0, abs=1e-12)
    for k in (0.2, 1.0, 3.0, 20.0):  # accelerations along (1, k s): change and moment are perpendicular
        change = np.arcsinh(k) / k
        across = 0.25 * (k * np.sqrt(1.0 + k * k) - np.arcsinh(k)) / k**2
        assert slack(change, 0.0, across) >= 0.0 >= slack(change, 0.0, 1.08 * across)


def test_derivatives_of_the_reachable_set_are_those_of_finite_differences():
    rng = np.random.default_rng(2)
    y = np.concatenate(
        (0.3 * rng.normal(size=(2, 50)), 0.05 * rng.normal(size=(2, 50)), rng.uniform(1, 2, (1, 50)))
    )

    def value(y):
        return -np.log(reach_slack(y[0:2], y[2:4], y[4])[1])

    exact = log_barrier(y[0:2], y[2:4], y[4])
    for i in range(5):
        e = np.zeros((5, 1))
        e[i] = 1e-5
        np.testing.assert_allclose(
            exact.gradient[i], (value(y + e) - value(y - e)) / 2e-5, rtol=1e-6, atol=1e-6
        )
        after, before = (log_barrier(z[0:2], z[2:4], z[4]).gradient for z in (y + e, y - e))
        np.testing.assert_allclose(exact.hessian[i], (after - before) / 2e-5, rtol=1e-6, atol=1e-5)


def chase(waypoints, duration_s, *, stiffness, damping, top_speed=np.inf, dt=0.04):
    """Bang-bang: full acceleration along the error of a spring and a damper, shape (steps, episodes, 2)."""
    episodes = len(waypoints)
    x, v, done, seen = np.zeros((episodes, 2)), np.zeros((episodes, 2)), np.zeros(episodes, dtype=int), []
    for _ in range(round(duration_s / dt)):
        pull = stiffness * (waypoints[np.arange(episodes), done % waypoints.shape[1]] - x) - damping * v
        a = PLATFORM * pull / np.maximum(np.linalg.norm(pull, axis=1, keepdims=True), 1e-9)
        after = v + a * dt
        after *= np.minimum(1.0, top_speed / np.maximum(np.linalg.norm(after, axis=1, keepdims=True), 1e-9))
        x, v = x + 0.5 * (v + after) * dt, after
        seen.append(x)
        near = np.linalg.norm(waypoints[np.arange(episodes), done % waypoints.shape[1]] - x, axis=1) < RADIUS
        done += near
    return np.stack(seen, axis=1)


@pytest.mark.parametrize("top_speed", [np.inf, 0.5])
def test_no_bang_bang_chase_beats_the_bound(top_speed):
    waypoints = tours(32, seed=3)
    bound = platform_bound(waypoints, 60.0, top_speed=top_speed)
    by_speed = top_speed_bound(
        STILL, waypoints, radius=RADIUS, top_speed=min(top_speed, 3.0), duration_s=60.0
    )
    best = np.zeros(32, dtype=int)
    for damping in (0.8, 1.2, 1.8):
        track = chase(waypoints, 60.0, stiffness=0.6, damping=damping, top_speed=top_speed)
        best = np.maximum(best, goals_reached(track, waypoints, radius=RADIUS))
    assert np.all(best <= bound.goals)
    assert np.all(best <= by_speed.goals)
    assert np.mean(best / bound.goals) > 0.6  # the bound is one, and not a sky


@pytest.mark.parametrize("top_speed", [np.inf, 0.8])
def test_plans_from_random_velocities_end_in_the_same_optimum(top_speed):
    centres = np.ascontiguousarray(tours(32, 10, seed=4).transpose(1, 2, 0))
    tour = DiscTour(np.zeros((4, 32)), centres, np.full(32, 10), RADIUS, top_speed)
    expected = least_times(tour)[-1]
    rng = np.random.default_rng(5)
    for most in (0.3, 1.5):
        plan = stop_and_go(tour)
        velocity = most * rng.normal(size=(10, 2, 32))
        speed = np.linalg.norm(velocity, axis=1, keepdims=True)
        plan.states[:, 2:4] = velocity * np.minimum(1.0, 0.9 * top_speed / speed)
        while not (inside := is_inside(tour, plan)).all():
            plan.durations[~inside] *= 1.1
        np.testing.assert_allclose(least_times(tour, plan)[-1], expected, rtol=5e-4)


@pytest.mark.parametrize(
    ("less", "more"),
    [
        ({"acceleration": 0.1}, {"acceleration": 0.2}),
        ({"duration_s": 20.0}, {"duration_s": 30.0}),
        ({"radius": 0.1}, {"radius": 0.2}),
        ({"top_speed": 0.4}, {"top_speed": 0.6}),
        ({"top_speed": 1.0}, {"top_speed": np.inf}),
    ],
)
def test_who_can_do_more_reaches_no_less(less, more):
    waypoints = tours(16, seed=6)
    usual = {"duration_s": 30.0}
    low, high = (platform_bound(waypoints, **(usual | case)) for case in (less, more))
    assert np.all(high.progress >= low.progress - 0.02)
    assert np.all(high.goals >= low.goals)


def test_progress_is_the_number_of_goals_and_a_share_of_the_next():
    bound = platform_bound(tours(16, seed=7), 40.0)
    assert np.all((bound.goals <= bound.progress) & (bound.progress < bound.goals + 1))


def test_an_episode_alone_has_the_bound_that_it_has_in_a_batch():
    waypoints = tours(4, seed=8)
    velocity = np.random.default_rng(9).uniform(-0.3, 0.3, (4, 2))
    together = platform_bound(waypoints, 25.0, start_velocity=velocity)
    alone = [platform_bound(waypoints[i], 25.0, start_velocity=velocity[i]) for i in range(4)]
    np.testing.assert_array_equal(together.goals, [one.goals for one in alone])
    np.testing.assert_allclose(together.progress, [one.progress for one in alone], atol=1e-6)


@pytest.mark.parametrize("duration_s", [30.0, 200.0])
def test_a_list_without_a_loop_ends_with_its_last_waypoint(duration_s):
    waypoints = tours(6, 4, seed=10)
    bound = platform_bound(waypoints, duration_s, loop=False)
    fast = top_speed_bound(STILL, waypoints, radius=RADIUS, top_speed=1.0, duration_s=duration_s, loop=False)
    assert np.all(bound.goals <= 4) and np.all(fast.goals <= 4)
    if duration_s == 200.0:
        assert np.all(bound.progress == 4.0) and np.all(fast.progress == 4.0)


def test_waypoints_that_overlap_and_one_at_the_start_cost_next_to_nothing():
    waypoints = np.array([[0.1, 0.0], [0.2, 0.1], [0.25, 0.0], [3.0, 0.0]])
    assert_last_goal_takes(np.sqrt(2.0 * 2.8 / PLATFORM), waypoints)


def test_a_straight_way_at_top_speed_is_as_long_as_it_looks():
    waypoints = np.array([[1.0, 0.0], [3.0, 0.0], [6.0, 0.0]])
    for metres, goals in ((0.79, 0), (0.81, 1), (2.79, 1), (2.81, 2), (5.79, 2), (5.81, 3)):
        bound = top_speed_bound(
            STILL, waypoints, radius=RADIUS, top_speed=0.5, duration_s=2.0 * metres, loop=False
        )
        assert bound.goals == goals


def test_the_length_of_the_shortest_way_is_that_of_a_general_optimiser():
    waypoints = tours(4, 6, seed=11)
    lengths = shortest_lengths(np.zeros((2, 4)), waypoints.transpose(1, 2, 0), radius=RADIUS)
    for i, centres in enumerate(waypoints):

        def length(p):
            return np.sum(np.linalg.norm(np.diff(p.reshape(-1, 2), axis=0, prepend=np.zeros((1, 2))), axis=1))

        inside = {
            "type": "ineq",
            "fun": lambda p, c=centres: RADIUS**2 - np.sum((p.reshape(-1, 2) - c) ** 2, axis=1),
        }
        best = minimize(length, centres.ravel(), constraints=inside, method="SLSQP").fun
        assert lengths[-1, i] <= best + 1e-6
        assert lengths[-1, i] == pytest.approx(best, abs=0.01)


def test_no_way_through_the_discs_is_shorter_than_the_shortest():
    waypoints = tours(20, 6, seed=12)
    lengths = shortest_lengths(np.zeros((2, 20)), waypoints.transpose(1, 2, 0), radius=RADIUS)
    rng = np.random.default_rng(13)
    for _ in range(200):
        angle = rng.uniform(-np.pi, np.pi, (20, 6))
        points = waypoints + RADIUS * np.stack((np.cos(angle), np.sin(angle)), axis=-1)
        way = np.diff(np.concatenate((np.zeros((20, 1, 2)), points), axis=1), axis=1)
        assert np.all(np.cumsum(np.linalg.norm(way, axis=-1), axis=1) >= lengths.T)


def test_waypoints_count_in_their_order_and_at_most_one_a_sample():
    waypoints = np.array([[1.0, 0.0], [2.0, 0.0], [2.1, 0.0]])
    line = np.stack((np.linspace(0.0, 3.0, 31), np.zeros(31)), axis=1)
    assert goals_reached(line, waypoints, radius=RADIUS) == 3
    assert goals_reached(line[::-1], waypoints, radius=RADIUS) == 1  # the first is the last to be passed
    assert goals_reached(line[[10, 20]], waypoints, radius=RADIUS) == 2  # two at once, of which one counts
    assert goals_reached(line[:8], waypoints, radius=RADIUS) == 0


def test_after_the_last_waypoint_the_first_comes_again_in_a_loop_only():
    waypoints = np.array([[0.0, 0.0], [1.0, 0.0]])
    there_and_back = waypoints[[0, 1, 0, 1, 0]]
    assert goals_reached(there_and_back, waypoints, radius=RADIUS) == 5
    assert goals_reached(there_and_back, waypoints, radius=RADIUS, loop=False) == 2


def test_many_trajectories_are_evaluated_at_once():
    waypoints = tours(5, 3, seed=14)
    assert goals_reached(waypoints, waypoints, radius=RADIUS).tolist() == [3] * 5
    assert goals_reached(waypoints[0], waypoints, radius=RADIUS).shape == (5,)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"radius": 0.0}, "'radius' and 'duration_s' must be greater than 0"),
        ({"duration_s": -1.0}, "'radius' and 'duration_s' must be greater than 0"),
        ({"acceleration": 0.0}, "'acceleration' and 'top_speed' must be greater than 0"),
        ({"top_speed": 0.0}, "'acceleration' and 'top_speed' must be greater than 0"),
        ({"start_velocity": np.array([1.0, 0.0]), "top_speed": 0.5}, "must be slower than 'top_speed'"),
        ({"waypoints": np.array([[1.0, 0.0]])}, "must not all lie within reach of one another"),
    ],
)
def test_what_has_no_bound_is_refused(wrong, words):
    with pytest.raises(ValueError, match=words):
        platform_bound(**({"waypoints": tours(1)[0], "duration_s": 10.0} | wrong))


def test_a_top_speed_bound_needs_a_top_speed():
    with pytest.raises(ValueError, match="'top_speed' must be finite"):
        top_speed_bound(STILL, tours(1)[0], radius=RADIUS, top_speed=np.inf, duration_s=10.0)
