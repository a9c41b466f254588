"""The families of actuators, by the `kind` of a robot's YAML: another one is its own file and a row here."""

from __future__ import annotations

from fulmar_core.robots.actuators.ackermann import Ackermann
from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces
from fulmar_core.robots.actuators.differential_drive import DifferentialDrive
from fulmar_core.robots.actuators.family import Actuators
from fulmar_core.robots.actuators.fans import Fans
from fulmar_core.robots.actuators.propellers import Propellers
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.actuators.thrusters import Thrusters

FAMILIES: dict[str, type[Actuators]] = {
    "thrusters": Thrusters,
    "propellers": Propellers,
    "differential_drive": DifferentialDrive,
    "ackermann": Ackermann,
    "fans": Fans,
    "reaction_wheels": ReactionWheels,
    "control_surfaces": ControlSurfaces,
}
