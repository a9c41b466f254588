"""The pulses of one commissioning, and what they show."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fulmar_bringup.commissioning.hardware_file import Wire, propeller_command, valve_command, wheel_command
from fulmar_bringup.commissioning.match import CLEARLY, Match, match_nozzles, match_sides
from fulmar_bringup.commissioning.response import Motion, Pulse, Response, Track, responses
from fulmar_bringup.commissioning.session import Session
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.actuators.differential_drive import DifferentialDrive
from fulmar_core.robots.actuators.family import Actuators
from fulmar_core.robots.actuators.thrusters import Thrusters
from fulmar_core.robots.robot import Robot

CLICK_S, BETWEEN_CLICKS_S = 0.1, 0.9
# At most 0.3 s at its level. For valves our value: 1 N on 5.32 kg gives 23 mm/s, some 20 standard errors.
VALVE_PULSE_S, HOLD_S = 0.12, 0.3
STILL_S = 1.5  # before the first pulse: what moves by itself
LOOK_BACK_S = 0.8  # before a pulse: motion that the fit takes for the robot's own
# After a pulse. What rolls must stand when the fit of the next pulse begins; a base slows down for half a second.
BETWEEN_S = {"floating": 0.6, "coasting": 1.0, "rolling": 1.2}
# Shares of full thrust of a propeller; each ahead, then astern, until one shows. Propellers push less astern, so one
# that turns backwards shows at the negative share first, by as much as another at the positive one.
SHARES = (0.25, 0.34, 0.42, 0.5, 0.65, 0.8, 1.0)
ALIKE = 3  # shares that the second propeller is tried with, from the one that moved the first: they are alike
# Of the share that moved it; astern, propellers push less. Our values, as the next two.
BRAKES = (1.6, 1.0, 1.0)
CREEPS = 0.01  # a boat that is slower need not be stopped before the next pulse [m/s]
SPEED_OVER_S = 0.5  # a speed is averaged over so long [s]
Say = Callable[[str], None]


@dataclass(frozen=True)
class Outcome:
    """Response of every wire, and the actuator behind it."""

    match: Match
    found: tuple[Response, ...]


def click(session: Session, commands: Mapping[str, np.ndarray], say: Say) -> None:
    """Open one valve after another for a moment, with the air closed, for a person who listens."""
    for name, command in commands.items():
        say(name)
        session.pulse(command, CLICK_S)
        session.rest(BETWEEN_CLICKS_S)


# Each pulses one wire after another, in a session that is ready, and identifies the actuator behind each.
# Raises RunFailed where something ended it; see `Session.pulse`.
def valves(session: Session, robot: Robot, thrusters: Thrusters, wires: Sequence[Wire], say: Say) -> Outcome:
    """Each nozzle by the change of motion that fits it best."""
    session.rest(STILL_S)
    pulses = []
    for wire in wires:
        say(wire.name)
        pulses.append(session.pulse(valve_command(thrusters, wire), VALVE_PULSE_S))
        session.rest(BETWEEN_S["floating"] - 0.1)
    track = session.track(pulses[0].begin_s - STILL_S)
    found = _responses(track, pulses, "floating")
    lasts_s = [pulse.end_s - pulse.begin_s for pulse in pulses]
    match = match_nozzles(robot, thrusters, found, lasts_s, [wire.actuator for wire in wires])
    return Outcome(match, tuple(found))


def wheels(
    session: Session, _robot: Robot, drive: DifferentialDrive, wires: Sequence[Wire], say: Say
) -> Outcome:
    """Each wheel by how far the base goes and turns."""
    session.rest(STILL_S)
    found = []
    for wire in wires:
        say(wire.name)
        found.append(_response(session, drive, wheel_command(drive, wire), "rolling"))
    return Outcome(match_sides(found), tuple(found))


def propellers(
    session: Session, _robot: Robot, pushing: Actuators, wires: Sequence[Wire], say: Say
) -> Outcome:
    """Each propeller by the response to a positive share, at the lowest share that shows one."""
    session.rest(STILL_S)
    found: list[Response] = []
    shares: Sequence[float] = SHARES
    for wire in wires:
        for share, sign in [(share, sign) for share in shares for sign in (1.0, -1.0)]:
            say(f"{wire.name} at {100.0 * sign * share:+.0f} %")
            one = _response(session, pushing, propeller_command(pushing, wire, sign * share), "coasting")
            if min(one.clearly[0], one.clearly[2]) > CLEARLY:
                first = SHARES.index(share)
                shares = SHARES[first : first + ALIKE]
                _brake(session, pushing, wire, share, ahead=float(np.sign(one.change[0])) * sign)
                break
        found.append(Response(sign * one.change, one.sigma))
    return Outcome(match_sides(found), tuple(found))


def _brake(session: Session, pushing: Actuators, wire: Wire, share: float, *, ahead: float) -> None:
    """Stop a boat that coasts, by the propeller that has moved it; `ahead` is the sign that drives it ahead."""
    for harder in BRAKES:
        session.rest(SPEED_OVER_S)
        speed = session.speed_ahead(SPEED_OVER_S)
        if abs(speed) < CREEPS:
            return
        command = propeller_command(pushing, wire, -np.sign(speed) * ahead * min(1.0, harder * share))
        session.pulse(command, _ramp_s(pushing, command) + HOLD_S)
        session.rest(_ramp_s(pushing, command))


def _response(session: Session, actuators: Actuators, command: np.ndarray, motion: Motion) -> Response:
    pulse = session.pulse(command, _ramp_s(actuators, command) + HOLD_S)
    session.rest(BETWEEN_S[motion])
    (one,) = _responses(session.track(pulse.begin_s - LOOK_BACK_S), [pulse], motion)
    return one


def _ramp_s(actuators: Actuators, command: np.ndarray) -> float:
    """How long the driver's slew needs to reach a command [s]."""
    slew = actuators.response.slew
    return float(np.max(np.abs(command) / np.asarray(slew))) if slew else 0.0


def _responses(track: Track, pulses: Sequence[Pulse], motion: Motion) -> list[Response]:
    try:
        return responses(track, pulses, motion)
    except ValueError as error:
        raise RunFailed(f"too few poses came: {error}") from error
