"""A user's own estimator: what it has to have, and what is made of what it says."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.estimators.kinds import check_estimator, estimator_kind, load_estimator, make_estimator
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import IMU, MOCAP, ODOMETRY
from fulmar_core.wires.reading import Reading

PLATFORM = load_robot("floating_platform")
CLASSES = """
import numpy as np
from fulmar_core.estimators.motion.estimator import Estimate
from fulmar_core.states.state import RigidBodyState
class Good:
    takes, takes_if_there, bridge_s = ("mocap",), ("imu",), 0.25
    def __init__(self, robot, settings): self.settings, self.newest = settings, None
    def reset(self): self.newest = None
    def take(self, name, reading):
        self.newest = reading
        return "too far" if reading.value[0] > 9.0 else None
    def estimate(self, stamp_ns=None):
        if self.newest is None: return None
        pose = np.asarray(self.newest.value, dtype=float)
        return Estimate(RigidBodyState(pose[:3], pose[3:], np.zeros(3), np.zeros(3)), np.eye(12), self.newest.stamp_ns)
class Unknown(Good):
    takes = ("mocup",)
class Raises(Good):
    def __init__(self, robot, settings): raise ValueError("by hand")
class Never(Good):
    bridge_s = -1.0
class Flat(Good):
    def estimate(self, stamp_ns=None): return 3.0
class Narrow(Good):
    def estimate(self, stamp_ns=None): return Estimate(super().estimate().value, np.eye(3), 1)
class Lacks:
    takes = ("mocap",)
"""
POSE = Reading(np.array([1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0]), 5)


@pytest.fixture
def own(tmp_path, monkeypatch, request):
    name = f"own_estimator_{abs(hash(request.node.name))}"
    (tmp_path / f"{name}.py").write_text(CLASSES)
    monkeypatch.chdir(tmp_path)
    return lambda kind: f"{name}:{kind}"


def test_it_says_what_it_takes_and_how_long_it_bridges(own):
    kind = estimator_kind(own("Good"))
    assert (kind.takes, kind.takes_if_there, kind.publishes) == ({"mocap": MOCAP}, {"imu": IMU}, (ODOMETRY,))
    assert load_estimator(own("Good")).bridge_s == 0.25


def test_its_estimates_and_refusals_are_passed_on(own):
    estimator = make_estimator(own("Good"), PLATFORM)
    assert estimator.estimate() is None
    assert estimator.problem == "no estimate yet"
    assert estimator.take("mocap", POSE) is None
    found = estimator.estimate()
    assert found is not None
    assert (found.stamp_ns, found.value.position_in_world.tolist()) == (5, [1.0, 2.0, 0.0])
    assert estimator.take("mocap", Reading(10.0 * POSE.value, 6)) == "too far"
    estimator.reset()
    assert (estimator.estimate(), estimator.epoch) == (None, 1)
    assert (estimator.status(), estimator.warnings(), estimator.outliers) == ({}, (), 0)


@pytest.mark.parametrize(
    ("kind", "words"), [("Flat", "Estimate of a RigidBodyState"), ("Narrow", "shape \\(12, 12\\)")]
)
def test_an_estimate_that_is_none_is_an_error(own, kind, words):
    estimator = make_estimator(own(kind), PLATFORM)
    estimator.take("mocap", POSE)
    with pytest.raises(TypeError, match=words):
        estimator.estimate()


def test_an_estimate_that_is_not_finite_is_an_error(own):
    estimator = make_estimator(own("Good"), PLATFORM)
    estimator.take("mocap", Reading(np.full(7, np.nan), 5))
    with pytest.raises(TypeError, match="not finite"):
        estimator.estimate()


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("Goood", "has no class 'Goood'. Did you mean 'Good'"),
        ("Lacks", "lacks reset, take, estimate"),
        ("Unknown", "'takes' has 'mocup'. Known: mocap, rate.*Did you mean 'mocap'"),
        ("Never", "'bridge_s' = -1 must be greater than 0"),
    ],
)
def test_a_class_that_is_no_estimator_is_one_line(own, kind, words):
    with pytest.raises(ConfigError, match=words):
        check_estimator(own(kind), PLATFORM)


def test_a_constructor_that_raises_is_one_line_with_its_place(own):
    with pytest.raises(
        ConfigError, match=r"MyEstimator\(robot, settings\) raised ValueError: by hand \(.*\.py:"
    ):
        make_estimator(own("Raises"), PLATFORM)
