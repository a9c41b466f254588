"""Coarse model of a boat that stops: it reverses its propellers until it stands, and the water slows it.

Semi-implicit Euler steps of a body in the plane, velocities in the world, as `dynamics/free_body.py`; a tenth of a
second long. Places and velocities are complex numbers, which turn by one multiplication.
"""

from __future__ import annotations

import numpy as np

from fulmar_core.robots.actuators.propellers import Propellers
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.envelope.lean.commands import done_at
from fulmar_core.safety.envelope.lean.samples import Samples
from fulmar_core.safety.envelope.lean.track import Track
from fulmar_core.states.planar import PlanarState

STEP_S = 0.1  # longest of the model [s]
LONGEST_S = 12.0  # until a boat stands, before it counts as one that does not [s]
SPARE = 1.2  # of the time that a boat at top speed takes to stop, over which it is rolled forward [-]


class HullRollout:
    """Rolls boats of one kind forward.

    Attributes:
        drift: Speed with which the force of a sample carries a boat sideways that its propellers cannot hold [m/s].
    """

    def __init__(self, robot: Robot, samples: Samples, dt: float) -> None:
        """Take what the robot's file says.

        Args:
            robot: A boat.
            samples: Bodies and surroundings.
            dt: Time of a control step [s].
        """
        self._craft, self._dt, self._samples = robot.actuated_by(Propellers), dt, samples
        water, body, can = robot.hydrodynamics, robot.body, robot.performance
        assert water is not None, "a boat swims"
        surge, _, yaw = water.planar_added_mass
        self._mass = (samples.mass * body.mass + surge)[None]
        self._inertia = (samples.inertia * body.inertia[2] + yaw)[None]
        linear, quadratic = (
            np.array([each[i] for i in (0, 1, 5)]) for each in (water.linear_damping, water.quadratic_damping)
        )
        self._linear, self._quadratic = (part[:, None, None] * samples.drag for part in (linear, quadratic))
        pushed = samples.force * can.force
        self._push = (pushed * np.exp(1j * samples.bearing))[None]
        self._twist = (samples.torque * can.torque)[None]
        self.drift = _steady(float(pushed.max()), linear[1], quadratic[1])
        steps = max(1, round(dt / min(dt, STEP_S)))
        self._step = dt / steps
        response = self._craft.response
        self._late_s = samples.late_s + robot.sensors.odometry.delay_s + response.latest_s + response.lag_s
        self._stops_from = steps + int(np.ceil(self._late_s.max() / self._step))
        self._times = self._step * (0.5 + np.arange(round(LONGEST_S / self._step)))
        curve = np.asarray(self._craft.curve)
        places = np.linspace(-1.0, 1.0, len(curve))
        # The full thrust astern and ahead, each by the command that is reached soonest.
        self._astern = float(places[np.flatnonzero(curve == curve[0])[-1]])
        self._ahead = float(places[np.flatnonzero(curve == curve[-1])[0]])
        full, zero = np.ones((1, len(self._craft.names))), np.zeros(1)
        slowest = self.track(PlanarState(zero, zero, zero, zero + can.top_speed, zero, zero), full, full)
        self._times = self._times[: round(SPARE * len(slowest.places))]

    def track(self, state: PlanarState, previous: np.ndarray, command: np.ndarray) -> Track:
        """Where n boats come to that carry out one step of a command and then stop.

        Args:
            state: Now, shapes (n,).
            previous: Command before, shape (n, m).
            command: Of the step, after every limit, shape (n, m).
        """
        u, _ = state.velocity_in_body
        push, _, _ = self._craft.planar_wrench(command.T, np.ones_like(command.T))
        way = np.where(u + self._dt * push / self._mass.mean() >= 0.0, 1.0, -1.0)
        rest = np.where(way > 0.0, self._astern, self._ahead)[:, None] + 0.0 * command
        commands = previous, command, rest
        does = done_at(self._times, self._late_s, commands, self._craft.response, self._dt)
        thrust = self._craft.thrust(does) * self._samples.gain[:, None]
        return self._moved(state, way[:, None], thrust.sum(axis=-1), thrust @ self._craft.lever_arms)

    def _moved(self, state: PlanarState, way: np.ndarray, ahead: np.ndarray, moment: np.ndarray) -> Track:
        """Integrate; `way`: +1 ahead, -1 astern, shape (n, 1); forces and moments, shape (steps, n, k)."""
        count, kinds = ahead.shape[1:]
        wide = np.zeros((count, kinds))
        place = (state.x + 1j * state.y)[:, None] + wide
        velocity = (state.vx + 1j * state.vy)[:, None] + wide
        yaw, rate = state.yaw[:, None] + wide, state.yaw_rate[:, None] + wide
        per_mass, per_inertia, dt = self._step / self._mass, self._step / self._inertia, self._step
        own, stands = np.empty((3, count, kinds)), np.zeros((count, kinds), dtype=bool)
        places = [place]
        fastest = np.zeros(count), np.zeros(count)
        for step in range(len(ahead)):
            heading = np.exp(1j * yaw)
            along = velocity * heading.conj()
            own[0], own[1], own[2] = along.real, along.imag, rate
            drag = own * (self._linear + self._quadratic * np.abs(own))
            force = heading * ((ahead[step] - drag[0]) - 1j * drag[1]) + self._push
            velocity = velocity + per_mass * force
            rate = rate + per_inertia * (moment[step] - drag[2] + self._twist)
            yaw = yaw + dt * rate
            if step + 1 == self._stops_from:
                fastest = np.abs(rate).max(axis=1), np.abs(velocity).max(axis=1)
            elif step >= self._stops_from:
                stands |= (velocity * heading.conj()).real * way <= 0.0
            place = place + np.where(stands, 0.0, dt * velocity)
            places.append(place)
            if stands.all():
                break
        return Track(np.stack(places), *fastest)


def _steady(force: float, linear: float, quadratic: float) -> float:
    """Speed at which the drag equals a force [m/s]."""
    if quadratic <= 0.0:
        return force / max(linear, 1e-9)
    return float((np.sqrt(linear**2 + 4.0 * quadratic * force) - linear) / (2.0 * quadratic))
