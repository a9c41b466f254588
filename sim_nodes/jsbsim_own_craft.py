"""A model that comes with JSBSim in the place of a robot: its own aerodynamics, engine, mass and controls.

It is rigged once, as a mechanic rigs an aircraft for an autopilot. Its axes are pitched so that level flight has the
robot's angle of attack, and its surfaces stand so that the robot's deflections of level flight are level flight. Range
and direction of each control are measured. A thrust level is its throttle lever: how far that has to go for level
flight is for a controller to find, and so is everything beside the trim.
"""

from __future__ import annotations

import shutil
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree as Xml

import jsbsim
import numpy as np

from fulmar_core.config.errors import ConfigError, did_you_mean
from fulmar_core.dynamics.flight_trim import FREE_AIR, Trim, find_trim
from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces
from fulmar_core.robots.robot import Robot
from sim_nodes.jsbsim_craft import STEPS, model_in
from sim_nodes.jsbsim_model import FOOT, SLUG, TRIM_OF

# Rate that a surface drives, and the sign of what Fulmar's positive deflection does to it in JSBSim's axes (x ahead,
# y right, z down): nose down, right wing down, nose to the left.
DRIVEN = {"elevator": ("q", -1.0), "aileron": ("p", 1.0), "rudder": ("r", -1.0)}
SHARES = (1.0, 0.97, 0.94, 0.91, 0.88, 0.85, 0.8)  # of the cruising speed, for engines that cannot hold it
PROBE, PROBE_S = 0.25, 0.2  # share of a control's range, and for how long it acts [s]
LEAST_RAD = 1e-3  # that a quarter of a control's range moves its surface by
SPIN_UP_S = 5.0  # of level flight before a start, after which engine and servos are at rest


@dataclass(frozen=True)
class Control:
    """How a command of a model's, -1 to 1, moves one surface."""

    property: str
    sign: float  # of the model's deflection, against Fulmar's
    slopes: tuple[float, float]  # deflection a unit of command, of negative ones and of positive ones [rad]
    neutral: float = 0.0  # command in the model's own level flight
    level: float = 0.0  # the robot's deflection in its level flight [rad]

    def command(self, deflection: float) -> float:
        """The command for a deflection in Fulmar's sign [rad], within -1 and 1."""
        place = self.neutral * self.slopes[self.neutral > 0.0] + self.sign * (deflection - self.level)
        upward = place * self.slopes[1] > 0.0
        return float(np.clip(place / self.slopes[upward], -1.0, 1.0))


