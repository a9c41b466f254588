"""Stars, event cameras, and the turn rate that their events give."""

from __future__ import annotations

import contextlib
import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fulmar_core.dynamics.sky.event_sensor import EventSensor
from fulmar_core.dynamics.sky.events import Events, joined, no_events
from fulmar_core.estimators.event_rate.contrast import fit_rate
from fulmar_core.estimators.event_rate.estimator import EventRateEstimator
from fulmar_core.estimators.event_rate.local_flow import local_flow, rate_of_flow
from fulmar_core.estimators.event_rate.star_tracks import find_tracks
from fulmar_core.estimators.kinds import load_estimator
from fulmar_core.robots.sensors.catalogue import FOLDER, Stars, load_stars
from fulmar_core.robots.sensors.event_camera import EventSensorSpec
from fulmar_core.robots.sensors.star_camera import StarCamera, render
from fulmar_core.wires.reading import Reading

CAMERA = StarCamera()
SECOND_CAMERA = StarCamera(mounting=(math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)))
QUAT = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_quat()
WINDOW = 200_000_000  # ns
QUIET = EventSensorSpec(noise_hz=0.0, jitter_s=0.0, threshold_std=0.0)
RATE = np.radians([0.4, -0.3, 0.5])
SOLVER = """
import json, math, sys
import numpy as np
np.math = math  # the solver is older than numpy 2
sys.path.insert(0, sys.argv[1])
from PIL import Image
import tetra3
image = Image.fromarray(np.load(sys.argv[2]))
centroids = tetra3.get_centroids_from_image(image)
found = tetra3.Tetra3().solve_from_centroids(
    centroids[:30], image.size[::-1], fov_estimate=12.0, fov_max_error=1.0
)
print(json.dumps({key: found[key] for key in ("RA", "Dec", "Roll", "FOV")}))
"""


def watched(rate, spec=EventSensorSpec(), camera=CAMERA, *, seed=1, before=True, stars=None):
    """Events of a window; pixels have watched before it."""
    sensor = EventSensor(camera, spec, stars or load_stars())
    sensor.reset(seed, 0)
    if before:
        start = (Rotation.from_quat(QUAT) * Rotation.from_rotvec(-0.2 * np.asarray(rate))).as_quat()
        sensor.expose(start, rate, 0, WINDOW)
    return sensor.expose(QUAT, rate, 0, WINDOW)


class TestStars:
    """Catalogue, projection and image."""

    def test_the_catalogue_holds_the_brightest_star_where_it_is(self):
        stars = load_stars()
        sirius = np.radians([101.287, -16.716])
        there = [
            np.cos(sirius[1]) * np.cos(sirius[0]),
            np.cos(sirius[1]) * np.sin(sirius[0]),
            np.sin(sirius[1]),
        ]
        assert stars.magnitudes[0] == pytest.approx(-1.44, abs=0.01)
        assert np.degrees(np.arccos(stars.directions[0] @ there)) < 0.02
        assert 15_000 < len(stars.brighter_than(7.0)) < 16_000

    def test_a_star_moves_as_the_motion_field_says(self):
        near = CAMERA.near(load_stars(), CAMERA.axes_in_world(QUAT))
        places = CAMERA.project(near.directions, CAMERA.axes_in_world(QUAT))
        dt = 1e-4
        later = (Rotation.from_quat(QUAT) * Rotation.from_rotvec(dt * RATE)).as_quat()
        moved = (CAMERA.project(near.directions, CAMERA.axes_in_world(later)) - places) / dt
        inside = CAMERA.is_inside(places)
        np.testing.assert_allclose(
            moved[inside], (CAMERA.motion_field(places) @ RATE)[inside], rtol=0, atol=0.01
        )

    def test_a_rendered_image_is_solved_by_another_solver_to_a_pixel(self, tmp_path):
        camera = StarCamera(fov_deg=12.0, psf_px=1.5)
        image = render(camera, load_stars(), QUAT, background=5.0, noise=0.3)
        np.save(tmp_path / "sky.npy", np.clip(2.0 * image, 0, 255).astype(np.uint8))
        command = [sys.executable, "-c", SOLVER, str(FOLDER), str(tmp_path / "sky.npy")]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        assert done.returncode == 0, done.stderr
        found = __import__("json").loads(done.stdout.strip().splitlines()[-1])
        assert found["RA"] is not None, "the solver found no match"
        ra, dec = np.radians([found["RA"], found["Dec"]])
        theirs = np.array([np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)])
        ours = camera.axes_in_world(QUAT)[:, 2]
        pixel = 1.0 / camera.focal_px
        assert np.arccos(np.clip(ours @ theirs, -1.0, 1.0)) < pixel
        assert found["FOV"] == pytest.approx(12.0, abs=0.02)


