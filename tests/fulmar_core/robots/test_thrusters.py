"""Valves on one pressure line."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fulmar_core.robots.actuators.thrusters import Nozzle, Thrusters
from fulmar_core.robots.robot_file import load_robot

THRUSTERS = load_robot("floating_platform").actuators
VALVES = len(THRUSTERS.nozzles)
commands = st.lists(st.sampled_from([0.0, 1.0]), min_size=VALVES, max_size=VALVES).map(np.array)


@settings(derandomize=True, deadline=None)
@given(command=commands)
def test_n_open_valves_share_the_line_and_give_one_nth_each(command):
    n = int(command.sum())
    thrusts = THRUSTERS.thrusts(command)
    np.testing.assert_allclose(thrusts, command / n if n else 0.0 * command, rtol=0, atol=1e-15)


@settings(derandomize=True, deadline=None)
@given(command=commands)
def test_without_a_shared_line_each_open_valve_gives_its_full_thrust(command):
    apart = replace(THRUSTERS, shared_pressure=False, thrust=1.5)
    np.testing.assert_array_equal(apart.thrusts(command), 1.5 * command)


def test_each_valve_alone_turns_by_the_known_moment():
    force, torque = THRUSTERS.wrench_in_body(np.eye(VALVES))
    # Tangential nozzles of 1 N on a rim of 0.31 m; the sign goes back and forth around the rim.
    np.testing.assert_allclose(torque[:, 2], [-0.31, 0.31] * 4, rtol=0, atol=1e-6)
    np.testing.assert_allclose(torque[:, :2], 0.0, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(force, axis=1), 1.0, rtol=0, atol=1e-12)


def test_the_two_nozzles_of_an_anchor_push_against_each_other():
    force, torque = THRUSTERS.wrench_in_body(np.eye(VALVES))
    np.testing.assert_allclose(force[0::2], -force[1::2], rtol=0, atol=1e-15)
    np.testing.assert_allclose(torque[0::2], -torque[1::2], rtol=0, atol=1e-15)


def test_all_valves_open_push_nowhere():
    force, torque = THRUSTERS.wrench_in_body(np.ones(VALVES))
    np.testing.assert_allclose(np.concatenate((force, torque)), 0.0, atol=1e-15)


def test_the_wrench_is_the_sum_of_forces_and_levers():
    command = np.array([1.0, 0, 1, 0, 0, 0, 0, 1])
    force, torque = THRUSTERS.wrench_in_body(command)
    open_ = [nozzle for nozzle, value in zip(THRUSTERS.nozzles, command, strict=True) if value]
    forces = [np.array(n.direction) / np.linalg.norm(n.direction) / 3 for n in open_]
    np.testing.assert_allclose(force, np.sum(forces, axis=0), rtol=0, atol=1e-15)
    levers = [np.cross(n.position, f) for n, f in zip(open_, forces, strict=True)]
    np.testing.assert_allclose(torque, np.sum(levers, axis=0), rtol=0, atol=1e-15)


def test_the_length_of_a_nozzle_s_direction_does_not_matter():
    one = Nozzle("a", (0.1, 0.0, 0.0), (0.0, 1.0, 0.0))
    long = replace(one, direction=(0.0, 7.0, 0.0))
    table = [Thrusters("thrusters", 1.0, True, (nozzle,)).wrench_per_newton for nozzle in (one, long)]
    np.testing.assert_array_equal(table[0], table[1])


def test_a_valve_is_open_above_one_half_and_closed_otherwise():
    assert THRUSTERS.limited(np.array([-3.0, 0.0, 0.5, 0.51, 1.0, 9.0])).tolist() == [0, 0, 0, 1, 1, 1]


def test_limiting_keeps_the_floating_type():
    assert THRUSTERS.limited(np.ones(8, dtype=np.float32)).dtype == np.float32


def test_the_safe_command_closes_every_valve():
    assert THRUSTERS.safe_command.tolist() == [0.0] * VALVES


def test_torch_gives_the_wrench_that_numpy_gives():
    torch = pytest.importorskip("torch")
    rng = np.random.default_rng(5)
    command = (rng.uniform(size=(16, VALVES)) > 0.5).astype(float)
    for ours, theirs in zip(
        THRUSTERS.wrench_in_body(command), THRUSTERS.wrench_in_body(torch.as_tensor(command)), strict=True
    ):
        np.testing.assert_allclose(theirs.numpy(), ours, rtol=0, atol=1e-15)


def test_banks_without_thrust_or_with_one_name_twice_are_refused():
    with pytest.raises(ValueError, match="'thrust' must be greater than 0"):
        replace(THRUSTERS, thrust=0.0)
    with pytest.raises(ValueError, match="'nozzles' has no nozzle"):
        replace(THRUSTERS, nozzles=())
    with pytest.raises(ValueError, match="a name of its own"):
        replace(THRUSTERS, nozzles=(THRUSTERS.nozzles[0],) * 2)


def test_a_nozzle_that_points_nowhere_is_refused():
    with pytest.raises(ValueError, match="nozzle 'a': 'direction' must not be zero"):
        Nozzle("a", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


DEGREES = load_robot("modular_freeflyer").actuators


@settings(derandomize=True, deadline=None)
@given(command=commands)
def test_in_the_plane_a_batch_is_pushed_as_the_wrench_in_space_says(command):
    force, torque = THRUSTERS.wrench_in_body(command)
    planar = THRUSTERS.planar_wrench(command[:, None], np.ones((VALVES, 1)))
    np.testing.assert_allclose(np.concatenate(planar), [force[0], force[1], torque[2]], rtol=0, atol=1e-12)


def test_a_weak_valve_gives_its_part_of_its_share():
    command = np.array([1.0, 0, 0, 0, 0, 0, 0, 1])[:, None]
    both, one = (
        THRUSTERS.planar_wrench(command * part, np.ones((VALVES, 1))) for part in (1.0, np.eye(VALVES)[:, :1])
    )
    gain = np.ones((VALVES, 1))
    gain[0] = 0.8
    weak = THRUSTERS.planar_wrench(command, gain)
    for ours, two, single in zip(weak, both, one, strict=True):
        np.testing.assert_allclose(ours, two - 0.2 * 0.5 * single, rtol=0, atol=1e-12)


def test_valves_that_open_by_degrees_are_neither_closed_nor_open_between():
    assert not DEGREES.binary
    assert DEGREES.limited(np.array([-1.0, 0.2, 0.7, 3.0])).tolist() == [0.0, 0.2, 0.7, 1.0]


def test_openings_that_add_up_to_less_than_one_do_not_share():
    half = np.zeros((VALVES, 1))
    half[0] = 0.5
    ahead, left, _ = DEGREES.planar_wrench(half, np.ones_like(half))
    assert np.hypot(ahead, left)[0] == pytest.approx(0.5 * DEGREES.thrust)
    half[7] = 1.5 / 2  # 0.5 and 0.75 open: 1.25 on the line
    ahead, left, _ = DEGREES.planar_wrench(half, np.ones_like(half))
    np.testing.assert_allclose(
        [ahead[0], left[0]],
        (0.5 / 1.25) * DEGREES.wrench_per_newton[0, :2] + (0.75 / 1.25) * DEGREES.wrench_per_newton[7, :2],
        rtol=0,
        atol=1e-12,
    )


def test_whatever_errors_add_no_valve_sucks():
    command = np.full((VALVES, 1), -0.05)
    assert not np.any(DEGREES.planar_wrench(command, np.ones_like(command)))