class OwnCraft:
    """One of JSBSim's own models for an aircraft of Fulmar's."""

    def __init__(self, robot: Robot, name: str) -> None:
        """Load the model, measure its controls, and rig it.

        Raises:
            ConfigError: JSBSim has no such model or cannot run it; a surface does not move; no level flight.
        """
        frame, craft = robot.wings, robot.actuated_by(ControlSurfaces)
        self._robot, self._name = robot, name
        self._folder = tempfile.TemporaryDirectory(prefix="fulmar-jsbsim-")
        _copy_model(name, Path(self._folder.name))
        self._cruise, self._motors = frame.speed, len(craft.motors)
        try:
            self._rig([surface.name for surface in craft.surfaces])
        except jsbsim.BaseError as error:
            words = " ".join(str(error).split())
            raise ConfigError(f"JSBSim cannot fly its '{name}': {words}") from error

    def loaded(self) -> jsbsim.FGFDMExec:
        """See `JsbsimCraft.loaded`; gear and flaps are up, and the fuel does not run out."""
        model = model_in(Path(self._folder.name), self._name, self._robot)
        # Not every model has each of them, and the L17 reads the first one without setting it.
        for name in ("fcs/flaps-pos-deg", "fcs/flap-cmd-norm", "gear/gear-pos-norm", "gear/gear-cmd-norm"):
            model[name] = 0.0
        model["propulsion/fuel_freeze"] = 1.0
        return model

    def start(self, model: jsbsim.FGFDMExec) -> None:
        """See `JsbsimCraft.start`: fly level for a while, until the engine turns at the speed of the trim."""
        self._fly(model, self.speed)
        for control in self.controls:
            model[control.property] = control.neutral
        self._open(model, [self.throttle] * self._motors)
        for _ in range(self._steps(SPIN_UP_S)):
            model.run()

    def level(self, command: np.ndarray) -> np.ndarray:
        """See `JsbsimCraft.level`: surfaces are rigged for the robot's; the throttle is the model's own."""
        return np.array([*command[: len(self.controls)], *[self.throttle] * self._motors])

    def steer(self, model: jsbsim.FGFDMExec, applied: np.ndarray) -> None:
        """See `JsbsimCraft.steer`."""
        for control, deflection in zip(self.controls, applied, strict=False):
            model[control.property] = control.command(float(deflection))
        self._open(model, applied[len(self.controls) :])

    def close(self) -> None:
        """See `JsbsimCraft.close`."""
        self._folder.cleanup()

    def _rig(self, surfaces: list[str]) -> None:
        """Measure the controls of surfaces, and set neutral commands and axes by level flight."""
        measured = [self._measured(surface) for surface in surfaces]
        flight, trimmed = self._trimmed()
        self.controls = tuple(
            replace(
                each,
                neutral=trimmed[each.property] + trimmed[f"fcs/{TRIM_OF[surface]}-trim-cmd-norm"],
                level=float(flight.command[i]),
            )
            for i, (surface, each) in enumerate(zip(surfaces, measured, strict=True))
        )
        self.speed = flight.speed  # of the trim that it is rigged for [m/s]
        self.throttle = trimmed["fcs/throttle-cmd-norm"]  # in that trim
        self.pitch = trimmed["aero/alpha-rad"] - flight.alpha
        self.mass = trimmed["inertia/mass-slugs"] * SLUG

    def _steps(self, duration_s: float) -> int:
        return round(STEPS * duration_s / self._robot.timing.physics_dt)

    @staticmethod
    def _open(model: jsbsim.FGFDMExec, levels: np.ndarray | list[float]) -> None:
        for i, level in enumerate(levels):
            model[f"fcs/throttle-cmd-norm[{i}]"] = float(level)

    @staticmethod
    def _fly(model: jsbsim.FGFDMExec, speed: float) -> None:
        """Put a model into level flight in free air, its engines running on a full mixture."""
        model["ic/terrain-elevation-ft"], model["ic/h-sl-ft"] = 0.0, FREE_AIR / FOOT
        model["ic/vt-fps"], model["ic/gamma-deg"] = speed / FOOT, 0.0
        model.run_ic()
        model["propulsion/set-running"] = -1
        model["fcs/mixture-cmd-norm"] = model["fcs/advance-cmd-norm"] = 1.0

    def _measured(self, surface: str) -> Control:
        """The control of a surface: how far it goes either way, and which way the craft turns then."""
        if surface not in DRIVEN:
            raise ConfigError(f"JSBSim's '{self._name}' has no {surface}. It has: {', '.join(DRIVEN)}.")
        name = f"fcs/{surface}-cmd-norm"
        slopes = []
        for way in (-1.0, 1.0):
            # The difference of two deflections in one direction is free of a control's play.
            (near, _), (far, turn) = (self._answer(surface, way * share * PROBE) for share in (1.0, 2.0))
            if abs(far - near) < LEAST_RAD or not turn:
                raise ConfigError(f"JSBSim's '{self._name}' does not move its {surface} by {name}.")
            slopes.append((far - near) / (way * PROBE))
        return Control(name, float(np.sign(turn * slopes[1])) * DRIVEN[surface][1], (slopes[0], slopes[1]))

    def _answer(self, surface: str, command: float) -> tuple[float, float]:
        """Deflection [rad], and rate beside that of a flight without the command [rad/s], a moment after it."""
        rates = []
        for value in (0.0, command):
            model = self.loaded()
            self._fly(model, self._cruise)
            model[f"fcs/{surface}-cmd-norm"] = value
            for _ in range(self._steps(PROBE_S)):
                model.run()
            rates.append(model[f"velocities/{DRIVEN[surface][0]}-rad_sec"])
        if surface == "aileron":
            place = 0.5 * (model["fcs/left-aileron-pos-rad"] - model["fcs/right-aileron-pos-rad"])
        else:
            place = model[f"fcs/{surface}-pos-rad"]
        return place, rates[1] - rates[0]

    def _trimmed(self) -> tuple[Trim, jsbsim.FGFDMExec]:
        """Level flight of robot and model at cruising speed, or, of a weaker engine, the next one that it holds."""
        for share in SHARES:
            model = self.loaded()
            self._fly(model, share * self._cruise)
            model["fcs/throttle-cmd-norm"] = 0.7  # where the search begins
            try:
                model["simulation/do_simple_trim"] = 1
            except jsbsim.TrimFailureError:
                continue
            return find_trim(self._robot, share * self._cruise), model
        raise ConfigError(
            f"JSBSim's '{self._name}' holds no level flight between {SHARES[-1] * self._cruise:.1f} m/s and "
            f"{self._cruise:.1f} m/s, the cruise of '{self._robot.name}'."
        )


def _copy_model(name: str, folder: Path) -> None:
    """Copy a model that comes with JSBSim into a folder, without the logs that it would write.

    Raises:
        ConfigError: None of this name comes with it.
    """
    shipped = Path(jsbsim.get_default_root_dir()) / "aircraft"
    known = [path.parent.name for path in shipped.glob("*/*.xml") if path.stem == path.parent.name]
    if name not in known:
        raise ConfigError(f"JSBSim comes with no model '{name}'.{did_you_mean(name, known)}")
    shutil.copytree(shipped / name, folder / name)
    file = folder / name / f"{name}.xml"
    tree = Xml.parse(file)
    for log in tree.getroot().findall("output"):
        tree.getroot().remove(log)
    tree.write(file)
