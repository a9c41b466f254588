"""The core's batch as a Stable-Baselines3 vector environment."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
import torch
from stable_baselines3.common.vec_env import VecEnv

from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.disturbance_inputs import disturbance_terms
from fulmar_core.controllers.wrench_choice import WRENCH, WrenchChoice
from fulmar_core.disturbances.scenario import Scenario
from fulmar_core.episode import episode_steps
from fulmar_core.goal import goal_in_float64
from fulmar_core.observation import shares
from fulmar_core.planar import in_float64
from fulmar_core.robot import Robot
from fulmar_core.simulation import BatchSimulation
from fulmar_core.symmetry import Mirror, Symmetry
from fulmar_core.tasks import Task
from training.compiled import step_of
from training.disturbance_inputs import ToldTruth
from training.incremental_actions import KINDS, check_orders, shares_asked
from training.worlds import action_space, asked_for, observation_space, shares_space


class BatchVecEnv(VecEnv):
    """Worlds that learn together; each begins again by itself when its episode is over.

    Actions are on/off for valves that know only these, or the wrench that they should bring up, or numbers of orders,
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
        told: bool = False,
        wrench: bool = False,
        gas: float = 1.0,
        mirror: Symmetry | None = None,
        orders_held: int = 0,
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
            told: Observations also tell pushes and dead valves (`fulmar_core.controllers.disturbance_inputs`).
            wrench: Actions are wanted wrenches, as shares of the strongest, for which valves are chosen.
            gas: What a valve costs in that choice, as a multiple.
            mirror: Goals on the right are shown, and answered, as on the left, or those behind as those ahead
                (`fulmar_core.symmetry`).
            orders_held: Control steps that an incremental action is held (`training.incremental_actions`); 0: direct.
            compiled: Steps are compiled (`training.compiled`).

        Raises:
            ConfigError: The robot cannot be mirrored so, or takes no orders, or there is no compiler.
        """
        task = asked_for(task, scenario).fitted(robot)
        self.robot, self.task, self._reward_scale = robot, task, reward_scale
        self._scenario, self._worlds, self._training, self._seed = scenario, worlds, training, seed
        self._staggered = staggered
        self._effort = robot.costs.effort
        self._told = ToldTruth(robot, worlds=worlds, seed=seed) if told else None
        self.choice = WrenchChoice.of(robot, gas) if wrench else None
        self.mirror = Mirror.of(robot, task, mirror) if mirror else None
        if orders_held:
            check_orders(robot)
        self.takes_orders, self.hold = orders_held > 0, max(orders_held, 1)
        self._mirrored = np.zeros(worlds, dtype=bool)  # where the last observation was mirrored
        self._compiled = compiled
        self._begin()
        self._horizon = episode_steps(task, self.simulation.control_dt)
        self._scale = np.asarray(robot.actuators.scale, dtype=np.float32)
        count = len(robot.actuators.names)
        names = self.simulation.observer.names
        more = len(disturbance_terms(robot)) if told else 0
        actions = shares_space(WRENCH) if wrench else action_space(robot)
        if self.takes_orders:
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

    @property
    def told(self) -> bool:
        """Whether observations also tell pushes and dead valves."""
        return self._told is not None

    def state(self) -> dict[str, Any]:
        """Everything that a step changes, as values that pickle; for an exact resume."""
        state = {"simulation": self.simulation.snapshot(), "age": self._age.copy()}
        state["mirrored"] = self._mirrored.copy()
        return state | ({"told": self._told.state()} if self._told else {})

    def set_state(self, state: dict[str, Any]) -> None:
        """Go on from what `state` returned."""
        self.simulation.restore(state["simulation"])
        self._age, self._mirrored = state["age"].copy(), state["mirrored"].copy()
        if self._told:
            self._told.set_state(state["told"])

    def set_effort(self, factor: float) -> None:
        """What using the actuators costs from now on, as a multiple of the robot's own costs [-]."""
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
        if self._told:
            self._told.forget()
        return self._completed(np.asarray(self.simulation.observe()))

    def begin_anew(self, worlds: Sequence[int] | np.ndarray) -> None:
        """Begin the next episode in some worlds, whatever has become of the last one."""
        self.simulation.reset(worlds)
        self._age[np.asarray(worlds)] = 0
        if self._told:
            self._told.forget(worlds)

    def _completed(self, observations: np.ndarray) -> np.ndarray:
        if self._told:
            observations = np.hstack((observations, self._told.told(self.simulation)))
        return self._shown(observations, np.arange(self.num_envs))

    def _shown(self, observations: np.ndarray, worlds: np.ndarray) -> np.ndarray:
        """The mirror image of some goals, where it was asked for; of which, is remembered."""
        if self.mirror is not None:
            mirrored = observations[:, self.mirror.side] < 0.0
            self._mirrored[worlds] = mirrored
            observations = np.where(mirrored[:, None], observations @ self.mirror.seen, observations)
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        """Take the actions of the coming step, shape (worlds, n)."""
        actions = np.asarray(actions, dtype=np.float32)
        if self.takes_orders:
            actions = actions - 1.0
        actions = self.answered(actions)
        self._actions = self._valves(self.choice, actions) if self.choice else actions

    def answered(self, shares: np.ndarray) -> np.ndarray:
        """Shares of full command, mirrored where the last observation was; twice is not at all."""
        if self.mirror is None:
            return shares
        return np.where(self._mirrored[:, None], shares @ self.mirror.done, shares)

    def inputs(self) -> Inputs:
        """What a controller without an estimator would act on now."""
        simulation = self.simulation
        observation, previous = (
            np.asarray(part, dtype=float) for part in (simulation.observe(), simulation.command)
        )
        state, goal = in_float64(simulation.measured), goal_in_float64(simulation.goal)
        return Inputs(state, goal, observation, previous, None, 0, simulation.control_dt)

    def _valves(self, choice: WrenchChoice, shares: np.ndarray) -> np.ndarray:
        # By PyTorch, which keeps to the threads it was given; NumPy's would be in the way of another run's.
        dead = torch.from_numpy(self._told.dead.astype(np.float32)) if self._told else None
        chosen: np.ndarray = choice.best(torch.from_numpy(shares), dead).numpy()
        return chosen

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Move while the actions stand, usually one control step; returns observations, rewards, dones and infos."""
        simulation = self.simulation
        reward, ended_early, seen = self._step()
        for _ in range(self.hold - 1):
            more, ended, seen = self._step()
            reward, ended_early = reward + more, ended_early | ended
        self._age += self.hold
        timed_out = (self._age >= self._horizon) & ~ended_early
        done = ended_early | timed_out
        if self._told:
            self._told.learn(simulation)
        observations = self._completed(seen)
        # One shared dictionary where nothing ended: a thousand empty ones a step would cost more than the physics.
        infos: list[dict[str, Any]] = [_NOTHING_TO_SAY] * self.num_envs
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
        """One control step; returns rewards, whether episodes ended before their time, and observations."""
        asked = self._actions
        if self.takes_orders:
            asked = shares_asked(asked, shares(self.simulation.command, self._scale))
        told = self._observed_step(asked * self._scale, effort=self._effort)
        return tuple(np.asarray(part) for part in told)

    def _observed(self, worlds: np.ndarray) -> np.ndarray:
        observations = np.asarray(self.simulation.observe(worlds))
        if self._told:
            observations = np.hstack((observations, self._told.told(self.simulation)[worlds]))
        return self._shown(observations, worlds)

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


_NOTHING_TO_SAY: dict[str, Any] = {}
