"""How restless random commands are that a robot is identified by; `controllers/excite.py` draws them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Excitation:
    """Rhythm and room of random commands; our values."""

    hold_s: float  # longest time that a command is held [s]
    foresight_s: float  # how long a candidate's last velocity is thought to go on [s]
    near: int = 3  # candidates around the goal
    far: int = 24  # candidates at the end of the room and beyond
    room: float = 0.25  # radius to stay in, of the geofence's [-]
    calm: float = 1.0  # weight of turning against a candidate; water and wheels end it by themselves [-]
