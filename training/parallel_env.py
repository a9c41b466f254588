"""`swap_places` as a parallel environment of PettingZoo: robots of one type exchange places in the core's dynamics.

Every robot has the same observation and action, so that one policy can be shared by all. Robots do not push each other
here: an episode ends where two hulls overlap.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from pettingzoo import ParallelEnv

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.states.planar import PlanarState, to_body
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import Goal, no_obstacles
from fulmar_core.tasks.swap_places import swap_places
from fulmar_core.worlds.scenario import Scenario
from training.worlds import Worlds, actuator_space, observation_space

OTHER_TERMS = 4  # of each other robot: x, y [m] and their rates [m/s] from this one, in its body's frame
TOUCHED = -10.0  # reward of each robot where two hulls overlap

Named = dict[str, Any]


class SwapPlacesEnv(ParallelEnv):  # type: ignore[misc]  # PettingZoo has no types
    """Robots of one type that exchange places.

    An observation is that of the task, and `OTHER_TERMS` numbers of each other robot, those in the order of their names
    after this one's. The reward is the task's. Episodes of all end together: terminated where two hulls overlap or a
    robot leaves its geofence, truncated after the task's `episode_s`.
    """

    metadata: dict[str, Any] = {"name": "swap_places_v0", "render_modes": []}  # noqa: RUF012 - PettingZoo's own type

    def __init__(
        self, robot: Robot, task: Task, scenario: Scenario, *, robots: int = 4, seed: int = 0
    ) -> None:
        """Build the world.

        Args:
            robot: Of every place; it moves in the plane.
            task: Gives observation, reward and episode length; its goals are poses, such as `go_to_pose`.
            scenario: What bodies and disturbances are drawn from.
            robots: How many, >= 2.
            seed: Of the episodes until `reset` receives another, >= 0.

        Raises:
            ConfigError: Fewer than two robots, or the task has no pose in the plane as its goal.
        """
        if robots < 2:
            raise ConfigError(f"robots: found {robots}, need at least 2.")
        if task.state_type.AXES != PlanarState.AXES or task.goal_topic != "goal_pose":
            raise ConfigError(f"swap_places needs a task of poses in the plane, and '{task.name}' is none.")
        self._robot, self._task = robot, task
        self._worlds = Worlds(robot, task, scenario, worlds=robots, seed=seed, training=False)
        self._seed, self._number = seed, 0
        self.possible_agents = [f"robot_{index}" for index in range(robots)]
        self.agents: list[str] = []
        # The same objects each time: libraries seed them.
        terms = self._worlds.terms + OTHER_TERMS * (robots - 1)
        self.observation_spaces = {name: observation_space(terms) for name in self.possible_agents}
        self.action_spaces = {name: actuator_space(robot) for name in self.possible_agents}

    def observation_space(self, agent: str) -> gymnasium.Space[Any]:
        """Space of a robot's observations."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.Space[Any]:
        """Space of a robot's actions, that of `TaskEnv`."""
        return self.action_spaces[agent]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Named, Named]:
        """Begin an episode.

        Args:
            seed: Begin with the first episode of this seed; without it, with the next one.
            options: Not used; PettingZoo's own test gives one that no environment knows.

        Returns:
            Observations and empty dictionaries, by name.
        """
        if seed is not None:
            self._seed, self._number = seed, 0
            self._worlds.begin(seed)
        else:
            self._worlds.begin_next(np.arange(len(self.possible_agents)))
        self._place()
        self._number += 1
        self.agents = list(self.possible_agents)
        return self._by_name(self._completed(self._worlds.observe())), self._by_name([{}] * len(self.agents))

    def step(self, actions: Named) -> tuple[Named, Named, Named, Named, Named]:
        """Move one control step; returns observations, rewards, terminated, truncated and infos, by name."""
        if not self.agents:
            return {}, {}, {}, {}, {}
        chosen = np.stack([np.asarray(actions[name]) for name in self.agents])
        seen, reward, gone, late = self._worlds.step(chosen)
        touched = self._touched()
        over = bool(touched or gone.any())
        reward = reward + (TOUCHED if touched else 0.0)
        count = len(self.agents)
        found = (
            self._by_name(self._completed(seen)),
            self._by_name([float(each) for each in reward]),
            self._by_name([over] * count),
            self._by_name([bool(late.any()) and not over] * count),
            self._by_name([{}] * count),
        )
        if over or late.any():
            self.agents = []
        return found

    def _by_name(self, values: Any) -> Named:
        return dict(zip(self.agents or self.possible_agents, values, strict=True))

    def _place(self) -> None:
        """Put every robot at its place, with the place of another one as its goal."""
        simulation, count = self._worlds.simulation, len(self.possible_agents)
        draws = np.random.default_rng((self._seed, self._number))
        starts, goals = swap_places(int(draws.integers(2**31)), [self._robot.body.radius] * count)
        zero = np.zeros(count)
        goal = self._task.fitted(self._robot).begun(Goal(goals[:, None], zero, no_obstacles(count)), None)
        x, y, yaw = starts.T
        command = np.tile(np.asarray(self._robot.actuators.safe_command, dtype=float), (count, 1))
        simulation.put(PlanarState(x, y, yaw, zero, zero, zero), goal, command)

    def _completed(self, seen: np.ndarray) -> np.ndarray:
        """Observations with those of the other robots, shape (robots, terms), float32."""
        state = self._worlds.simulation.measured
        count = len(self.possible_agents)
        motion = np.stack([np.asarray(each) for each in (state.x, state.y, state.vx, state.vy)], axis=-1)
        order = np.array([[(own + step) % count for step in range(1, count)] for own in range(count)])
        way = motion[order] - motion[:, None]
        yaw = np.asarray(state.yaw)[:, None]
        place, rate = to_body(yaw, way[..., 0], way[..., 1]), to_body(yaw, way[..., 2], way[..., 3])
        others = np.stack((*place, *rate), axis=-1).reshape(count, -1)
        return np.concatenate((seen, others), axis=-1).astype(np.float32)

    def _touched(self) -> bool:
        """Whether any two hulls overlap."""
        truth = self._worlds.simulation.truth
        place = np.stack((np.asarray(truth.x), np.asarray(truth.y)), axis=-1)
        first, second = np.triu_indices(len(place), 1)
        far = np.linalg.norm(place[first] - place[second], axis=-1)
        return bool((far < 2.0 * self._robot.body.radius).any())
