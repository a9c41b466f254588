"""Spacecraft in Basilisk that another process steps over a pipe.

Runs by the Python of `.venv-peers`, and so imports nothing of Fulmar. The only argument is the descriptor of a
`multiprocessing.connection.Connection`. Requests and answers are JSON objects, and each request has the number of a
`craft`:

- `{"craft": 0, "begin": {...}}` builds it anew, as in `Craft.__init__`; the answer is its state.
- `{"craft": 0, "moves": [{...}, ...]}` moves it as in `Craft.move`, one after the other; the answer is the state after
  the last.
- `{"craft": 0, "end": true}` removes it; the answer is empty.

A state has `position` [m], `velocity` [m/s] and `mrp` (modified Rodrigues parameters of the attitude) in the inertial
frame, `rate` [rad/s], `acceleration` that is not gravity [m/s²] and `turn_acceleration` [rad/s²] along the body's axes,
and the `speeds` of the wheels relative to the body [rad/s]. The body's origin is its centre of mass.
"""

from __future__ import annotations

import json
import sys
from multiprocessing.connection import Connection
from typing import Any

from Basilisk import __version__
from Basilisk.architecture import bskLogging, messaging
from Basilisk.simulation import (
    extForceTorque,
    reactionWheelStateEffector,
    spacecraft,
    thrusterDynamicEffector,
)
from Basilisk.utilities import SimulationBaseClass, simIncludeRW

OPEN_S = 1e9  # until a valve is closed again by another command [s]
TASK = "dynamics"
RPM = 9.549296585513721  # of a rad/s


