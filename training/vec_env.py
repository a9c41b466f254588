"""The core's batch as a Stable-Baselines3 vector environment."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
import torch
from stable_baselines3.common.vec_env import VecEnv

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.disturbance_inputs import disturbance_terms
from fulmar_core.controllers.wrench_choice import WRENCH, WrenchChoice
from fulmar_core.controllers.wrench_shares import BODY_TERMS
from fulmar_core.robots.actuators.pushing import WRENCH as BODY_WRENCH
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.episode import episode_steps
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.simulation.symmetry import Mirror, Symmetry
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.tasks.observation import shares
from fulmar_core.worlds.scenario import Scenario
from training.bodies import KnownBodies
from training.compiled import step_of
from training.disturbance_inputs import DisturbanceInputs
from training.incremental_actions import KINDS, check_incremental, incremental_shares
from training.settings import ActionSpace
from training.worlds import actuator_space, observation_space, shares_space, training_task


class BatchVecEnv(VecEnv):
    """Worlds that learn together; each begins the next episode by itself when its episode is over.

    Actions are on/off for on/off valves, or the wrench that valves are chosen for, or numbers of incremental actions,
    else shares of full command in [-1, 1]. An episode ends when the robot leaves the geofence or touches an obstacle
    (terminated), or its time is up (truncated: the value of the last state still counts). First episodes have random
    lengths, so that resets spread out over time.

    Attributes:
        hold: Control steps of one action; rewards of them are added up.
    """

    def __init__(
        self,
        robot: Robot,
        task: Task,
        scenario: Scenario,
        *,
        worlds: int,
        seed: int,
        reward_scale: float = 1.0,
        training: bool = True,
        staggered: bool = True,
        disturbance_inputs: bool = False,
        body_inputs: bool = False,
        action_space: ActionSpace = "actuators",
        valve_cost: float = 1.0,
        mirror: Symmetry | None = None,
        action_hold: int = 0,
        compiled: bool = False,
    ) -> None:
        """Build the worlds.

        Args:
            robot: The robot.
            task: Gives observation, reward and episode length.
            scenario: What episodes are drawn from.
            worlds: Number of worlds, >= 1.
            seed: Seed of every draw.
            reward_scale: Factor on the rewards.
            training: Start episodes where learning starts.
            staggered: First episodes have random lengths.
            disturbance_inputs: Observations include pushes and dead valves
                (`fulmar_core.controllers.disturbance_inputs`).
            body_inputs: Observations include what each world's body can do (`training.bodies`).
            action_space: "wrench": actions are shares of the strongest wrench, for which actuators are chosen.
            valve_cost: Of an open valve in that choice, as a multiple.
            mirror: Goals on the right are mirrored to the left, or those behind to the front
                (`fulmar_core.simulation.symmetry`).
            action_hold: Control steps of an incremental action (`training.incremental_actions`); 0: shares of command.
            compiled: Steps are compiled (`training.compiled`).

        Raises:
            ConfigError: The robot has no such symmetry, or no slew for incremental actions, or there is no compiler.
        """
        task = training_task(task, scenario).fitted(robot)
        self.robot, self.task, self._reward_scale = robot, task, reward_scale
        self._scenario, self._worlds, self._training, self._seed = scenario, worlds, training, seed
        self._staggered = staggered
        self._effort = robot.costs.effort
        self._disturbances = (
            DisturbanceInputs(robot, worlds=worlds, seed=seed) if disturbance_inputs else None
        )
        wrench = action_space == "wrench"
        self.choice = WrenchChoice.of(robot, valve_cost) if wrench and robot.actuators.binary else None
        self.takes_body = body_inputs
        self.bodies = _bodies_of(robot) if wrench and self.choice is None else None
        self.mirror = Mirror.of(robot, task, mirror) if mirror else None
        if action_hold:
            check_incremental(robot)
        self.incremental, self.hold = action_hold > 0, max(action_hold, 1)
        self._mirrored = np.zeros(worlds, dtype=bool)  # where the last observation was mirrored
        self._compiled = compiled
        self._begin()
        self._horizon = episode_steps(task, self.simulation.control_dt)
        self._scale = np.asarray(robot.actuators.scale, dtype=np.float32)
        count = len(robot.actuators.names)
        names = self.simulation.observer.names
        more = len(disturbance_terms(robot)) if disturbance_inputs else BODY_TERMS * body_inputs
        actions = shares_space(WRENCH) if self.choice else actuator_space(robot)
        if self.bodies:
            actions = shares_space(BODY_WRENCH)
        if self.incremental:
            actions = gymnasium.spaces.MultiDiscrete([KINDS] * count)
        super().__init__(worlds, observation_space(len(names) + more), actions)
        self._age = np.zeros(worlds, dtype=int)
        self._actions = np.zeros((worlds, count), dtype=np.float32)

    def _begin(self) -> None:
        """Build the worlds anew."""
        self.simulation = BatchSimulation(
            self.robot,
            self.task,
            self._scenario,
            worlds=self._worlds,
            seed=self._seed,
            training=self._training,
        )
        self._observed_step = step_of(self.simulation, compiled=self._compiled)
        self._look_at_bodies()

    def _look_at_bodies(self) -> None:
        if self.bodies:
            self.bodies = KnownBodies.of_worlds(self.robot, self.simulation.world)

    @property
    def takes_disturbances(self) -> bool:
        """Whether observations include pushes and dead valves."""
        return self._disturbances is not None

    def state(self) -> dict[str, Any]:
        """The mutable state, as values that pickle; for an exact resume."""
        state = {"simulation": self.simulation.snapshot(), "age": self._age.copy()}
        state["mirrored"] = self._mirrored.copy()
        return state | ({"disturbances": self._disturbances.state()} if self._disturbances else {})

    def set_state(self, state: dict[str, Any]) -> None:
        """Restore what `state` returned."""
        self.simulation.restore(state["simulation"])
        self._look_at_bodies()
        self._age, self._mirrored = state["age"].copy(), state["mirrored"].copy()
        if self._disturbances:
            self._disturbances.set_state(state["disturbances"])

    def set_effort(self, factor: float) -> None:
        """Set the cost of using the actuators, as a multiple of the robot's own [-]."""
        self._effort = factor * self.robot.costs.effort

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed of the next `reset`."""
        self._seed = self._seed if seed is None else seed
        return [self._seed] * self.num_envs

    def reset(self) -> np.ndarray:
        """Begin anew in every world; returns the observations, shape (worlds, n)."""
        self._begin()
        rng = np.random.Generator(np.random.Philox(self._seed))
        self._age = rng.integers(0, self._horizon if self._staggered else 1, self.num_envs)
        self.reset_infos = [{} for _ in range(self.num_envs)]
        if self._disturbances:
            self._disturbances.reset()
        return self._completed(np.asarray(self.simulation.observe()))

    def begin_anew(self, worlds: Sequence[int] | np.ndarray) -> None:
        """Begin the next episode in some worlds."""
        self.simulation.reset(worlds)
        if self.bodies and self.bodies.terms.ndim > 1:
            some = np.asarray(worlds)
            self.bodies.write(some, KnownBodies.of_worlds(self.robot, self.simulation.world, some))
        self._age[np.asarray(worlds)] = 0
        if self._disturbances:
            self._disturbances.reset(worlds)

    def _completed(self, observations: np.ndarray) -> np.ndarray:
        return self._shown(self._with_own_terms(observations), np.arange(self.num_envs))

    def _with_own_terms(self, observations: np.ndarray, worlds: Any = slice(None)) -> np.ndarray:
        """Observations of some worlds, with what the settings add to those of the task."""
        if self._disturbances:
            return np.hstack((observations, self._disturbances.inputs(self.simulation)[worlds]))
        if self.takes_body:
            assert self.bodies is not None
            terms = np.broadcast_to(self.bodies.terms, (self.num_envs, BODY_TERMS))
            return np.hstack((observations, terms[worlds]))
        return observations

    def _shown(self, observations: np.ndarray, worlds: np.ndarray) -> np.ndarray:
        """Observations, mirrored where the goal asks for it; remembers where."""
        if self.mirror is not None:
            mirrored = observations[:, self.mirror.side] < 0.0
            self._mirrored[worlds] = mirrored
            observations = np.where(mirrored[:, None], observations @ self.mirror.seen, observations)
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        """Take the actions of the coming step, shape (worlds, n)."""
        actions = np.asarray(actions, dtype=np.float32)
        if self.incremental:
            actions = actions - 1.0
        actions = self.answered(actions)
        if self.bodies:
            self._actions = self.bodies.shares.openings(torch.from_numpy(actions)).numpy()
        else:
            self._actions = self._valves(self.choice, actions) if self.choice else actions

    def answered(self, shares: np.ndarray) -> np.ndarray:
        """Shares of full command, mirrored where the last observation was; its own inverse."""
        if self.mirror is None:
            return shares
        return np.where(self._mirrored[:, None], shares @ self.mirror.done, shares)

    def inputs(self) -> Inputs:
        """What a controller without an estimator would act on now."""
        simulation = self.simulation
        observation, previous = (
            np.asarray(part, dtype=float) for part in (simulation.observe(), simulation.command)
        )
        state, goal = simulation.measured.in_float64(), goal_in_float64(simulation.goal)
        return Inputs(state, goal, observation, previous, None, 0, simulation.control_dt)

    def _valves(self, choice: WrenchChoice, shares: np.ndarray) -> np.ndarray:
        # By PyTorch, which keeps to the threads it was given; NumPy's would disturb another run.
        dead = torch.from_numpy(self._disturbances.dead.astype(np.float32)) if self._disturbances else None
        chosen: np.ndarray = choice.best(torch.from_numpy(shares), dead).numpy()
        return chosen

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Move `hold` control steps; returns observations, rewards, dones and infos."""
        simulation = self.simulation
        reward, ended_early, seen = self._step()
        for _ in range(self.hold - 1):
            more, ended, seen = self._step()
            reward, ended_early = reward + more, ended_early | ended
        self._age += self.hold
        timed_out = (self._age >= self._horizon) & ~ended_early
        done = ended_early | timed_out
        if self._disturbances:
            self._disturbances.learn(simulation)
        observations = self._completed(seen)
        # One shared dictionary where nothing ended: a thousand empty ones a step would cost more than the physics.
        infos: list[dict[str, Any]] = [_EMPTY] * self.num_envs
        ended = np.flatnonzero(done)
        if ended.size:
            for world in ended:
                infos[world] = {
                    "terminal_observation": observations[world],
                    "TimeLimit.truncated": bool(timed_out[world]),
                }
            self.begin_anew(ended)
            observations = observations.copy(order="K")  # the last ones are still in the infos
            observations[ended] = self._observed(ended)
        return observations, np.asarray(reward * self._reward_scale, dtype=np.float32), done, infos

    def _step(self) -> tuple[np.ndarray, ...]:
        """One control step; returns rewards, terminations and observations."""
        wanted = self._actions
        if self.incremental:
            wanted = incremental_shares(wanted, shares(self.simulation.command, self._scale))
        result = self._observed_step(wanted * self._scale, effort=self._effort)
        return tuple(np.asarray(part) for part in result)

    def _observed(self, worlds: np.ndarray) -> np.ndarray:
        observations = np.asarray(self.simulation.observe(worlds))
        return self._shown(self._with_own_terms(observations, worlds), worlds)

    def close(self) -> None:
        """Nothing to release."""

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Attribute of this object, once for every world asked about."""
        return [getattr(self, attr_name, None) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of this object."""
        setattr(self, attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Call a method of this object, once for every world asked about."""
        return [getattr(self, method_name)(*args, **kwargs) for _ in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """Worlds are never wrapped one by one."""
        return [False for _ in self._get_indices(indices)]


def _bodies_of(robot: Robot) -> KnownBodies:
    """Of a robot whose network asks for a wrench.

    Raises:
        ConfigError: No wrench can be allocated to its actuators.
    """
    try:
        return KnownBodies.of_robot(robot)
    except ValueError as error:
        raise ConfigError(f"'action_space: wrench': {error} Leave it out.") from None


_EMPTY: dict[str, Any] = {}
