"""Drives a spacecraft with reaction wheels in Basilisk, as a JSON file says. Run by the Python of the peers."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from Basilisk.architecture import messaging
from Basilisk.simulation import GravityGradientEffector, reactionWheelStateEffector, spacecraft
from Basilisk.utilities import SimulationBaseClass, macros, simIncludeGravBody, simIncludeRW

RPM = 30.0 / np.pi  # of a rad/s
asked = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))

simulation = SimulationBaseClass.SimBaseClass()
process = simulation.CreateNewProcess("dynamics")
process.addTask(simulation.CreateNewTask("task", macros.sec2nano(asked["dt"])))

body = spacecraft.Spacecraft()
body.ModelTag = "body"
body.hub.mHub = asked["mass"]
body.hub.r_BcB_B = [[0.0], [0.0], [0.0]]
body.hub.IHubPntBc_B = asked["inertia"]
body.hub.sigma_BNInit = [[0.0], [0.0], [0.0]]
body.hub.omega_BN_BInit = [[rate] for rate in asked["rate"]]
simulation.AddModelToTask("task", body, 1)

factory = simIncludeRW.rwFactory()
for axis, speed in zip(asked["axes"], asked["speeds"], strict=True):
    factory.create("custom", axis, Omega=speed * RPM, Js=asked["spin_inertia"], u_max=asked["largest_torque"])
wheels = reactionWheelStateEffector.ReactionWheelStateEffector()
factory.addToSpacecraft("wheels", wheels, body)
simulation.AddModelToTask("task", wheels, 2)

if asked["orbit_rate"]:  # a circular orbit over the pole z, towards x
    earth = simIncludeGravBody.gravBodyFactory()
    planet = earth.createEarth()
    planet.isCentralBody = True
    planet.mu = asked["orbit_rate"] ** 2 * asked["orbit_radius"] ** 3
    earth.addBodiesTo(body)
    body.hub.r_CN_NInit = [[0.0], [0.0], [asked["orbit_radius"]]]
    body.hub.v_CN_NInit = [[asked["orbit_rate"] * asked["orbit_radius"]], [0.0], [0.0]]
    gradient = GravityGradientEffector.GravityGradientEffector()
    gradient.addPlanetName(planet.planetName)
    body.addDynamicEffector(gradient)
    simulation.AddModelToTask("task", gradient, 3)

command = messaging.ArrayMotorTorqueMsg()
wheels.rwMotorCmdInMsg.subscribeTo(command)
found = {"rates": [], "speeds": [], "mrps": []}
simulation.InitializeSimulation()
for number, torques in enumerate(asked["torques"], 1):
    payload = messaging.ArrayMotorTorqueMsgPayload()
    payload.motorTorque = torques
    command.write(payload, simulation.TotalSim.CurrentNanos)
    simulation.ConfigureStopTime(macros.sec2nano(number * asked["period"]))
    simulation.ExecuteSimulation()
    state, spinning = body.scStateOutMsg.read(), wheels.rwSpeedOutMsg.read()
    found["rates"].append(list(state.omega_BN_B))
    found["mrps"].append(list(state.sigma_BN))
    found["speeds"].append(list(spinning.wheelSpeeds)[: len(asked["axes"])])
sys.stdout.write("\n" + json.dumps(found))
