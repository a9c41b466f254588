"""An aircraft as JSBSim flies it: what `JsbsimBackend` asks of a model, and the model that is a robot's own file."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Protocol

import jsbsim
import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from sim_nodes.jsbsim_model import STILL_PLANET, write_aircraft

STEPS = 4  # of JSBSim in a physics tick
_FATAL_ONLY = jsbsim.DefaultLogger()
_FATAL_ONLY.set_min_level(jsbsim.LogLevel.FATAL)


class JsbsimCraft(Protocol):
    """A model of JSBSim's, and how Fulmar's commands and axes are its own."""

    pitch: float  # of its axes over Fulmar's: its angle of attack less the robot's in the same flight [rad]
    mass: float  # that its loads accelerate [kg]

    def loaded(self) -> jsbsim.FGFDMExec:
        """A model that has never flown."""
        ...

    def start(self, model: jsbsim.FGFDMExec) -> None:
        """Make a model ready to fly from the state that its `ic/` properties are given next."""
        ...

    def level(self, command: np.ndarray) -> np.ndarray:
        """What level flight of the model takes, of what that of the robot takes, shape (n,)."""
        ...

    def steer(self, model: jsbsim.FGFDMExec, applied: np.ndarray) -> None:
        """Pass deflections [rad] and thrust levels on, shape (n,)."""
        ...

    def close(self) -> None:
        """Let go of files."""
        ...


def silent_model() -> jsbsim.FGFDMExec:
    """An empty model that prints neither JSBSim's banner nor its notes: standard output is for a command's result."""
    jsbsim.FGJSBBase().debug_lvl = 0  # of all models; the banner comes before a model's own level can be set
    jsbsim.set_logger(_FATAL_ONLY)
    return jsbsim.FGFDMExec(None)


def model_in(folder: Path, name: str, robot: Robot) -> jsbsim.FGFDMExec:
    """Load a model over a planet that does not turn.

    Args:
        folder: Has the model as `<name>/<name>.xml`; the planet's file is written there.
        name: Of the model.
        robot: A physics tick of it is `STEPS` steps of the model.

    Raises:
        ConfigError: JSBSim cannot load it.
    """
    planet = folder / "still_planet.xml"
    planet.write_text(STILL_PLANET, encoding="utf-8")
    model = silent_model()
    model.set_aircraft_path(str(folder))
    if not (model.load_planet(str(planet), False) and model.load_model(name, True)):
        raise ConfigError(f"JSBSim cannot load the model '{name}'.")
    model.set_dt(robot.timing.physics_dt / STEPS)
    return model


class ExportedCraft:
    """A robot's own file as a model; deflections and levels are properties of it."""

    pitch = 0.0

    def __init__(self, robot: Robot) -> None:
        """Write the model.

        Raises:
            ConfigError: The robot is no aircraft.
        """
        self._robot, self.mass = robot, robot.body.mass
        self._folder = tempfile.TemporaryDirectory(prefix="fulmar-jsbsim-")
        write_aircraft(robot, Path(self._folder.name))

    def loaded(self) -> jsbsim.FGFDMExec:
        """See `JsbsimCraft.loaded`."""
        return model_in(Path(self._folder.name), self._robot.name, self._robot)

    def start(self, model: jsbsim.FGFDMExec) -> None:
        """See `JsbsimCraft.start`: nothing has to."""

    def level(self, command: np.ndarray) -> np.ndarray:
        """See `JsbsimCraft.level`: the same."""
        return command

    def steer(self, model: jsbsim.FGFDMExec, applied: np.ndarray) -> None:
        """See `JsbsimCraft.steer`."""
        for name, value in zip(self._robot.actuators.names, applied, strict=True):
            model[f"fulmar/{name}"] = float(value)

    def close(self) -> None:
        """See `JsbsimCraft.close`."""
        self._folder.cleanup()
