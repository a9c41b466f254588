"""What `fulmar export --to jsbsim` writes is trimmed and flown by JSBSim alone, from its root folder."""

from __future__ import annotations

import math

import jsbsim
import numpy as np
import pytest
from typer.testing import CliRunner

from fulmar_cli.main import app
from fulmar_core.dynamics.flight_trim import find_trim
from fulmar_core.robots.robot_file import load_robot
from sim_nodes.jsbsim_model import FOOT
from sim_nodes.jsbsim_root import CRUISE_M

# Accelerations that a command drives, and which way, x ahead, y right, z down: nose down, right wing down, nose left.
DRIVES = {"elevator": ("q", -1.0), "aileron": ("p", 1.0), "rudder": ("r", -1.0)}


def exported(name, folder):
    done = CliRunner().invoke(app, ["export", name, "--to", "jsbsim", "--out", str(folder)])
    assert done.exit_code == 0, done.output
    model = jsbsim.FGFDMExec(str(folder))
    model.set_debug_level(0)
    return model


@pytest.mark.parametrize("name", ["airship_v7", "navion", "skywalker_x8"])
def test_its_script_trims_it_where_we_do_and_flies_on(name, tmp_path):
    robot, model = load_robot(name), exported(name, tmp_path / "root")
    assert model.load_script(f"scripts/{name}.xml")
    assert model.run_ic()
    assert model.run()
    ours = find_trim(robot, robot.airframe.speed, altitude=CRUISE_M)
    # Its Earth turns and is no sphere: gravity is up to 0.3 % less.
    assert model["aero/alpha-rad"] == pytest.approx(ours.alpha, abs=1e-3)
    assert model["fcs/elevator-pos-rad"] == pytest.approx(ours.elevator, abs=1e-3)
    assert model["fcs/throttle-pos-norm"] == pytest.approx(ours.throttle, rel=0.01)
    steadiest, fastest = math.inf, 0.0
    while model.run():
        turning = abs(model["velocities/q-rad_sec"])
        if model["simulation/sim-time-sec"] < 1.0:
            steadiest = min(steadiest, turning)
        fastest = max(fastest, turning)
    assert steadiest < 1e-3 < 5e-3 < fastest  # level until the pulse
    assert model["simulation/sim-time-sec"] == pytest.approx(10.0, abs=0.01)
    assert model["position/h-sl-meters"] == pytest.approx(CRUISE_M, abs=30.0)
    assert abs(model["attitude/phi-rad"]) < 0.1


def test_commands_move_surfaces_to_their_limits_and_the_craft_as_jsbsims_do(tmp_path):
    robot, model = load_robot("airship_v7"), exported("airship_v7", tmp_path / "root")
    assert model.load_model("airship_v7")
    model["ic/vt-fps"], model["ic/h-sl-ft"], model["ic/gamma-deg"] = 28.0 / FOOT, CRUISE_M / FOOT, 0.0
    model.run_ic()
    rest = {axis: model[f"accelerations/{axis}dot-rad_sec2"] for axis in "pqr"}
    places = {"elevator": "elevator", "aileron": "left-aileron", "rudder": "rudder"}
    for surface in robot.actuators.surfaces:
        axis, sign = DRIVES[surface.name]
        model[f"fcs/{surface.name}-cmd-norm"] = 3.0
        model.run_ic()
        limit = math.radians(surface.limit_deg)
        assert model[f"fcs/{places[surface.name]}-pos-rad"] == pytest.approx(limit, abs=1e-12)
        assert sign * (model[f"accelerations/{axis}dot-rad_sec2"] - rest[axis]) > 0.5
        model[f"fcs/{surface.name}-cmd-norm"] = 0.0
    before = model["accelerations/udot-ft_sec2"]
    for motor in range(len(robot.actuators.motors)):
        model[f"fcs/throttle-cmd-norm[{motor}]"] = 0.5
    model.run_ic()
    assert model["accelerations/udot-ft_sec2"] > before + 1.0


def test_the_folder_is_as_jsbsim_looks_for_files(tmp_path):
    exported("navion", tmp_path / "root")
    found = {path.relative_to(tmp_path / "root").as_posix() for path in (tmp_path / "root").rglob("*")}
    assert {
        "aircraft/navion/navion.xml", "aircraft/navion/cruise.xml", "engine", "systems", "scripts/navion.xml",
        "still_planet.xml",
    } <= found  # fmt: skip
    assert np.all(
        [(tmp_path / "root" / path).exists() for path in ("engine/direct.xml", "engine/fulmar_throttle.xml")]
    )
