"""Our Navion beside JSBSim's L17, which took over the same derivatives, at one trim."""

from __future__ import annotations

import jsbsim
import numpy as np
import pytest

from fulmar_core.dynamics.flight_modes import modes_of
from fulmar_core.dynamics.flight_trim import find_trim
from fulmar_core.robots.robot_file import load_robot

SPEED_FPS = 176.0  # of Nelson's flight condition
FOOT = 0.3048


@pytest.fixture(scope="module")
def theirs() -> np.ndarray:
    """Eigenvalues of the L17, trimmed in level flight near sea level, gear up."""
    model = jsbsim.FGFDMExec(None)
    model.set_debug_level(0)
    assert model.load_model("L17")
    model["ic/vt-fps"], model["ic/h-sl-ft"], model["ic/gamma-deg"] = SPEED_FPS, 100.0, 0.0
    for name in ("fcs/flaps-pos-deg", "gear/gear-pos-norm", "gear/gear-cmd-norm"):
        model[name] = 0.0
    assert model.run_ic()
    model["propulsion/set-running"] = -1
    model["fcs/throttle-cmd-norm"] = 0.7
    model["fcs/mixture-cmd-norm"] = model["fcs/advance-cmd-norm"] = 1.0
    model["simulation/do_simple_trim"] = 1
    assert model["velocities/vt-fps"] == pytest.approx(SPEED_FPS, rel=1e-3)
    return np.linalg.eigvals(np.array(jsbsim.FGLinearization(model).system_matrix))


def nearest(values, value):
    return min(values, key=lambda other: abs(other - value))


@pytest.mark.parametrize(
    ("name", "within"), [("short period", 0.05), ("phugoid", 0.12), ("Dutch roll", 0.05), ("roll", 0.05)]
)
def test_modes_are_those_of_the_l17(theirs, name, within):
    navion = load_robot("navion")
    modes = modes_of(navion, find_trim(navion, SPEED_FPS * FOOT, altitude=30.0))
    mode = next(mode for mode in modes if mode.name == name)
    their = nearest(theirs, complex(mode.real, mode.imag))
    assert abs(their.imag) > 0.1 or name == "roll"
    assert mode.frequency == pytest.approx(abs(their), rel=within)
