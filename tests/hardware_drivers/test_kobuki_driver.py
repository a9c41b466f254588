"""The Kobuki driver against the emulated base, byte for byte over a pseudo-terminal."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from fulmar_core.config.errors import DeviceError
from fulmar_core.states.planar import PlanarState
from hardware_drivers.driver_backend import backend_of
from hardware_drivers.kobuki_driver import LIFTED_S, KobukiDriver
from hardware_drivers.settings import Kobuki
from sim_nodes.emulators.device import PtyLink
from sim_nodes.emulators.kobuki import TIMEOUT_S, KobukiEmulator
from tests.hardware_drivers.bench import Bench, episode_at, until

START = (1.0, -0.5, 2.0)


class RollingWheels:
    """Angles of the wheels of a base that never slips, summed up from its speeds."""

    def __init__(self, backend) -> None:
        self.backend, self.angles = backend, np.zeros(2)

    def roll(self) -> None:
        state = self.backend._state[0]
        ahead, _ = state.velocity_in_body
        motion = np.array([float(ahead), float(state.yaw_rate)])
        self.angles += 0.02 * self.backend.robot.actuators.wheel_speeds(motion)

    def __call__(self) -> tuple[float, float]:
        return float(self.angles[0]), float(self.angles[1])


@pytest.fixture
def bench(tmp_path):
    link, wheels = PtyLink(tmp_path / "serial"), []

    def device(backend):
        wheels.append(RollingWheels(backend))
        return KobukiEmulator(link, wheels[0])

    bench = Bench("turtlebot2", device, start=START, each_tick=lambda: wheels[0].roll())
    yield bench
    bench.stop()


@pytest.fixture
def driver(bench):
    settings = Kobuki("kobuki", bench.device.address)
    driver = backend_of(bench.robot, KobukiDriver(bench.robot, settings, patience_s=5.0))
    driver.reset(episode_at(bench.robot, *START), seed=0)
    yield driver
    driver.close()


def drive(driver, command, seconds):
    """Send a command fifty times a second."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        sample = driver.step(np.array(command))
        time.sleep(0.02)
    return sample


def test_odometry_follows_the_base_through_an_arc(bench, driver):
    for command in ((0.4, 0.0), (0.3, 0.8), (-0.3, -0.5), (0.0, 0.0)):
        sample = drive(driver, command, 1.0)
    found, true = PlanarState.from_rigid(sample.odometry), PlanarState.from_rigid(bench.sample.truth)
    assert np.hypot(true.x - START[0], true.y - START[1]) > 0.2
    assert np.hypot(found.x - true.x, found.y - true.y) < 0.02
    assert abs(np.remainder(found.yaw - true.yaw + np.pi, 2 * np.pi) - np.pi) < np.radians(1.0)


def test_samples_carry_the_time_of_capture_and_no_accelerometer(driver):
    first, second = driver.step(np.zeros(2)), drive(driver, (0.0, 0.0), 0.3)
    assert 0 <= time.time_ns() - second.stamp_ns < 100_000_000
    assert second.stamp_ns > first.stamp_ns
    assert np.isnan(second.imu.specific_force).all()


@pytest.mark.parametrize("what", ["bumpers", "cliffs"])
def test_what_touches_stops_the_base_which_may_only_back_off(bench, driver, what):
    drive(driver, (0.3, 0.0), 0.6)
    setattr(bench.device, what, 2)
    until(lambda: not driver.step(np.array([0.3, 0.5])).applied.any())
    until(lambda: not bench.command.any())
    assert driver.step(np.array([-0.1, 0.5])).applied.tolist() == [-0.1, 0.0]
    assert "only backs off" in driver.health()["warning"]


@pytest.mark.parametrize("frozen", [0, 1])
def test_an_encoder_that_stands_while_its_wheel_is_commanded_ends_the_run(bench, driver, frozen):
    turning = bench.device._wheels
    drive(driver, (0.2, 0.0), 0.3)
    stood = turning()[frozen]
    bench.device._wheels = lambda: tuple(stood if i == frozen else angle for i, angle in enumerate(turning()))
    with pytest.raises(DeviceError, match="its encoder has stood for 1 s"):
        drive(driver, (0.2, 0.0), 3.0)


def test_a_base_that_is_commanded_to_stop_may_stand(driver):
    drive(driver, (0.2, 0.0), 0.3)
    drive(driver, (0.0, 0.0), 1.5)
    assert drive(driver, (0.2, 0.0), 0.3).odometry is not None


def test_a_wheel_in_the_air_stops_everything(bench, driver):
    bench.device.wheel_drops = 1
    until(lambda: not driver.step(np.array([-0.3, 0.0])).applied.any())
    assert "hangs in the air" in driver.health()["warning"]


