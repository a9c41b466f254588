"""Valves that open by degrees, on the PWM channels of a chip that is a folder."""

from __future__ import annotations

import errno
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError, DeviceError
from fulmar_core.robots.robot_file import load_robot
from hardware_drivers import pwm_driver
from hardware_drivers.devices import make_device
from hardware_drivers.hardware import load_hardware
from hardware_drivers.presence import check_presence
from hardware_drivers.settings import PwmValves
from sim_nodes.emulators.pwm import PwmBank, takes
from tests.hardware_drivers.bench import episode_at

ROBOT, HARDWARE = load_robot("cubesat_8"), load_hardware("cubesat_8")
ORDER = (3, 1, 0, 2, 7, 5, 6, 4)


CHANNELS = tuple(range(2, 10))
PERIOD_NS = round(1e9 / HARDWARE.driver.frequency_hz)


@pytest.fixture
def broken(monkeypatch):
    """Files of which none takes a number, as `pwm4/duty_cycle`; the others take what Linux takes."""
    names, write = set(), pwm_driver._write

    def checked_write(file, number):
        if f"{file.parent.name}/{file.name}" in names:
            raise OSError(errno.EIO, "no answer", str(file))
        state = {name: number_in(file.parent / name) for name in ("period", "duty_cycle")} | {
            file.name: number
        }
        if not takes(state["period"], state["duty_cycle"]):
            raise OSError(errno.EINVAL, "Invalid argument", str(file))
        write(file, number)

    monkeypatch.setattr(pwm_driver, "_write", checked_write)
    return names


def number_in(file):
    return int(file.read_text())


def made(bank, patience_s=0.0):
    """The driver of the valves of a chip."""
    settings = replace(HARDWARE.driver, port=bank.address, channels=CHANNELS, order=ORDER)
    return make_device(ROBOT, replace(HARDWARE, driver=settings), port="", patience_s=patience_s)


@pytest.fixture
def bank(tmp_path):
    """Emulated valves in another order than their channels."""
    bank = PwmBank(tmp_path / "pwmchip", channels=CHANNELS, order=ORDER)
    yield bank
    bank.close()


@pytest.fixture
def rig(bank, broken):
    """Emulated valves, and the driver of them."""
    driver = made(bank)
    driver.reset(episode_at(ROBOT, 0.0, 0.0, 0.0), seed=0)
    yield bank, driver
    broken.clear()
    driver.close()


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


def test_a_valve_that_another_program_opens_is_closed_by_the_next_safe_command(rig, tmp_path):
    bank, driver = rig
    driver.step(np.zeros(8))
    (tmp_path / "pwmchip" / "pwm4" / "duty_cycle").write_text(str(PERIOD_NS))
    assert "pwm4 has not the duty" in driver.step(np.zeros(8)).refusal
    assert driver.step(np.zeros(8)).refusal == ""
    assert not bank.command(0.0).any()


def test_a_channel_that_fails_leaves_no_other_valve_open(rig, broken):
    bank, driver = rig
    driver.step(np.ones(8))
    broken.add("pwm2/duty_cycle")
    with pytest.raises(OSError, match=r"no answer.*pwm2/duty_cycle"):
        driver.step(np.zeros(8))
    assert bank.command(0.0).tolist() == np.eye(8)[ORDER[0]].tolist()


def test_a_valve_that_another_program_opens_is_closed_while_another_channel_fails(rig, broken, tmp_path):
    bank, driver = rig
    driver.step(np.eye(8)[ORDER[0]])
    broken.add("pwm2/duty_cycle")
    (tmp_path / "pwmchip" / "pwm4" / "duty_cycle").write_text(str(PERIOD_NS))
    for _ in range(2):
        with pytest.raises(OSError, match="pwm2/duty_cycle"):
            driver.step(np.zeros(8))
    assert bank.command(0.0).tolist() == np.eye(8)[ORDER[0]].tolist()


def test_all_channels_are_off_at_the_end_even_where_a_duty_fails(rig, broken, tmp_path):
    bank, driver = rig
    driver.step(np.ones(8))
    broken |= {"pwm2/duty_cycle", "pwm5/enable"}
    with pytest.raises(OSError, match="pwm2/duty_cycle"):
        driver.close()
    assert not bank.command(0.0).any()
    chip = tmp_path / "pwmchip"
    assert [n for n in CHANNELS if number_in(chip / f"pwm{n}" / "enable")] == [5]
    assert [n for n in CHANNELS if number_in(chip / f"pwm{n}" / "duty_cycle")] == [2]


