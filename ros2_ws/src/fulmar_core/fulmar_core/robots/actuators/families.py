"""The families of actuators, by the `kind` of a robot's YAML: another one is its own file and a row here."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

from fulmar_core.robots.actuators.ackermann import Ackermann
from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces
from fulmar_core.robots.actuators.differential_drive import DifferentialDrive
from fulmar_core.robots.actuators.family import Actuators
from fulmar_core.robots.actuators.fans import Fans
from fulmar_core.robots.actuators.propellers import Propellers
from fulmar_core.robots.actuators.pushing import OneWay, Pushing
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.robots.actuators.thrusters import Thrusters

Row = TypeVar("Row")

FAMILIES: dict[str, type[Actuators]] = {
    "thrusters": Thrusters,
    "propellers": Propellers,
    "differential_drive": DifferentialDrive,
    "ackermann": Ackermann,
    "fans": Fans,
    "reaction_wheels": ReactionWheels,
    "control_surfaces": ControlSurfaces,
}
# What families are built on: in tables by family, a row of these is for all that have none of their own.
BASES: dict[str, type[Actuators]] = {"one_way": OneWay, "pushing": Pushing, "rolling": Rolling}
_NAMES = {family: name for name, family in (FAMILIES | BASES).items()}


def row_of(table: Mapping[str, Row], family: type[Actuators]) -> Row | None:
    """What a table by family has for one: its own row, else that of its nearest base; None without either."""
    names = (_NAMES.get(each, "") for each in family.__mro__)
    return next((table[name] for name in names if name in table), None)