def test_counts_that_jump_are_refused_and_end_the_reports_where_they_stay(bench, driver):
    """As after the base was switched off and on: its encoders begin at zero."""
    drive(driver, (0.2, 0.0), 0.3)
    turning = bench.device._wheels
    bench.device._wheels = lambda: tuple(angle + 40.0 for angle in turning())
    with pytest.raises(DeviceError, match="refused, the last: a wheel's count jumped"):
        drive(driver, (0.0, 0.0), 2.0)


def test_a_wrong_count_in_one_report_moves_nothing(bench, driver):
    before = drive(driver, (0.0, 0.0), 0.2).odometry.position_in_world
    turning, wrong = bench.device._wheels, iter([True])
    bench.device._wheels = lambda: tuple(angle + 40.0 * next(wrong, False) for angle in turning())
    until(lambda: drive(driver, (0.0, 0.0), 0.02) and driver.health()["refused_reports"] == "1")
    after = drive(driver, (0.0, 0.0), 0.2).odometry.position_in_world
    assert after == pytest.approx(before, abs=0.01)


def test_a_base_that_is_lifted_is_a_refusal_and_one_on_a_threshold_is_none(bench, driver):
    bench.device.wheel_drops = 1
    assert drive(driver, (0.2, 0.0), 0.5 * LIFTED_S).refusal == ""
    bench.device.wheel_drops = 0
    assert drive(driver, (0.2, 0.0), 0.2).refusal == ""
    bench.device.wheel_drops = 3
    until(lambda: "it was lifted" in drive(driver, (0.2, 0.0), 0.02).refusal, timeout_s=LIFTED_S + 1.0)
    bench.device.wheel_drops = 0
    until(lambda: not drive(driver, (0.2, 0.0), 0.02).refusal)


def test_a_base_slows_down_as_fast_as_it_may_and_no_faster(bench, driver):
    """By what the base understood, while its driver makes it safe from nearly full speed."""
    drive(driver, (0.4, 0.0), 0.3)
    seen, over = [], threading.Event()

    def watch() -> None:
        while not over.wait(0.002):
            seen.append((time.monotonic(), bench.command[0]))
        seen.append((time.monotonic(), bench.command[0]))  # with the last, which ended the watch

    watcher = threading.Thread(target=watch)
    watcher.start()
    driver.make_safe()
    until(lambda: not bench.command.any())
    over.set()
    watcher.join()
    speeds = np.array([speed for _, speed in seen])
    slew = bench.robot.actuators.response.slew[0]
    assert (np.diff(speeds) <= 0.0).all()
    assert len(set(speeds.tolist())) > 10
    ended = next(at for at, speed in seen if speed == 0.0)
    assert 0.3 / slew < ended - seen[0][0] < 0.4 / slew + 0.3


def test_what_touches_stops_it_at_once(bench, driver):
    drive(driver, (0.4, 0.0), 0.3)
    bench.device.wheel_drops = 1
    until(lambda: "hangs" in driver.health()["warning"])
    stopping = threading.Thread(target=driver.make_safe)
    stopping.start()
    until(lambda: not bench.command.any(), timeout_s=0.2)
    stopping.join()


def test_overcurrent_of_a_wheel_is_reported(bench, driver):
    bench.device.overcurrent = 1
    until(lambda: "too much current" in driver.health()["warning"])
    assert driver.health()["overcurrent"] == "1"


def test_closing_stops_the_base(bench, driver):
    drive(driver, (0.3, 0.0), 0.3)
    assert bench.command.any()
    driver.close()
    until(lambda: not bench.command.any(), timeout_s=0.5 * TIMEOUT_S)


def test_a_silent_driver_leaves_the_base_to_its_own_timeout(bench, driver):
    drive(driver, (0.3, 0.0), 0.3)
    silent = time.monotonic()
    until(lambda: not bench.command.any())
    assert 0.8 * TIMEOUT_S < time.monotonic() - silent < TIMEOUT_S + 0.3


def test_a_base_that_falls_silent_is_an_error_not_old_odometry(bench, driver):
    bench.device.mute = True
    with pytest.raises(DeviceError, match=r"no report for 3\d\d ms"):
        drive(driver, (0.0, 0.0), 1.0)


def test_a_port_where_nobody_speaks_is_refused_with_a_hint(tmp_path):
    link = PtyLink(tmp_path / "serial")
    with pytest.raises(DeviceError, match=r"said nothing that can be read.*Is it switched on"):
        KobukiDriver(_robot(), Kobuki("kobuki", link.address), patience_s=0.3)
    link.close()


def test_a_port_that_does_not_exist_is_refused_with_a_hint(tmp_path):
    with pytest.raises(DeviceError, match=r"cannot be opened.*Is the device connected"):
        KobukiDriver(_robot(), Kobuki("kobuki", str(tmp_path / "none")), patience_s=0.0)


def _robot():
    from fulmar_core.robots.robot_file import load_robot

    return load_robot("turtlebot2")