def test_a_duty_that_another_program_sets_last_is_0_at_the_end(bank, tmp_path):
    settings = replace(HARDWARE.driver, port=bank.address, channels=CHANNELS, order=ORDER)
    driver = pwm_driver.PwmValveDriver(ROBOT, settings, patience_s=0.0)
    (tmp_path / "pwmchip" / "pwm4" / "duty_cycle").write_text(str(PERIOD_NS))
    driver.close()
    assert number_in(tmp_path / "pwmchip" / "pwm4" / "duty_cycle") == 0


def test_a_valve_that_opens_though_its_channel_reports_a_failure_is_closed_again(bank, monkeypatch):
    driver, write = made(bank), pwm_driver._write

    def failing_write(file, number):
        write(file, number)
        raise OSError(errno.EIO, "no answer", str(file))

    with monkeypatch.context() as patch, pytest.raises(OSError, match="no answer"):
        patch.setattr(pwm_driver, "_write", failing_write)
        patch.setattr(pwm_driver, "_read", lambda file: 0)
        driver.step(np.ones(8))
    assert bank.command(0.0).all()
    monkeypatch.setattr(pwm_driver, "_read", lambda file: 0)
    driver.step(np.zeros(8))
    assert not bank.command(0.0).any()


def test_a_duty_that_cannot_be_read_is_a_refusal_and_the_command_is_set(rig, tmp_path, monkeypatch):
    bank, driver = rig
    read = pwm_driver.Path.read_text

    def failing_read(file, **options):
        if file == tmp_path / "pwmchip" / "pwm4" / "duty_cycle":
            raise OSError(errno.EIO, "no answer")
        return read(file, **options)

    with monkeypatch.context() as patch:
        patch.setattr(pwm_driver.Path, "read_text", failing_read)
        patch.setattr(pwm_driver, "_write", lambda file, number: file.write_text(str(number)))
        assert "pwm4 has not the duty" in driver.step(np.ones(8)).refusal
    assert bank.command(0.0).tolist() == [1.0] * 8


@pytest.mark.parametrize(("period_ns", "duty_ns"), [(3 * PERIOD_NS, 2 * PERIOD_NS), (0, PERIOD_NS // 2)])
def test_whatever_channels_were_left_with_a_new_driver_closes_their_valves(
    bank, broken, tmp_path, period_ns, duty_ns
):
    for name, number in (("period", period_ns), ("duty_cycle", duty_ns), ("enable", 1)):
        for channel in CHANNELS:
            (tmp_path / "pwmchip" / f"pwm{channel}" / name).write_text(str(number))
    assert bank.command(0.0).any() == (period_ns > 0)
    driver = made(bank)
    assert not bank.command(0.0).any()
    driver.step(np.ones(8))
    assert bank.command(0.0).tolist() == [1.0] * 8


def test_a_chip_keeps_a_valve_as_it_is_where_linux_refuses_the_duty(rig, tmp_path):
    bank, driver = rig
    driver.step(0.5 * np.ones(8))
    assert bank.command(0.0).tolist() == [0.5] * 8
    (tmp_path / "pwmchip" / "pwm4" / "duty_cycle").write_text(str(2 * PERIOD_NS))
    assert bank.command(0.0).tolist() == [0.5] * 8


def test_a_channel_that_cannot_start_leaves_all_valves_closed(bank, broken, tmp_path):
    made(bank).step(np.ones(8))
    broken.add("pwm2/duty_cycle")
    with pytest.raises(DeviceError, match=r"no answer.*May this user write"):
        made(bank)
    assert not bank.command(0.0).any()


@pytest.mark.parametrize("file", ["export", "pwm9/period", "pwm3/enable"])
def test_rights_that_udev_sets_a_little_later_are_waited_for(bank, tmp_path, monkeypatch, file):
    chip, denials = tmp_path / "pwmchip", [1, 2, 3]
    (chip / "pwm9").rename(tmp_path / "pwm9")

    def write(path, number):
        if path == chip / file and denials:
            denials.pop()
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        if path.name == "export":
            return (tmp_path / "pwm9").rename(chip / "pwm9")
        return path.write_text(str(number))

    monkeypatch.setattr(pwm_driver, "_write", write)
    monkeypatch.setattr(pwm_driver, "RETRY_S", 0.001)
    with pytest.raises(DeviceError, match="Permission denied"):
        made(bank, patience_s=-1.0)
    made(bank, patience_s=5.0).step(np.ones(8))
    assert (denials, bank.command(0.0).tolist()) == ([], [1.0] * 8)


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
