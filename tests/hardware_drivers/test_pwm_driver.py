"""Valves that open by degrees, on the PWM channels of a chip that is a folder."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError, DeviceError
from fulmar_core.robots.robot_file import load_robot
from hardware_drivers.devices import make_device
from hardware_drivers.hardware import load_hardware
from hardware_drivers.presence import check_presence
from hardware_drivers.settings import PwmValves
from sim_nodes.emulators.pwm import PwmBank
from tests.hardware_drivers.bench import episode_at

ROBOT, HARDWARE = load_robot("cubesat_8"), load_hardware("cubesat_8")
ORDER = (3, 1, 0, 2, 7, 5, 6, 4)
PERIOD_NS = round(1e9 / HARDWARE.driver.frequency_hz)


@pytest.fixture
def rig(tmp_path):
    """Emulated valves in another order than their channels, and the driver of them."""
    channels = tuple(range(2, 10))
    bank = PwmBank(tmp_path / "pwmchip", channels=channels, order=ORDER)
    settings = replace(HARDWARE.driver, port=bank.address, channels=channels, order=ORDER)
    driver = make_device(ROBOT, replace(HARDWARE, driver=settings), port="", patience_s=0.0)
    driver.reset(episode_at(ROBOT, 0.0, 0.0, 0.0), seed=0)
    yield bank, driver
    driver.close()
    bank.close()


@pytest.mark.parametrize("thruster", range(8))
def test_each_thruster_opens_its_own_valve_as_far_as_is_commanded(rig, thruster):
    bank, driver = rig
    command = 0.37 * np.eye(8)[thruster]
    sample = driver.step(command)
    np.testing.assert_allclose(bank.command(0.0), command, atol=1e-7)
    assert (sample.odometry, sample.refusal) == (None, "")


def test_valves_are_closed_and_channels_off_when_the_driver_ends(rig, tmp_path):
    bank, driver = rig
    driver.step(np.ones(8))
    assert bank.command(0.0).tolist() == [1.0] * 8
    driver.close()
    assert not bank.command(0.0).any()
    assert {file.read_text() for file in (tmp_path / "pwmchip").glob("pwm*/enable")} == {"0"}


def test_a_duty_that_another_program_sets_is_a_refusal(rig, tmp_path):
    _, driver = rig
    driver.step(0.5 * np.ones(8))
    (tmp_path / "pwmchip" / "pwm4" / "duty_cycle").write_text("17")
    assert driver.step(0.5 * np.ones(8)).refusal.endswith(
        "pwm4 has not the duty that was set: another program?"
    )


def test_a_chip_keeps_a_valve_as_it_is_where_linux_refuses_the_duty(rig, tmp_path):
    bank, driver = rig
    driver.step(0.5 * np.ones(8))
    assert bank.command(0.0).tolist() == [0.5] * 8
    (tmp_path / "pwmchip" / "pwm4" / "duty_cycle").write_text(str(2 * PERIOD_NS))
    assert bank.command(0.0).tolist() == [0.5] * 8


def test_a_chip_or_a_channel_that_is_not_there_is_one_line(tmp_path):
    driver = replace(HARDWARE.driver, port=str(tmp_path / "none"))
    with pytest.raises(DeviceError, match=r"there is no such PWM chip\. PWM chips here"):
        check_presence(driver)
    with pytest.raises(DeviceError, match=r"there is no such PWM chip\. `ls /sys/class/pwm` lists them"):
        make_device(ROBOT, replace(HARDWARE, driver=driver), port="", patience_s=0.0)
    bank = PwmBank(tmp_path / "pwmchip", channels=range(4), order=range(4))
    with pytest.raises(DeviceError, match="the chip has no channel 4"):
        make_device(ROBOT, HARDWARE, port=bank.address, patience_s=0.0)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"channels": (0,) * 8}, "a channel of its own"),
        ({"order": (0,) * 8}, "'order' must hold each of 0 to 7 once"),
        ({"frequency_hz": 0.0}, "frequency_hz must be from 1 to 100000 Hz"),
    ],
)
def test_settings_that_no_chip_takes_are_refused(change, said):
    fields = {"kind": "pwm_valves", "port": "x", "channels": tuple(range(8)), "order": tuple(range(8))}
    with pytest.raises(ValueError, match=said):
        PwmValves(**{**fields, **change})


def test_valves_by_degrees_are_refused_by_a_driver_that_only_opens_and_closes(tmp_path):
    path = tmp_path / "wrong.yaml"
    lines = ", ".join(f"L{i}" for i in range(8))
    path.write_text(
        "title: t\nrobot: cubesat_8\n"
        f"driver: {{kind: gpio_valves, port: x, lines: [{lines}], order: [0, 1, 2, 3, 4, 5, 6, 7]}}\n"
    )
    with pytest.raises(ConfigError, match=r"only opens and closes, and these valves open by degrees\. Use"):
        load_hardware(str(path))
