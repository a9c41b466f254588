"""Actuator guards of a platform and of a wheeled base."""

from __future__ import annotations

import pytest

from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.watchdog import Watchdog
from tests.fulmar_core.safety.guards import BASE, MS, THRUSTERS


@pytest.fixture
def guard():
    return ActuatorGuard(THRUSTERS, Watchdog(200 * MS))


@pytest.fixture
def base():
    return ActuatorGuard(BASE, Watchdog(400 * MS), control_dt=0.1)
