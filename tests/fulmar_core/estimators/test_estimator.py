"""From late, noisy and wrong poses and inertial readings to one estimate."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import Guards
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import ConfigError
from fulmar_core.estimators.kinds import KINDS, EstimatorKind, load_estimator, make_estimator
from fulmar_core.estimators.motion.planar_motion import PlanarMotionEstimator
from fulmar_core.estimators.motion.settings import EstimatorSettings
from fulmar_core.estimators.motion.strangers import TO_BEGIN_ANEW_NS
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.robots.topics import IMU, ODOMETRY
from fulmar_core.states.rotation import from_yaw
from fulmar_core.wires.reading import Reading

pytest.importorskip("filterpy")
LIMITS = load_robot("floating_platform").limits
SETTINGS = load_estimator("mocap_imu")
MS = 1_000_000
BEGIN = 1_000 * MS
REST = np.array([0.0, 0.0, 9.81])


def see_pose(
    estimator: PlanarMotionEstimator, position: np.ndarray, quat: np.ndarray, stamp_ns: int
) -> str | None:
    return estimator.take("mocap", Reading(np.concatenate((position, quat)), stamp_ns))


def see_imu(estimator: PlanarMotionEstimator, sample: ImuSample, stamp_ns: int) -> str | None:
    return estimator.take("imu", Reading(sample, stamp_ns))


class Track:
    """A body that speeds up along x at 0.2 m/s² while it turns at 0.3 rad/s, from 2 s on."""

    ACCELERATION, RATE = 0.2, 0.3

    def __init__(self, **changes: float) -> None:
        self.estimator = PlanarMotionEstimator(dataclasses.replace(SETTINGS, **changes), LIMITS)
        self.rng = np.random.default_rng(1)

    def at(self, t: float) -> tuple[float, float, float]:
        """x, v_x and yaw."""
        s = max(0.0, t - 2.0)
        return 0.5 * self.ACCELERATION * s * s, self.ACCELERATION * s, self.RATE * s

    def pose(
        self, t: float, *, stamp_s: float | None = None, off: float = 0.0, noise: float = 0.001
    ) -> str | None:
        x, _, yaw = self.at(t)
        place = np.array([x + off, 0.0, 0.0]) + noise * self.rng.standard_normal(3)
        stamp = BEGIN + round(1e9 * (t if stamp_s is None else stamp_s))
        return see_pose(self.estimator, place, from_yaw(np.asarray(yaw)), stamp)

    def imu(self, t: float) -> str | None:
        moving = t > 2.0
        yaw = self.at(t)[2]
        a = self.ACCELERATION if moving else 0.0
        force = np.array([a * math.cos(yaw), -a * math.sin(yaw), 0.0]) + REST
        rate = np.array([0.0, 0.0, self.RATE if moving else 0.0])
        return see_imu(self.estimator, ImuSample(force, rate), BEGIN + round(1e9 * t))

    def run(self, until: float, *, late_s: float = 0.0, every: int = 8, begin: float = 0.005) -> int:
        """Readings at 200 Hz, a pose with every `every`th, stamped and sent `late_s` after its capture.

        Returns:
            How many poses were not believed.
        """
        refused = 0
        for tick in range(round(begin / 0.005), round(until / 0.005) + 1):
            t = 0.005 * tick
            assert self.imu(t) is None
            captured = t - late_s
            if captured > 0.0 and tick % every == 0:
                refused += bool(self.pose(captured, stamp_s=t))
        return refused

    def velocity(self) -> np.ndarray:
        estimate = self.estimator.estimate()
        assert estimate is not None, self.estimator.problem
        return estimate.value.velocity_in_world


def test_velocity_is_right_to_centimetres_while_poses_come_at_25_hz():
    track = Track()
    assert track.run(4.0) == 0
    assert track.velocity()[0] == pytest.approx(0.4, abs=0.015)
    estimate = track.estimator.estimate()
    assert estimate.stamp_ns == BEGIN + 4_000 * MS
    assert float(estimate.value.yaw) == pytest.approx(0.6, abs=0.01)
    assert estimate.value.angular_velocity_in_body[2] == pytest.approx(0.3, abs=0.01)


def test_a_constant_latency_that_is_known_is_taken_off():
    known, unknown = Track(latency_s=0.1), Track(latency_s=0.0)
    assert known.run(4.0, late_s=0.1) == 0
    assert unknown.run(4.0, late_s=0.1) > 0  # what it sees and what it feels do not go together
    true = known.at(4.0)[0]
    assert known.estimator.estimate().value.position_in_world[0] == pytest.approx(true, abs=0.005)
    assert abs(unknown.estimator.estimate().value.position_in_world[0] - true) > 0.02


def test_poses_that_come_before_or_after_the_reading_of_their_time_give_one_and_the_same_estimate():
    first, second = Track(), Track()
    for track, pose_first in ((first, True), (second, False)):
        for tick in range(1, 600):
            t = 0.005 * tick
            steps = [lambda t=t, track=track: track.imu(t)]
            if tick % 8 == 0:
                steps.insert(0 if pose_first else 1, lambda t=t, track=track: track.pose(t, noise=0.0))
            for step in steps:
                assert step() is None
    assert first.velocity() == pytest.approx(second.velocity(), abs=1e-12)


def test_an_outlier_is_refused_and_does_not_move_the_estimate():
    track = Track()
    assert track.run(3.0) == 0
    before = track.velocity()
    assert "gate" in track.pose(3.001, off=0.3)
    assert track.estimator.outliers == 1
    assert track.velocity() == pytest.approx(before, abs=1e-3)


def test_outliers_that_agree_with_one_another_are_believed_in_the_end():
    track = Track()
    assert track.run(3.0) == 0
    answers = []
    for tick in range(601, 1000):
        track.imu(0.005 * tick)
        if tick % 8 == 0:
            answers.append(track.pose(0.005 * tick, off=0.3))
    believed = answers.index(None)
    assert all("gate" in answer for answer in answers[:believed])
    assert believed * 8 * 0.005 >= TO_BEGIN_ANEW_NS / 1e9
    assert answers[believed:] == [None] * (len(answers) - believed)
    assert track.estimator.epoch == 1


def test_a_gap_is_bridged_by_the_inertial_unit_and_then_declared_stale():
    track = Track()
    assert track.run(3.0) == 0
    spread = track.estimator.estimate().covariance[6, 6]
    for tick in range(601, 600 + round(SETTINGS.bridge_s / 0.005)):
        track.imu(0.005 * tick)
    bridged = track.estimator.estimate()
    t = 0.005 * tick
    assert bridged.value.position_in_world[0] == pytest.approx(track.at(t)[0], abs=0.01)
    assert bridged.covariance[6, 6] > spread  # and it says that it knows less
    for more in range(tick + 1, tick + 5):
        track.imu(0.005 * more)
    assert track.estimator.estimate() is None
    assert "no believable pose" in track.estimator.problem
    assert track.pose(0.005 * more) is None
    assert track.estimator.estimate() is not None


def test_without_an_inertial_unit_poses_alone_give_a_velocity():
    track = Track()
    for tick in range(1, 161):
        assert track.pose(0.025 * tick) is None
    assert track.velocity()[0] == pytest.approx(0.4, abs=0.05)


def test_there_is_no_estimate_before_the_velocity_is_known():
    track = Track()
    assert track.estimator.estimate() is None
    track.pose(0.01)
    assert track.estimator.estimate() is None
    assert "velocity" in track.estimator.problem


def test_a_bias_of_the_accelerometer_is_found():
    track = Track()
    for tick in range(1, 4000):
        t = 0.005 * tick
        see_imu(
            track.estimator, ImuSample(REST + np.array([0.05, 0.0, 0.0]), np.zeros(3)), BEGIN + round(1e9 * t)
        )
        if tick % 8 == 0:
            see_pose(track.estimator, np.zeros(3), from_yaw(np.asarray(0.0)), BEGIN + round(1e9 * t))
    assert abs(track.velocity()[0]) < 0.003


@pytest.mark.parametrize(
    ("position", "quat", "words"),
    [
        ([math.nan, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], "not finite"),
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 2.0], "norm"),
        ([0.0, 0.0, 0.0], [0.0, math.inf, 0.0, 1.0], "not finite"),
    ],
)
def test_a_senseless_pose_is_refused_with_its_reason(position, quat, words):
    track = Track()
    assert words in see_pose(track.estimator, np.array(position), np.array(quat), BEGIN)


def test_a_jump_of_time_begins_a_new_epoch_and_is_reported_once():
    track = Track()
    assert track.run(3.0) == 0
    stamp = BEGIN - 100_000 * MS
    assert "new epoch" in see_pose(track.estimator, np.zeros(3), from_yaw(np.asarray(0.0)), stamp)
    assert see_pose(track.estimator, np.zeros(3), from_yaw(np.asarray(0.0)), stamp + MS) is None
    assert track.estimator.epoch == 1


def test_stamps_that_do_not_advance_are_refused():
    track = Track()
    assert track.pose(1.0) is None
    assert "did not advance" in track.pose(1.0)


def test_covariances_are_true_to_the_errors():
    """Of the velocity, over many drives: the mean squared error in units of what is stated is about 1."""
    ratios = []
    for seed in range(6):
        track = Track(position_std=0.001, heading_std=0.001)
        track.rng = np.random.default_rng(seed)
        rng = np.random.default_rng(100 + seed)
        for tick in range(1, 700):
            t = 0.005 * tick
            force = REST + 0.0086 * rng.standard_normal(3)
            see_imu(track.estimator, ImuSample(force, np.zeros(3)), BEGIN + round(1e9 * t))
            if tick % 8 == 0:
                place = 0.001 * track.rng.standard_normal(3)
                see_pose(track.estimator, place, from_yaw(np.asarray(0.0)), BEGIN + round(1e9 * t))
        estimate = track.estimator.estimate()
        error = estimate.value.velocity_in_world[:2]
        ratios.append(float(error @ np.linalg.solve(estimate.covariance[6:8, 6:8], error)) / 2.0)
    assert np.mean(ratios) < 2.0  # never surer than it may be


numbers = st.floats(allow_nan=True, allow_infinity=True, width=32)
events = st.lists(
    st.tuples(st.booleans(), st.lists(numbers, min_size=7, max_size=7), st.integers(-(2**62), 2**62)),
    max_size=12,
)


@given(events=events)
@hypothesis_settings(max_examples=60, deadline=None)
def test_whatever_comes_an_estimate_is_finite_or_none(events):
    estimator = PlanarMotionEstimator(SETTINGS, LIMITS)
    for is_pose, values, stamp in events:
        with np.errstate(all="ignore"):
            if is_pose:
                see_pose(estimator, np.array(values[:3]), np.array(values[3:]), stamp)
            else:
                see_imu(estimator, ImuSample(np.array(values[:3]), np.array(values[3:6])), stamp)
            estimate = estimator.estimate()
        if estimate is not None:
            state = estimate.value
            parts = state.position_in_world, state.quat_xyzw, state.velocity_in_world
            assert all(np.isfinite(part).all() for part in parts)


def test_settings_without_meaning_are_refused_with_their_line(tmp_path):
    fields = dataclasses.asdict(SETTINGS) | {"gate": 0.0}
    text = "\n".join(f"{key}: {value}" for key, value in fields.items() if key != "title") + "\ntitle: t\n"
    (tmp_path / "bad.yaml").write_text(text)
    with pytest.raises(ConfigError, match="gate"):
        load_estimator(str(tmp_path / "bad.yaml"))


def attitude(track: Track, t: float, *, off: float = 0.0, covariance: np.ndarray | None = None) -> str | None:
    quat = from_yaw(np.asarray(track.at(t)[2] + off))
    return track.estimator.take("star_tracker", Reading(quat, BEGIN + round(1e9 * t), covariance))


def test_a_star_tracker_corrects_the_heading_between_poses():
    spread = []
    for tracks_stars in (False, True):
        track = Track()
        assert track.run(3.0) == 0
        for tick in range(601, 641):
            assert track.imu(0.005 * tick) is None
            if tracks_stars and tick % 20 == 0:
                assert attitude(track, 0.005 * tick, covariance=np.eye(3) * 1e-8) is None
        estimate = track.estimator.estimate()
        spread.append(math.sqrt(estimate.covariance[5, 5]))
        error = abs(float(estimate.value.yaw) - track.at(3.2)[2])
        assert error < 5.0 * spread[-1]
    assert spread[1] < 0.0003 < spread[0]


def test_a_star_tracker_far_off_is_an_outlier_and_before_a_pose_of_no_use():
    track = Track()
    assert attitude(track, 0.001) is None
    assert track.estimator.estimate() is None
    assert track.run(3.0) == 0
    before = float(track.estimator.estimate().value.yaw)
    assert "gate" in attitude(track, 3.0, off=0.5)
    assert (track.estimator.outliers, float(track.estimator.estimate().value.yaw)) == (1, before)
    wrong = Reading(np.array([0.0, 0.0, 0.0, 2.0]), BEGIN + 3_100 * MS)
    assert "norm" in track.estimator.take("star_tracker", wrong)


def test_an_estimate_is_predicted_to_a_later_time_without_a_trace():
    track = Track()
    assert track.run(3.0) == 0
    now, later = track.estimator.estimate(), track.estimator.estimate(BEGIN + 3_050 * MS)
    assert later.stamp_ns - now.stamp_ns == 50 * MS
    assert later.value.position_in_world[0] == pytest.approx(track.at(3.05)[0], abs=0.003)
    assert later.covariance[0, 0] > now.covariance[0, 0]
    again = track.estimator.estimate()
    assert (again.stamp_ns, again.value.position_in_world.tolist()) == (
        now.stamp_ns,
        now.value.position_in_world.tolist(),
    )
    assert track.estimator.estimate(BEGIN + 3_500 * MS) is None  # beyond what may be bridged


def test_a_reset_leaves_nothing_behind():
    track, fresh = Track(), Track()
    assert track.run(3.0) == 0
    track.pose(3.001, off=0.3)
    track.estimator.reset()
    track.rng = np.random.default_rng(1)
    assert (track.estimator.estimate(), track.estimator.outliers) == (None, 0)
    for one in (track, fresh):
        one.run(3.0)
    assert track.velocity().tolist() == fresh.velocity().tolist()


def test_readings_without_a_name_or_a_stamp_that_it_knows_are_refused():
    track = Track()
    assert "only mocap, imu, star_tracker" in track.estimator.take("sonar", Reading(1.0, BEGIN))
    assert "no stamp" in track.estimator.take("mocap", Reading(np.zeros(7)))


def test_a_file_of_an_unknown_kind_is_refused_with_its_line(tmp_path):
    (tmp_path / "other.yaml").write_text("title: t\nkind: planar_motoin\n")
    with pytest.raises(ConfigError, match=r"other.yaml:2: unknown kind .* Did you mean 'planar_motion'"):
        load_estimator(str(tmp_path / "other.yaml"))


def test_another_estimator_is_a_row_of_the_table(tmp_path, monkeypatch):
    """Settings, a class and what it takes: plans and files then know it."""

    @dataclasses.dataclass(frozen=True, kw_only=True)
    class MeanSettings(EstimatorSettings):
        kind: str = "mean_rate"
        readings: int

    made = []
    row = EstimatorKind(
        MeanSettings, lambda settings, robot: made.append((settings.readings, robot.name)), {"imu": IMU}, (ODOMETRY,)
    )  # fmt: skip
    monkeypatch.setitem(KINDS, "mean_rate", row)
    (tmp_path / "mean.yaml").write_text("title: t\nkind: mean_rate\nreadings: 5\nbridge_s: 1.0\n")
    make_estimator(str(tmp_path / "mean.yaml"), load_robot("turtlebot2"))
    assert made == [(5, "turtlebot2")]
    plan = RunPlan(
        "turtlebot2", "go_to_position", "classical", "mock", 10.0, guards=Guards(estimator=str(tmp_path / "mean.yaml"))
    )  # fmt: skip
    rows = system_rows(plan)
    assert (rows["estimator"].inputs, rows["estimator"].outputs) == (("imu/data",), ("odom",))
