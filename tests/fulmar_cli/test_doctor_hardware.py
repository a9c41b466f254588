"""`fulmar doctor --for hardware` repeats in capitals what no watchdog stops, and looks for a named device."""

from __future__ import annotations

import pytest

from fulmar_cli.diagnosis.devices import diagnose_hardware
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names
from hardware_drivers.devices import UNPROTECTED, own_watchdog
from hardware_drivers.hardware import load_hardware


def test_every_file_without_a_watchdog_below_its_driver_is_a_warning_in_capitals():
    findings = {finding.what: finding for finding in diagnose_hardware(None)}
    for name in config_names("hardware"):
        unprotected = own_watchdog(load_hardware(name).driver) is None
        assert findings[name].found.startswith(UNPROTECTED) is unprotected
        assert findings[name].level == ("advice" if unprotected else "ok")
    assert all(finding.ok for finding in findings.values())


def test_a_named_file_s_device_is_looked_for(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("title: t\nrobot: turtlebot2\ndriver: {kind: kobuki, port: /dev/ttyNONE}\n")
    device = diagnose_hardware(str(path))[-1]
    assert device.level == "wrong"
    assert "/dev/ttyNONE: there is no such serial port" in device.found
    path.write_text(path.read_text().replace("/dev/ttyNONE", str(path)))
    assert diagnose_hardware(str(path))[-1].ok


def test_an_unknown_file_is_refused():
    with pytest.raises(ConfigError, match="Did you mean 'turtlebot2'"):
        diagnose_hardware("turtlebot3")
