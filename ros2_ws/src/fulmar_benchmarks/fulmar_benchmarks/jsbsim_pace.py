"""How many control steps a second JSBSim makes of an exported aircraft, in its own turbulence: physics alone."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from sim_nodes.jsbsim_craft import silent_model
from sim_nodes.jsbsim_model import FOOT, write_aircraft

MILSPEC, LIGHT = 3, 3  # JSBSim's turbulence of MIL-F-8785C; a severity of 0 switches it off
FLOWN_S = 2.0  # then the craft begins anew
HEIGHT_M = 20.0  # where it begins, so that it meets no ground on the way


class JsbsimPace:
    """One aircraft in JSBSim, over level ground, by time steps as long as the core's."""

    def __init__(self, robot: Robot, turbulence: float) -> None:
        """Write the model and load it.

        Args:
            robot: An aircraft.
            turbulence: Wind at 20 ft that turbulence comes from; 0: none [m/s].

        Raises:
            ConfigError: The robot is no aircraft, or JSBSim does not take the model.
        """
        self._folder = tempfile.TemporaryDirectory(prefix="fulmar-jsbsim-")
        folder = Path(self._folder.name)
        write_aircraft(robot, folder)
        assert robot.airframe is not None  # as in `write_aircraft`
        self._model = model = silent_model()
        model.set_aircraft_path(str(folder))
        if not model.load_model(robot.name, True):
            raise ConfigError(f"JSBSim cannot load the model of '{robot.name}'.")
        model.set_dt(robot.timing.physics_dt)
        self._ticks = robot.timing.substeps(robot.timing.control_hz)
        self._steps = round(FLOWN_S * robot.timing.control_hz)
        model["ic/h-agl-ft"], model["ic/u-fps"] = HEIGHT_M / FOOT, robot.airframe.speed / FOOT
        self._turbulence = turbulence
        self._begin()

    def steps_per_s(self, seconds: float) -> float:
        """Step for a while; returns how many control steps were made a second, without the time to begin anew."""
        spent, count, run = 0.0, 0, self._model.run
        while spent < seconds:
            self._begin()
            began = time.perf_counter()
            for _ in range(self._steps * self._ticks):
                run()
            spent += time.perf_counter() - began
            count += self._steps
        return count / spent

    def _begin(self) -> None:
        model = self._model
        model.reset_to_initial_conditions(0)
        model["atmosphere/turb-type"] = MILSPEC
        model["atmosphere/turbulence/milspec/severity"] = LIGHT if self._turbulence else 0
        model["atmosphere/turbulence/milspec/windspeed_at_20ft_AGL-fps"] = self._turbulence / FOOT
