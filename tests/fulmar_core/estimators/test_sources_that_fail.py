"""Motion capture and inertial units that freeze, stand or drift: what is not true is not believed, and is named."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fulmar_core.estimators.kinds import load_estimator, make_estimator
from fulmar_core.estimators.motion.frozen import POSE_FROZEN
from fulmar_core.estimators.motion.history import CONTRADICTION
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.states.rotation import from_yaw, multiply, rotate_inverse
from fulmar_core.wires.reading import Reading

pytest.importorskip("filterpy")
DT, POSE_EVERY = 0.02, 2
ROBOTS = {"mocap_imu": "floating_platform", "mocap_imu_3d": "spacecraft_16"}
KINDS = tuple(ROBOTS)
BRIDGE_S = load_estimator("mocap_imu").bridge_s
Change = Callable[[float, Any], Any]


class Body:
    """A body that is pushed about and turns, and what is measured of it with noise."""

    def __init__(self, kind: str, *, seed: int = 0, moves: bool = True, exact: bool = False) -> None:
        self.estimator = make_estimator(kind, load_robot(ROBOTS[kind]), exact_sensors=exact)
        self.gravity = np.array([0.0, 0.0, 9.81 if kind == "mocap_imu" else 0.0])
        self.rng, self.moves, self.exact = np.random.default_rng(seed), moves, exact
        self.space = kind == "mocap_imu_3d"
        self.time, self.yaw = 0.0, 0.0
        self.position, self.velocity = np.zeros(3), np.zeros(3)
        self.refusals: list[str | None] = []

    def noise(self, std: float, count: int = 3) -> np.ndarray:
        return np.zeros(count) if self.exact else std * self.rng.standard_normal(count)

    def run(self, seconds: float, *, pose: Change | None = None, imu: Change | None = None) -> float | None:
        """Let time pass with sources that change what they report; returns when there was no estimate first [s]."""
        blind = None
        for tick in range(1, round(seconds / DT) + 1):
            self.step()
            stamp, t = 1_000_000_000 + round(1e9 * self.time), DT * tick
            sample = ImuSample(
                rotate_inverse(self.quat, self.push) + self.gravity + self.noise(0.0086),
                np.array([0.0, 0.0, self.rate]) + self.noise(0.0012),
            )
            self.estimator.take("imu", Reading(sample if imu is None else imu(t, sample), stamp))
            if tick % POSE_EVERY == 0:
                seen = self.seen(self.position, self.quat)
                value = seen if pose is None else pose(t, seen)
                self.refusals.append(self.estimator.take("mocap", Reading(value, stamp)))
            if blind is None and self.estimator.estimate(stamp) is None:
                blind = t
        return blind

    @property
    def quat(self) -> np.ndarray:
        return np.asarray(from_yaw(np.asarray(self.yaw)))

    @property
    def push(self) -> np.ndarray:
        """Acceleration in the world [m/s²]."""
        t = self.time
        return self.moves * np.array([0.15 * np.cos(0.5 * t), 0.15 * np.sin(0.4 * t), 0.0])

    @property
    def rate(self) -> float:
        return self.moves * 0.3 * float(np.cos(0.7 * self.time))

    def step(self) -> None:
        self.time += DT
        self.position = self.position + DT * self.velocity + 0.5 * DT * DT * self.push
        self.velocity = self.velocity + DT * self.push
        self.yaw += DT * self.rate

    def seen(self, position: np.ndarray, quat: np.ndarray) -> np.ndarray:
        tilt = np.array([1.0, 1.0, 1.0]) if self.space else np.array([0.0, 0.0, 1.0])
        turned = multiply(quat, np.array([*(0.5 * tilt * self.noise(0.002)), 1.0]))
        return np.concatenate((position + self.noise(0.001), turned / np.linalg.norm(turned)))

    def standing(self) -> Change:
        """Poses that stay where they are now, with noise as fresh as ever."""
        position, quat = self.position, self.quat
        return lambda _t, _pose: self.seen(position, quat)

    @property
    def estimate(self) -> Any:
        return self.estimator.estimate(1_000_000_000 + round(1e9 * self.time))


def frozen() -> Change:
    """The first value, for ever."""
    kept: list[Any] = []

    def change(_t: float, value: Any) -> Any:
        kept.append(value)
        return kept[0]

    return change


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("moves", [True, False], ids=["moving", "standing"])
def test_sound_sources_are_believed_without_a_warning(kind, moves):
    body = Body(kind, moves=moves)
    body.run(1.0)
    assert body.run(5.0) is None
    assert (body.estimator.warnings(), body.estimator.outliers, body.estimator.epoch) == ((), 0, 0)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_sound_sources_are_believed_for_minutes(kind, seed):
    body = Body(kind, seed=seed)
    body.run(1.0)
    assert body.run(180.0) is None
    assert body.estimator.warnings() == ()


@pytest.mark.parametrize("kind", KINDS)
def test_a_pose_that_repeats_itself_is_refused_and_stale_within_the_bridge(kind):
    body = Body(kind)
    body.run(3.0)
    blind = body.run(1.0, pose=frozen())
    assert blind == pytest.approx(BRIDGE_S + POSE_EVERY * DT, abs=2 * DT)
    assert body.estimate is None
    assert body.estimator.problem == POSE_FROZEN
    assert body.estimator.warnings() == (POSE_FROZEN,)
    assert body.refusals[-1] == POSE_FROZEN


def test_motion_capture_that_measures_anew_is_believed_again():
    body = Body("mocap_imu")
    body.run(3.0)
    body.run(0.6, pose=frozen())
    assert body.estimate is None
    body.run(0.5)
    assert body.estimate is not None
    assert body.estimator.warnings() == ()


def test_a_pose_that_is_held_once_is_no_measurement_and_no_fault():
    body = Body("mocap_imu")
    body.run(3.0)
    assert body.run(2.5 * POSE_EVERY * DT, pose=frozen()) is None
    assert body.refusals[-2] is None
    assert "not measured anew" in body.refusals[-1]
    assert body.estimator.warnings() == ()


def test_sensors_without_noise_repeat_themselves_while_the_body_stands():
    body = Body("mocap_imu", moves=False, exact=True)
    body.run(1.0)
    assert body.run(3.0) is None
    assert body.estimator.warnings() == ()


@pytest.mark.parametrize("kind", KINDS)
def test_poses_that_stand_with_fresh_noise_while_the_body_moves_are_not_believed(kind):
    body = Body(kind)
    body.run(3.0)
    assert body.run(5.0, pose=body.standing()) < 1.5
    assert body.estimate is None
    assert body.estimator.problem == CONTRADICTION
    assert body.estimator.warnings() == (CONTRADICTION,)
    assert body.estimator.epoch == 0  # and nothing has begun anew from them


@pytest.mark.parametrize("kind", KINDS)
def test_inertial_readings_that_stand_with_fresh_noise_while_the_body_moves_are_not_believed(kind):
    body = Body(kind)
    body.run(3.0)

    def stands(_t: float, _sample: ImuSample) -> ImuSample:
        return ImuSample(body.gravity + body.noise(0.0086), body.noise(0.0012))

    assert body.run(4.0, imu=stands) < 2.5
    assert CONTRADICTION in body.estimator.warnings()


@pytest.mark.parametrize("kind", KINDS)
def test_a_heading_that_drifts_away_from_the_gyroscope_is_not_believed(kind):
    body = Body(kind)
    body.run(3.0)

    def drifts(t: float, pose: np.ndarray) -> np.ndarray:
        return np.concatenate((pose[:3], multiply(from_yaw(np.asarray(0.1 * t)), pose[3:])))

    assert body.run(5.0, pose=drifts) < 4.5
    assert CONTRADICTION in body.estimator.warnings()


@pytest.mark.parametrize("kind", KINDS)
def test_an_accelerometer_whose_bias_runs_away_is_not_believed(kind):
    body = Body(kind)
    body.run(3.0)

    def drifts(t: float, sample: ImuSample) -> ImuSample:
        return ImuSample(sample.specific_force + np.array([0.2 * t, 0.0, 0.0]), sample.angular_velocity)

    assert body.run(5.0, imu=drifts) < 4.5
    assert body.estimator.warnings()


@pytest.mark.slow
def test_a_bias_that_no_sound_sensor_has_is_named_though_it_is_followed():
    body = Body("mocap_imu", moves=False)
    body.run(3.0)

    def drifts(t: float, sample: ImuSample) -> ImuSample:
        return ImuSample(
            sample.specific_force + np.array([min(0.02 * t, 0.6), 0.0, 0.0]), sample.angular_velocity
        )

    body.run(30.0, imu=drifts)
    assert body.estimate is None
    assert any("accelerometer" in words or words == CONTRADICTION for words in body.estimator.warnings())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("number", "name"), enumerate(("accelerometer", "gyroscope")))
def test_a_bias_beyond_what_a_sound_sensor_has_leaves_no_estimate(kind, number, name, monkeypatch):
    body = Body(kind)
    body.run(3.0)
    settings, biases = body.estimator._settings, [0.0, 0.0]
    biases[number] = 1.01 * (settings.accelerometer_bias, settings.gyroscope_bias)[number]
    monkeypatch.setattr(type(body.estimator._filter), "biases", lambda _self: tuple(biases))
    assert body.estimate is None
    assert any(words.startswith(f"the bias of the {name} is beyond") for words in body.estimator.warnings())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("part", "words"),
    [
        ("specific_force", "the accelerometer repeats its reading: it is frozen"),
        ("angular_velocity", "the gyroscope repeats its reading: it is frozen"),
        ("both", "the inertial unit repeats its readings: it is frozen"),
    ],
)
def test_a_frozen_inertial_unit_is_named_and_poses_alone_go_on(kind, part, words):
    body = Body(kind)
    body.run(3.0)
    kept: list[ImuSample] = []

    def freezes(_t: float, sample: ImuSample) -> ImuSample:
        kept.append(sample)
        force = sample.specific_force if part == "angular_velocity" else kept[0].specific_force
        rate = sample.angular_velocity if part == "specific_force" else kept[0].angular_velocity
        return ImuSample(force, rate)

    body.run(2.0, imu=freezes)
    assert body.estimator.warnings() == (words,)
    state = body.estimate.value
    assert state.velocity_in_world == pytest.approx(body.velocity, abs=0.1)


@pytest.mark.parametrize("kind", KINDS)
def test_after_a_contradiction_sources_that_agree_on_a_motion_are_believed_again(kind):
    body = Body(kind)
    body.run(3.0)
    body.run(2.0, pose=body.standing())
    assert body.estimate is None
    body.run(4.0)
    assert body.estimator.epoch == 1
    assert body.estimate is not None
    assert body.estimator.warnings() == ()


def test_after_a_contradiction_sources_that_only_stand_are_not_believed_again():
    body = Body("mocap_imu")
    body.run(3.0)
    body.run(2.0, pose=body.standing())
    body.moves, body.velocity = False, np.zeros(3)
    body.run(5.0, pose=body.standing())
    assert body.estimate is None
    assert body.estimator.epoch == 0


def creeps(speed: float) -> Change:
    return lambda t, pose: np.concatenate(([pose[0] + speed * t], pose[1:]))


def turns(rate: float) -> Change:
    return lambda t, pose: np.concatenate((pose[:3], multiply(from_yaw(np.asarray(rate * t)), pose[3:])))


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("fault", [creeps(0.2), turns(0.1)], ids=["creeps", "drifts"])
def test_poses_that_creep_or_drift_on_are_not_believed_again(kind, seed, fault):
    body = Body(kind, seed=seed)
    body.run(3.0)
    body.run(30.0, pose=fault)
    assert body.estimate is None
    assert body.estimator.warnings() == (CONTRADICTION,)


def test_a_place_that_creeps_on_is_not_believed_again():
    body = Body("mocap_imu")
    body.velocity = np.array([0.5, 0.0, 0.0])
    body.run(3.0)
    body.run(7.0, pose=creeps(0.2))
    assert (body.estimate, body.estimator.epoch) == (None, 0)


def test_poses_that_crept_are_believed_once_they_move_as_the_body_does():
    body = Body("mocap_imu")
    body.run(3.0)
    body.run(2.0, pose=creeps(0.2))
    assert body.estimate is None
    body.run(5.0)
    assert body.estimator.warnings() == ()
    assert body.estimate.value.position_in_world == pytest.approx(body.position, abs=0.02)


@pytest.mark.parametrize("crept", [0.0, 0.2], ids=["sound", "creeping"])
def test_long_after_a_contradiction_a_turn_and_a_hold_tell_sound_poses_from_creeping_ones(crept):
    body = Body("mocap_imu", moves=False)
    body.run(1.0)
    body.run(12.0, pose=creeps(0.2))
    body.moves = True
    body.run(5.0, pose=creeps(crept))
    assert body.estimate is None  # inertial readings no longer know the velocity
    body.moves, body.velocity = False, np.zeros(3)
    body.run(4.0, pose=creeps(crept))
    assert (body.estimator.epoch, bool(body.estimator.warnings())) == ((1, False) if not crept else (0, True))
