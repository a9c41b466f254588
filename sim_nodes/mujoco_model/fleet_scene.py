"""Compiled MuJoCo model of several robots on one floor, and each robot's part of it."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.episode import Episode
from fulmar_core.states.gravity import GRAVITY
from sim_nodes.mujoco_model.scene import PALE, RobotModel, robot_model_of
from sim_nodes.mujoco_model.scenery import BODY, add_scenery, add_sensors

KINDS = ("planar", "rolling")  # kinds of robots that one floor carries


class FleetScene:
    """One model with every robot of a fleet, which touch and push each other.

    Attributes:
        parts: The part of each robot, by its name.
        steps_per_tick: MuJoCo steps in one physics tick; that of the robot which needs the finest.
    """

    def __init__(self, robots: Mapping[str, Robot]) -> None:
        """Compile.

        Args:
            robots: By name; all of one physics tick, in the plane.

        Raises:
            ConfigError: Robots of two worlds, of two physics ticks, or MuJoCo rejects one.
        """
        check_one_floor(robots)
        models = {name: robot_model_of(robot) for name, robot in robots.items()}
        tick_s = next(iter(robots.values())).timing.physics_dt
        self.steps_per_tick = max(model.steps_per_tick for model in models.values())
        spec = mujoco.MjSpec()
        spec.modelname = "fleet"
        spec.option.timestep = tick_s / self.steps_per_tick
        spec.option.gravity = [0.0, 0.0, -GRAVITY]
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        add_scenery(spec, PALE)
        for name, model in models.items():
            alone = mujoco.MjSpec()
            add_sensors(alone, model.add(alone))
            if alone.option.cone == mujoco.mjtCone.mjCONE_ELLIPTIC:  # wheels ask for it
                spec.option.cone, spec.option.impratio = alone.option.cone, alone.option.impratio
            spec.attach(alone, prefix=f"{name}/", frame=spec.worldbody.add_frame())
        try:
            self.model = spec.compile()
        except ValueError as error:
            raise ConfigError(f"MuJoCo cannot build the fleet: {' '.join(str(error).split())}.") from error
        self.data = mujoco.MjData(self.model)
        self._scratch = mujoco.MjData(self.model)
        self.parts = {name: FleetPart(self, name, robot) for name, robot in robots.items()}

    def refresh(self) -> None:
        """Compute what follows from the masses, after they changed; the state stays."""
        mujoco.mj_setConst(self.model, self._scratch)


class FleetPart:
    """One robot's part of a fleet's model, with the interface of `Scene`.

    `model` and `data` are views that begin at the robot's first body, joint and actuator, so that the robot's
    `RobotModel` finds them at the same indices as in a model of its own.
    """

    def __init__(self, scene: FleetScene, name: str, robot: Robot) -> None:
        """Find the robot's bodies, joints, actuators and sensors.

        Args:
            scene: Compiled, with the robot.
            name: Of the robot.
            robot: The robot.
        """
        from sim_nodes.mujoco_model.scene import Scene

        alone = Scene(robot)
        self.robot_model: RobotModel = alone.robot_model
        self.name, self._scene = name, scene
        whole, first = scene.model, scene.model.body(f"{name}/{BODY}").id
        bodies = slice(first - 1, first - 1 + alone.model.nbody)  # index 0 is the world in both
        joint = int(whole.body_jntadr[first])
        self._qpos = _span(int(whole.jnt_qposadr[joint]), alone.model.nq)
        self._qvel = _span(int(whole.jnt_dofadr[joint]), alone.model.nv)
        names = [whole.actuator(i).name for i in range(whole.nu)]
        begin = next(i for i, other in enumerate(names) if other.startswith(f"{name}/"))
        controls = _span(begin, alone.model.nu)
        states = _span(max(0, int(whole.actuator_actadr[begin])), alone.model.na)
        self.sensors = {
            sensor: _span(
                int(whole.sensor(f"{name}/{sensor}").adr[0]), int(alone.model.sensor(sensor).dim[0])
            )
            for sensor in (alone.model.sensor(i).name for i in range(alone.model.nsensor))
        }
        data = scene.data
        fields = ("body_mass", "body_inertia", "body_ipos", "body_iquat")
        self.model: Any = SimpleNamespace(**{field: getattr(whole, field)[bodies] for field in fields})
        self.data: Any = SimpleNamespace(
            qpos=data.qpos[self._qpos],
            qvel=data.qvel[self._qvel],
            ctrl=data.ctrl[controls],
            act=data.act[states],
            xfrc_applied=data.xfrc_applied[bodies],
            time=0.0,
        )
        self._whole_body = 0.0, np.zeros(3)

    @property
    def things(self) -> dict[str, np.ndarray]:
        """None: a fleet's floor carries robots alone."""
        return {}

    def begin(self, episode: Episode) -> None:
        """Set the start of an episode of this robot; the others stay as they are."""
        self.robot_model.take_world(self.model, episode.world)
        self._whole_body = float(self.model.body_mass[1]), self.model.body_inertia[1].copy()
        self._scene.refresh()
        for part in (self.data.qvel, self.data.ctrl, self.data.act, self.data.xfrc_applied):
            part[:] = 0.0
        self.robot_model.place(self.model, self.data, episode.start)
        self.data.time = 0.0

    def lighten(self, share: float) -> None:
        """Leave the robot's body a share of the mass and inertia with which the episode began."""
        mass, moments = self._whole_body
        self.model.body_mass[1], self.model.body_inertia[1] = share * mass, share * moments
        self._scene.refresh()

    def read(self) -> dict[str, np.ndarray]:
        """Copies of the sensors' values, by name."""
        data = self._scene.data.sensordata
        return {name: np.array(data[at]) for name, at in self.sensors.items()}


def check_one_floor(robots: Mapping[str, Robot]) -> None:
    """Refuse robots that one floor does not carry.

    Raises:
        ConfigError: With the first robot that does not fit.
    """
    ticks: dict[float, str] = {}
    for name, robot in robots.items():
        if robot.kind.name not in KINDS:
            raise ConfigError(
                f"robot '{name}' ({robot.name}) moves in {robot.state_type.WORLD}; a fleet's world is a floor for "
                "robots in the plane. Start it with a `fulmar up` of its own."
            )
        ticks.setdefault(robot.timing.physics_dt, name)
    if len(ticks) > 1:
        text = " and ".join(f"'{name}' {dt:g} s" for dt, name in ticks.items())
        raise ConfigError(f"robots of a fleet share one physics tick, and they have: {text}.")


def _span(begin: int, length: int) -> slice:
    return slice(begin, begin + length)
