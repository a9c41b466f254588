"""How many control steps a second MuJoCo's batch rollout makes: physics alone.

MuJoCo's own drag in a fluid stands for the water, which it would need a callback for, so that this rollout is faster
than any boat's could be. Beside it robots on water are rolled out in the plant's own water. Bodies in space are rolled
out by Runge-Kutta, as the plant has them, and beside it by Euler's method, which costs less and gains energy.
"""

from __future__ import annotations

import time

import mujoco
import mujoco.rollout
import numpy as np
from scipy.spatial.transform import Rotation

from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.tasks import Task
from fulmar_core.worlds.scenario import Scenario
from sim_nodes.mujoco_model import Scene
from sim_nodes.mujoco_model.floater import Floater

DIFFERENT = 16  # batches of random commands, used again and again
SIMULATED, STRETCH = 64, 10  # robots in one rollout, and control steps, each with its own command
SEED = 1
_STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS
_CONTROL = mujoco.mjtState.mjSTATE_CTRL | mujoco.mjtState.mjSTATE_XFRC_APPLIED


INTEGRATORS = {"RK4": mujoco.mjtIntegrator.mjINT_RK4, "Euler": mujoco.mjtIntegrator.mjINT_EULER}


class MujocoPace:
    """MuJoCo's batch rollout of the same robot at random commands.

    Attributes:
        integrator: Name of MuJoCo's method, one of `INTEGRATORS`.
        step_s: MuJoCo's time step [s].
    """

    def __init__(self, robot: Robot, *, threads: int, integrator: str = "") -> None:
        """Compile the robot and draw commands.

        Args:
            robot: The robot.
            threads: That MuJoCo may use.
            integrator: One of `INTEGRATORS`; the plant's own by default.
        """
        scene = Scene(robot)
        self._model, model, data = scene.model, scene.model, scene.data
        if integrator:
            model.opt.integrator = INTEGRATORS[integrator]
        self.integrator = next(name for name, kind in INTEGRATORS.items() if kind == model.opt.integrator)
        self.step_s = float(model.opt.timestep)
        if robot.hydrodynamics is not None:
            model.opt.gravity[:] = 0.0  # what water would carry must not sink
            model.opt.density, model.opt.viscosity = robot.hydrodynamics.hydrostatics.water_density, 1e-3
        self._datas = [mujoco.MjData(model) for _ in range(threads)]
        held = robot.timing.substeps(robot.timing.control_hz) * scene.robot_model.steps_per_tick
        controls = _random_controls(robot, scene, SIMULATED * STRETCH)
        self._controls = np.repeat(controls.reshape(SIMULATED, STRETCH, -1), held, axis=1)
        state = np.zeros(mujoco.mj_stateSize(model, _STATE))
        mujoco.mj_resetData(model, data)
        mujoco.mj_getState(model, data, state, _STATE)
        self._states = np.tile(state, (SIMULATED, 1))

    def steps_per_s(self, seconds: float) -> float:
        """Roll out for a while; returns how many control steps of single robots were made a second."""
        began, count = time.perf_counter(), 0
        while time.perf_counter() - began < seconds or not count:
            mujoco.rollout.rollout(
                self._model, self._datas, self._states, self._controls, persistent_pool=True
            )
            count += SIMULATED * STRETCH
        return count / (time.perf_counter() - began)


class AfloatPace:
    """MuJoCo's batch rollout of a robot in the plant's own water, at random commands.

    Its forces follow from where each physics step ends, so the rollout goes step by step, and the water of all robots
    is computed at once in between.

    Attributes:
        states: MuJoCo's full physics state of each robot, shape (worlds, n).
    """

    def __init__(self, robot: Robot, task: Task, scenario: Scenario, *, worlds: int, threads: int) -> None:
        """Put robots on the water and draw commands; as many as the batch has, since few would cost more each."""
        scene = Scene(robot)
        scene.begin(draw_episode(robot, task, scenario, seed=SEED, number=0))
        self._model = model = scene.model
        assert isinstance(scene.robot_model, Floater)
        assert scene.robot_model.water is not None
        self._water = scene.robot_model.water
        self._datas = [mujoco.MjData(model) for _ in range(threads)]
        state = np.zeros(mujoco.mj_stateSize(model, _STATE))
        mujoco.mj_getState(model, scene.data, state, _STATE)
        self.states = np.tile(state, (worlds, 1))
        self._control = np.zeros((worlds, 1, mujoco.mj_stateSize(model, _CONTROL)))
        self._substeps = robot.timing.substeps(robot.timing.control_hz)
        controls = _random_controls(robot, scene, SIMULATED * DIFFERENT)
        self._thrusts = np.resize(controls, (DIFFERENT, worlds, model.nu))
        self._calm = np.zeros((worlds, 6))

    def steps_per_s(self, seconds: float) -> float:
        """Roll out for a while; returns how many control steps of single robots were made a second."""
        began, count = time.perf_counter(), 0
        while time.perf_counter() - began < seconds or not count:
            thrusts = self._thrusts[count % DIFFERENT]
            for _ in range(self._substeps):
                self.step(thrusts)
            count += 1
        return count * len(self.states) / (time.perf_counter() - began)

    def step(self, thrusts: np.ndarray) -> None:
        """One physics step of all robots at these thrusts, shape (worlds, n) [N].

        A state is time, place, attitude and velocities; a control is thrusts, and a push of every body, the hull last.
        """
        qpos, qvel = self.states[:, 1:8], self.states[:, 8:14]
        to_world = Rotation.from_quat(np.roll(qpos[:, 3:], -1, axis=1)).as_matrix()  # MuJoCo has w first
        self._control[:, 0, : thrusts.shape[1]] = thrusts
        self._control[:, 0, -6:] = self._water.wrench(qpos[:, 2], to_world, qvel, thrusts, self._calm)
        states, _ = mujoco.rollout.rollout(
            self._model, self._datas, self.states, self._control, control_spec=_CONTROL, persistent_pool=True
        )
        self.states = states[:, 0]


def random_commands(robot: Robot, count: int, rng: np.random.Generator) -> np.ndarray:
    """Commands within the actuators' limits, shape (count, n)."""
    actuators = robot.actuators
    return np.asarray(
        actuators.limited(rng.uniform(-1.0, 1.0, (count, len(actuators.names))) * actuators.scale)
    )


def _random_controls(robot: Robot, scene: Scene, count: int) -> np.ndarray:
    """What MuJoCo's actuators do at random commands, shape (count, n)."""
    controls = np.empty((count, scene.model.nu))
    rng = np.random.default_rng(SEED)
    for row, command in zip(controls, random_commands(robot, count, rng), strict=True):
        scene.robot_model.drive(scene.model, scene.data, command, np.ones_like(command), (0.0, 0.0, 0.0))
        row[:] = scene.data.ctrl
    return controls
