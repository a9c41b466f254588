"""What estimators of motion leave out changes no bit of what they estimate."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("filterpy")
from filterpy.kalman import ExtendedKalmanFilter

from fulmar_core.estimators.kinds import make_estimator
from fulmar_core.estimators.motion.history import HistoryEstimator
from fulmar_core.estimators.motion.kalman import LeanKalmanFilter
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.states.rotation import cross, size_of
from fulmar_core.wires.reading import Reading

BEGIN_NS, TICK_NS = 1_000_000_000, 20_000_000
KINDS = [("floating_platform", "mocap_imu"), ("spacecraft_16", "mocap_imu_3d")]


def test_the_lean_filter_has_the_bits_of_filterpy_s():
    draws, rows = np.random.default_rng(4), np.eye(15)[[0, 1, 2, 6, 7, 8]]
    lean, usual = LeanKalmanFilter(dim_x=15, dim_z=6), ExtendedKalmanFilter(dim_x=15, dim_z=6)
    root = draws.normal(size=(15, 15))
    for each in (lean, usual):
        each.x, each.P, each.Q = np.zeros(15), root @ root.T, 0.1 * np.eye(15)
    for _ in range(20):
        F, z = np.eye(15) + 0.1 * draws.normal(size=(15, 15)), draws.normal(size=6)
        for each in (lean, usual):
            each.F = F
            each.predict()
            each.update(z, lambda _x: rows, lambda x: rows @ x, R=0.2 * np.eye(6))
        np.testing.assert_array_equal(lean.x, usual.x)
        np.testing.assert_array_equal(lean.P, usual.P)


@pytest.mark.parametrize("count", [3, 4])
def test_a_length_has_the_bits_of_numpy(count):
    vectors = np.random.default_rng(5).normal(size=(500, count))
    assert [size_of(each) for each in vectors] == [float(np.linalg.norm(each)) for each in vectors]


def estimates(robot, kind):
    """After each of some readings of a robot that drifts; every fourth pose comes late."""
    draws, estimator = np.random.default_rng(6), make_estimator(kind, load_robot(robot))
    found, late = [], []
    for stamp_ns in range(BEGIN_NS, BEGIN_NS + 60 * TICK_NS, TICK_NS):
        sample = ImuSample(draws.normal(scale=0.01, size=3), draws.normal(scale=0.002, size=3))
        pose = np.array([*draws.normal(scale=1e-3, size=3), 0.0, 0.0, 0.0, 1.0])
        estimator.take("imu", Reading(sample, stamp_ns))
        late.append((stamp_ns, pose))
        if len(late) % 4 != 1:
            for at_ns, each in late:
                estimator.take("mocap", Reading(each, at_ns))
            late = []
        estimate = estimator.estimate()
        if estimate is not None:
            state = estimate.value
            found.append(
                np.concatenate(
                    (state.position_in_world, state.velocity_in_world, estimate.covariance.ravel())
                )
            )
    return np.array(found)


@pytest.mark.parametrize(("robot", "kind"), KINDS)
def test_the_newest_pose_is_taken_where_the_filter_is_as_after_a_replay(robot, kind, monkeypatch):
    insert, replay, counts = HistoryEstimator._insert, HistoryEstimator._replay, {"now": 0}

    def counted(self, at):
        counts["now"] += 1
        replay(self, at)

    monkeypatch.setattr(HistoryEstimator, "_replay", counted)
    found, fewer = estimates(robot, kind), counts["now"]
    monkeypatch.setattr(HistoryEstimator, "_insert", lambda self, event, **_is_there: insert(self, event))
    np.testing.assert_array_equal(found, estimates(robot, kind))
    assert len(found) > 30
    assert fewer < counts["now"] - fewer


@pytest.mark.parametrize("shape", [(3,), (1, 3), (9, 3)])
def test_a_vector_product_has_the_bits_of_numpy(shape):
    a, b = np.random.default_rng(7).normal(size=(2, *shape))
    np.testing.assert_array_equal(cross(a, b), np.cross(a, b))