class Craft:
    """One body in one simulation of Basilisk, with thrusters or with reaction wheels."""

    def __init__(self, asked: dict[str, Any]) -> None:
        """Build it.

        Args:
            asked: `step_ns`, integration step of fourth order [ns]; `mass` [kg]; `inertia` about the centre of mass,
                wheels locked, (3, 3) [kg·m²]; `position`, `velocity`, `mrp`, `rate` as in a state; `thrusters`, each
                with `place` [m], `direction` of its force and `couple` about that for each newton [m]; `wheels`, their
                axes, and the `spin_inertia` of each [kg·m²].
        """
        self._simulation = SimulationBaseClass.SimBaseClass()
        self._step_ns, self._now_ns = int(asked["step_ns"]), 0
        process = self._simulation.CreateNewProcess(TASK)
        process.addTask(self._simulation.CreateNewTask(TASK, self._step_ns))
        self._body = body = spacecraft.Spacecraft()
        body.ModelTag = "body"
        body.hub.r_BcB_B = [[0.0], [0.0], [0.0]]
        body.hub.mHub, body.hub.IHubPntBc_B = asked["mass"], asked["inertia"]
        body.hub.r_CN_NInit, body.hub.v_CN_NInit = _column(asked["position"]), _column(asked["velocity"])
        body.hub.sigma_BNInit, body.hub.omega_BN_BInit = _column(asked["mrp"]), _column(asked["rate"])
        # Modules of a larger number run first: actuators take their commands, then the body moves.
        self._simulation.AddModelToTask(TASK, body, 1)
        self._outside = extForceTorque.ExtForceTorque()
        body.addDynamicEffector(self._outside)
        self._simulation.AddModelToTask(TASK, self._outside, 2)
        self._couples = [each["couple"] for each in asked["thrusters"]]
        if asked["thrusters"]:
            self._add_thrusters(asked["thrusters"])
        self._wheels: Any = None
        if asked["wheels"]:
            self._add_wheels(asked["wheels"], asked["spin_inertia"])
        self._simulation.InitializeSimulation()
        self._run(0)

    def move(self, asked: dict[str, Any]) -> None:
        """Move it while nothing changes.

        Args:
            asked: `steps` of integration; `drive`, the thrust of each thruster [N] or the torque on each wheel [N·m];
                `force` in the inertial frame [N] and `torque` along the body's axes [N·m] from outside; where they
                changed, `mass` [kg] and `inertia` [kg·m²].
        """
        if "mass" in asked:
            self._body.hub.mHub, self._body.hub.IHubPntBc_B = asked["mass"], asked["inertia"]
            self._body.updateSCMassProps(1e-9 * self._now_ns)
        self._outside.extForce_N = _column(asked["force"])
        self._outside.extTorquePntB_B = _column(asked["torque"])
        if self._wheels is not None:
            torques = messaging.ArrayMotorTorqueMsgPayload()
            torques.motorTorque = asked["drive"]
            self._command.write(torques, self._now_ns)
        elif self._couples:
            self._open(asked["drive"])
        self._run(int(asked["steps"]) * self._step_ns)

    def state(self) -> dict[str, Any]:
        """Where it is; see the module."""
        state = self._body.scStateOutMsg.read()
        speeds = [] if self._wheels is None else self._wheels.rwSpeedOutMsg.read().wheelSpeeds
        return {
            "position": list(state.r_CN_N),
            "velocity": list(state.v_CN_N),
            "mrp": list(state.sigma_BN),
            "rate": list(state.omega_BN_B),
            "acceleration": list(state.nonConservativeAccelpntB_B),
            "turn_acceleration": list(state.omegaDot_BN_B),
            "speeds": list(speeds)[: self._count],
        }

    _count = 0  # of wheels

    def _add_thrusters(self, thrusters: list[dict[str, Any]]) -> None:
        self._valves = []
        effector = thrusterDynamicEffector.ThrusterDynamicEffector()
        effector.ModelTag = "thrusters"
        for each in thrusters:
            valve = thrusterDynamicEffector.THRSimConfig()
            valve.thrLoc_B, valve.thrDir_B = each["place"], each["direction"]
            valve.MaxThrust, valve.MinOnTime, valve.steadyIsp = 0.0, 0.0, 0.0
            valve.updateOnly = True  # the other process counts the mass that leaves
            effector.addThruster(valve)
            self._valves.append(valve)
        self._body.addDynamicEffector(effector)
        self._simulation.AddModelToTask(TASK, effector, 2)
        self._command = messaging.THRArrayOnTimeCmdMsg()
        effector.cmdsInMsg.subscribeTo(self._command)

    def _open(self, thrusts: list[float]) -> None:
        """Open the valves of thrusters that push, and close the others."""
        for valve, thrust, couple in zip(self._valves, thrusts, self._couples, strict=True):
            valve.MaxThrust, valve.MaxSwirlTorque = thrust, couple * thrust
        times = messaging.THRArrayOnTimeCmdMsgPayload()
        times.OnTimeRequest = [OPEN_S if thrust else 0.0 for thrust in thrusts]
        self._command.write(times, self._now_ns)

    def _add_wheels(self, axes: list[list[float]], spin_inertia: float) -> None:
        factory = simIncludeRW.rwFactory()
        for axis in axes:
            # Torques arrive within the limits of motors and speeds.
            factory.create(
                "custom", axis, Omega=0.0, Omega_max=1e6 * RPM, Js=spin_inertia, useMaxTorque=False
            )
        self._wheels, self._count = reactionWheelStateEffector.ReactionWheelStateEffector(), len(axes)
        factory.addToSpacecraft("wheels", self._wheels, self._body)
        self._simulation.AddModelToTask(TASK, self._wheels, 2)
        self._command = messaging.ArrayMotorTorqueMsg()
        self._wheels.rwMotorCmdInMsg.subscribeTo(self._command)

    def _run(self, duration_ns: int) -> None:
        self._now_ns += duration_ns
        self._simulation.ConfigureStopTime(self._now_ns)
        self._simulation.ExecuteSimulation()


def _column(vector: list[float]) -> list[list[float]]:
    return [[part] for part in vector]


def serve(pipe: Any) -> None:
    """Answer requests until the other side closes the pipe."""
    bskLogging.setDefaultLogLevel(bskLogging.BSK_WARNING)
    pipe.send_bytes(json.dumps({"version": __version__}).encode())
    crafts: dict[int, Craft] = {}
    while True:
        try:
            asked = json.loads(pipe.recv_bytes())
        except EOFError:
            return
        pipe.send_bytes(json.dumps(_answer(crafts, asked)).encode())


def _answer(crafts: dict[int, Craft], asked: dict[str, Any]) -> dict[str, Any]:
    number = int(asked["craft"])
    if "end" in asked:
        crafts.pop(number, None)
        return {}
    if "begin" in asked:
        crafts[number] = Craft(asked["begin"])
    for move in asked.get("moves", ()):
        crafts[number].move(move)
    return crafts[number].state()


if __name__ == "__main__":
    serve(Connection(int(sys.argv[1])))