class TestSensor:
    """Pixels."""

    def test_a_seed_gives_the_same_events_and_another_one_others(self):
        one, two, other = (watched(RATE, seed=s) for s in (1, 1, 2))
        np.testing.assert_array_equal(one.t, two.t)
        assert len(other) != len(one) or (other.t != one.t).any()

    def test_a_body_at_rest_gives_noise_alone_at_its_rate(self):
        events = watched(np.zeros(3))
        expected = 0.1 * 1024 * 1024 * 0.2
        assert abs(len(events) - expected) < 5.0 * math.sqrt(expected)
        assert len(watched(np.zeros(3), QUIET)) == 0

    def test_events_lie_on_the_way_of_stars_bright_ahead_and_dark_behind(self):
        events = watched(np.radians([0.0, 0.5, 0.0]), QUIET)
        assert len(events) > 1000
        stars = CAMERA.near(load_stars(), CAMERA.axes_in_world(QUAT), spare_deg=0.2)
        places = CAMERA.project(stars.directions, CAMERA.axes_in_world(QUAT))
        speed = (CAMERA.motion_field(places) @ np.radians([0.0, 0.5, 0.0]))[:, 0].mean()
        ahead = []
        for p in (0, 1):
            some = events.p == p
            now = np.stack((events.x[some], events.y[some]), axis=-1) - np.stack(
                (speed * events.t[some] / 1e9, np.zeros(some.sum())), axis=-1
            )
            apart = now[:, None] - places[None]
            nearest = np.argmin(np.linalg.norm(apart, axis=-1), axis=1)
            offset = apart[np.arange(len(now)), nearest]
            assert np.median(np.linalg.norm(offset, axis=-1)) < 3.0
            ahead.append(np.median(offset[:, 0]) * np.sign(speed))
        assert ahead[1] > 0.3 > -0.3 > ahead[0]

    def test_a_higher_threshold_and_a_longer_rest_give_fewer_events(self):
        usual = len(watched(RATE, QUIET))
        assert len(watched(RATE, replace(QUIET, threshold=0.5))) < 0.7 * usual
        assert len(watched(RATE, replace(QUIET, refractory_s=0.05))) < 0.7 * usual

    def test_hot_pixels_report_at_their_own_rate(self):
        events = watched(np.zeros(3), replace(QUIET, hot_pixels=3, hot_hz=1000.0))
        assert 400 < len(events) < 800
        assert len(np.unique(events.x.astype(int) * 1024 + events.y)) <= 3

    def test_a_second_of_sky_takes_less_than_a_second(self):
        """A sanity limit ten times above what it takes; `fulmar benchmark events` measures it."""
        import time

        sensor = EventSensor(CAMERA, EventSensorSpec(), load_stars())
        began = time.process_time()
        sensor.expose(QUAT, np.radians([0.1, 0.1, 0.0]), 0, 5 * WINDOW)
        assert time.process_time() - began < 5.0

    def test_events_join_and_split_by_time(self):
        one = watched(RATE)
        first, second = one.between(0, WINDOW // 2), one.between(WINDOW // 2, 2 * WINDOW)
        again = joined([second, first])
        np.testing.assert_array_equal(again.t, one.t)
        assert len(no_events(4, 4)) == 0


class TestRate:
    """From events to a turn rate."""

    @pytest.mark.parametrize("degrees", [0.1, 0.6, 2.0])
    def test_two_cameras_know_every_axis(self, degrees):
        rate = np.radians(degrees) * np.array([0.6, -0.5, 0.62])
        tracks = [find_tracks(watched(rate, camera=c), 0, WINDOW) for c in (CAMERA, SECOND_CAMERA)]
        fit = fit_rate(tracks, (CAMERA, SECOND_CAMERA))
        assert np.degrees(np.abs(fit.rate - rate)).max() < 0.0275
        error = fit.rate - rate
        assert error @ np.linalg.solve(fit.covariance, error) < 30.0

    def test_one_camera_knows_little_about_its_boresight_and_says_so(self):
        tracks = find_tracks(watched(RATE), 0, WINDOW)
        fit = fit_rate([tracks], [CAMERA])
        std = np.sqrt(np.diag(fit.covariance))
        assert std[2] > 5.0 * max(std[0], std[1])
        np.testing.assert_allclose(np.degrees(fit.rate - RATE)[:2], 0.0, atol=0.0192)
        assert abs(np.degrees(fit.rate - RATE)[2]) < 0.306

    def test_local_flow_finds_it_too(self):
        tracks = find_tracks(watched(RATE), 0, WINDOW)
        found, information, _ = rate_of_flow(local_flow(tracks), CAMERA)
        np.testing.assert_allclose(np.degrees(found - RATE)[:2], 0.0, atol=0.03)
        assert np.linalg.eigvalsh(information)[0] > 0.0

    def test_noise_and_hot_pixels_make_no_tracks(self):
        events = watched(np.zeros(3), EventSensorSpec(hot_pixels=20, hot_hz=500.0))
        tracks = find_tracks(events, 0, WINDOW)
        assert tracks.count == 0
        assert tracks.noise_hz == pytest.approx(0.1, rel=0.1)
        assert fit_rate([tracks], [CAMERA]) is None


def packets(rate, seconds, *, begin_ns=0, spec=EventSensorSpec(), camera=CAMERA, stars=None):
    """Packets of a tenth of a second of a body that turns steadily, each with its end."""
    sensor = EventSensor(camera, spec, stars or load_stars())
    sensor.reset(3, 0)
    quat = Rotation.from_quat(QUAT)
    for k in range(round(10 * seconds)):
        start = begin_ns + k * 100_000_000
        yield start + 100_000_000, sensor.expose(quat.as_quat(), rate, start, 100_000_000)
        quat = quat * Rotation.from_rotvec(0.1 * np.asarray(rate))


def an_estimator(count=1):
    return EventRateEstimator(load_estimator("event_rate"), (CAMERA, SECOND_CAMERA)[:count])


def fed(estimator, rate, seconds, **how):
    last = 0
    for end_ns, packet in packets(rate, seconds, **how):
        problem = estimator.take("events", Reading(packet, end_ns))
        assert problem is None
        last = end_ns
    return last


class TestEstimator:
    """Windows as packets come."""

    def test_it_estimates_window_after_window(self):
        estimator = an_estimator()
        last = fed(estimator, RATE, 1.0)
        estimate = estimator.estimate()
        assert 0 < last - estimate.stamp_ns <= 2 * WINDOW
        np.testing.assert_allclose(np.degrees(estimate.value - RATE)[:2], 0.0, atol=0.0192)
        status = estimator.status()
        assert int(status["stars"]) > 10
        assert estimator.problem == ""

    def test_at_rest_it_gives_an_upper_bound_instead_of_a_rate(self):
        estimator = an_estimator()
        fed(estimator, np.radians([0.0007, 0.0007, 0.0]), 1.4)
        assert estimator.estimate() is None
        assert 0.001 < np.degrees(estimator.bound) < 0.05
        assert "turns across its boresights by less than" in estimator.problem
        assert "rate_at_most_deg_s" in estimator.status()

    def test_the_last_rate_ages_and_is_withdrawn(self):
        estimator = an_estimator()
        last = fed(estimator, RATE, 0.6)
        assert estimator.estimate() is not None
        empty = no_events(1024, 1024)
        for k in range(1, 40):
            estimator.take("events", Reading(empty, last + k * 100_000_000))
        assert estimator.estimate() is None
        assert "no events in this window" in estimator.problem

    def test_one_star_alone_is_too_few(self):
        near = CAMERA.near(load_stars(), CAMERA.axes_in_world(QUAT))
        places = CAMERA.project(near.directions, CAMERA.axes_in_world(QUAT))
        middle = int(np.argmin(np.linalg.norm(places - 511.5, axis=1)))
        single = Stars(near.directions[middle : middle + 1], near.magnitudes[middle : middle + 1])
        estimator = an_estimator()
        fed(estimator, np.radians([0.3, 0.3, 0.0]), 1.2, stars=single)
        assert estimator.estimate() is None
        assert "1 stars move in this window: too few" in estimator.problem
        assert estimator.status()["not_observable"] == "x, y, z"

    def test_packets_of_another_camera_or_out_of_order_are_refused_in_words(self):
        estimator = an_estimator()
        last = fed(estimator, RATE, 0.4)
        event = np.zeros(1)
        small = Events(*(event.astype(t) for t in (np.uint16, np.uint16, np.uint64, np.uint8)), 640, 480)
        assert "comes from a camera of 640 × 480 pixels" in estimator.take("events", Reading(small, last + 1))
        unknown = replace(small, x=np.array([1279], dtype=np.uint16), width=0, height=0)
        assert "of a camera of another size" in estimator.take("events", Reading(unknown, last + 1))
        good = no_events(1024, 1024)
        assert "is out of order: 0.1 s before" in estimator.take("events", Reading(good, last - 100_000_000))
        backwards = replace(
            small, x=np.zeros(2, np.uint16), y=np.zeros(2, np.uint16), t=np.array([5, 1], np.uint64),
            p=np.zeros(2, np.uint8), width=1024, height=1024,
        )  # fmt: skip
        assert "not in the order of time" in estimator.take("events", Reading(backwards, last + 1))
        assert "not known here" in estimator.take("image", Reading(good, last + 1))

    def test_a_second_camera_that_falls_silent_does_not_stop_the_first(self):
        estimator = an_estimator(2)
        fed(estimator, RATE, 1.4)
        assert estimator.estimate() is not None

    def test_a_jump_of_time_begins_a_new_epoch(self):
        estimator = an_estimator()
        last = fed(estimator, RATE, 0.4)
        assert "jumped" in estimator.take("events", Reading(no_events(1024, 1024), last + 3600 * 10**9))
        assert (estimator.epoch, estimator.estimate()) == (1, None)


def test_cameras_and_pixels_that_cannot_be_are_refused():
    for change, said in (
        ({"fov_deg": 0.0}, "a field of view"),
        ({"mounting": (0, 0, 0, 2)}, "unit quaternion"),
    ):
        with pytest.raises(ValueError, match=said):
            replace(CAMERA, **change)
    with pytest.raises(ValueError, match="threshold and background"):
        EventSensorSpec(threshold=0.0)
    with contextlib.suppress(ValueError):
        EventSensorSpec(noise_hz=-1.0)
        pytest.fail("a negative noise was taken")


class TestChangingRates:
    """Bodies that begin to turn."""

    @pytest.mark.parametrize("degrees", [0.02, 1.0])
    def test_a_body_that_turns_faster_and_faster_from_rest_gets_the_rate_of_each_middle(self, degrees):
        change = np.radians(degrees) * np.array([0.6, -0.5, 0.62])
        cameras = (CAMERA, SECOND_CAMERA)
        estimator = EventRateEstimator(load_estimator("event_rate"), cameras)
        sensors = [
            EventSensor(each, EventSensorSpec(), load_stars(), name=str(k)) for k, each in enumerate(cameras)
        ]
        for number, sensor in enumerate(sensors):
            sensor.reset(7, number)
        attitude, seen = Rotation.from_quat(QUAT), {}
        for step in range(24):
            rate, begin, length = change * (0.05 * step + 0.025), step * 50_000_000, 50_000_000
            for name, sensor in zip(("events", "events_2"), sensors, strict=True):
                packet = sensor.expose(attitude.as_quat(), rate, begin, length)
                assert estimator.take(name, Reading(packet, begin + length)) is None
            attitude = attitude * Rotation.from_rotvec(0.05 * rate)
            estimate = estimator.estimate()
            if estimate is not None:
                error = estimate.value - change * estimate.stamp_ns / 1e9
                assert np.linalg.norm(estimate.value) < np.radians(2.0)
                seen[estimate.stamp_ns] = error @ np.linalg.solve(estimate.covariance, error)
        assert len(seen) >= 3
        assert np.median(list(seen.values())) < 7.8  # 95 % of chi-squared with 3 degrees of freedom
        assert list(seen.values())[-1] < 16.3

    def test_packets_that_do_not_come_are_counted(self):
        estimator = EventRateEstimator(load_estimator("event_rate"), (CAMERA,))
        for tenth in (1, 2, 3, 6, 7, 9):
            reading = Reading(no_events(CAMERA.width, CAMERA.height), tenth * 100_000_000)
            assert estimator.take("events", reading) is None
        assert estimator.status()["packets_lost"] == "3"

    def test_stars_that_hardly_move_give_a_bound_and_no_rate(self):
        estimator = EventRateEstimator(load_estimator("event_rate"), (CAMERA,))
        rate = np.radians([0.001, -0.001, 0.0])
        for step in range(6):
            packet = watched(rate, seed=step)
            shifted = replace(packet, t=packet.t + np.uint64(step * WINDOW))
            estimator.take("events", Reading(shifted, (step + 1) * WINDOW))
            assert estimator.estimate() is None
        assert estimator.bound is not None or "too few" in estimator.problem
