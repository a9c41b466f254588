"""Learn to see a goal: a network of `image_network` is shown where the berth is, in views that its own flights visit.

First come views of poses drawn about the approach, then, update by update, those of flights that the network itself
flies (DAgger, Ross, Gordon and Bagnell 2011, arXiv 1011.0686). The label is the true pose of the goal seen from the
body, from which a fixed law steers: six numbers with known units, and one law for any body.
"""

from __future__ import annotations

import platform
import time
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import torch

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.seeds import HELD_OUT_SEED
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.loop.image_input import ImageInput
from fulmar_core.loop.rollout import Sight, roll_out_in_batch
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.episode import episode_steps
from fulmar_core.simulation.metrics import summary
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.attitude import exponential, product, turn
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import Task
from fulmar_core.tasks.dock import Dock
from fulmar_core.tasks.goal import Goal, goal_in_float64, goals_at
from fulmar_core.tasks.space_terms import attitude_terms, goal_terms
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.sight import CameraSight
from training.evaluator import Check
from training.image_network import ImageController, ImageNetwork, ImagePlan, PoseLaw
from training.network import save_network
from training.progress import Watcher
from training.run_folder import NETWORK_FILE, write_run_record
from training.session import Limits, polite_interrupt
from training.settings import Clone, TrainingSettings

FARTHEST_M, LEAST_SEEN = (
    5.0,
    0.002,
)  # views from farther away, or with a smaller share of the structure, teach nothing
BEYOND = 1.1, 0.1  # of the farthest start, and past the berth, that views are drawn from [m]
# A view from a distance d counts by errors of its place per NEAR[0] + NEAR[1] · d, and of its angles per half of that.
NEAR = 0.03, 0.15


class Views:
    """Views to learn from: the newest so many, as half-precision numbers."""

    def __init__(self, shape: tuple[int, ...], most: int) -> None:
        """Have room for `most` scaled images of a shape."""
        self._images = torch.zeros((most, *shape), dtype=torch.float16)
        self._poses = torch.zeros((most, 6))
        self.count = 0

    def add(self, images: torch.Tensor, poses: np.ndarray) -> None:
        """Keep images (n, ...), scaled, with the poses (n, 6) that they show; the oldest go."""
        at = torch.arange(self.count, self.count + len(images)) % len(self._images)
        self._images[at], self._poses[at] = (
            images.to(torch.float16),
            torch.as_tensor(poses, dtype=torch.float32),
        )
        self.count += len(images)

    def draw(self, count: int, random: torch.Generator) -> tuple[torch.Tensor, torch.Tensor]:
        """Some of them, drawn at random."""
        chosen = torch.randint(min(self.count, len(self._images)), (count,), generator=random)
        return self._images[chosen].float(), self._poses[chosen]


def seen_from(state: SpatialState, goal: Goal) -> np.ndarray:
    """What a network shall see: way to the goal [m] and rotation to its attitude [rad] in the body, shape (n, 6)."""
    parts = (*goal_terms(state, goal.current), *attitude_terms(state, goal.current))
    return np.stack([np.asarray(part, dtype=np.float32) for part in parts], axis=-1)


def drawn_views(task: Dock, count: int, random: np.random.Generator) -> tuple[SpatialState, Goal]:
    """Poses about the approach, many of them near the berth, where a centimetre counts."""
    far = task.start.behind[1] * BEYOND[0] + BEYOND[1]
    behind = far * random.uniform(size=count) ** 2 - BEYOND[1]
    share = 0.15 + 0.85 * np.clip(behind / task.start.behind[0], 0.0, 1.0)
    aside = task.start.aside * share[:, None] * random.uniform(-1.3, 1.3, (count, 2))
    angles = np.deg2rad(task.start.tilt_deg) * share[:, None] * random.uniform(-1.3, 1.3, (count, 3))
    berth = np.tile(np.array(task.berth), (count, 1))
    quat = tuple(berth[:, 3 + i] for i in range(4))
    way = turn(quat, (-behind, aside[:, 0], aside[:, 1]))
    place = tuple(berth[:, i] + way[i] for i in range(3))
    tilted = product(quat, exponential(tuple(angles[:, i] for i in range(3))))
    return SpatialState.at_rest(place, tilted), goals_at(berth)


class Learner:
    """A network, the views that it learns from, and its optimiser."""

    def __init__(self, robot: Robot, task: Dock, settings: TrainingSettings, sight: Sight, seed: int) -> None:
        """Begin with random weights and drawn views.

        Raises:
            ConfigError: As in `ImageNetwork.take_allocation`.
        """
        self._robot, self._task, self._settings, self._sight = robot, task, settings, sight
        self._clone = clone = clone_of(settings)
        torch.manual_seed(seed)
        self._seed, self._draws = seed, torch.Generator().manual_seed(seed)
        self.network = ImageNetwork(plan_of(robot, clone))
        self.network.take_allocation(robot)
        self._views = Views(self.network.plan.image.shape, clone.buffer)
        self._optimiser = torch.optim.Adam(self.network.parameters(), clone.learning_rate)
        self._learn(*drawn_views(task, clone.views, np.random.default_rng(seed)))
        self.steps = 0

    def update(self, number: int, share: float) -> float:
        """Fly some flights, and learn from what they showed.

        Args:
            number: Of the update, from 0 on.
            share: Of the run that is over, by which the learning rate falls [-].

        Returns:
            Mean loss.
        """
        if number:
            self._fly(number)
        for group in self._optimiser.param_groups:
            group["lr"] = self._clone.learning_rate * max(0.02, 0.5 * (1.0 + float(np.cos(np.pi * share))))
        self.network.train()
        losses = [self._step() for _ in range(self._clone.gradient_steps)]
        self.network.eval()
        return float(np.mean(losses))

    def _step(self) -> float:
        images, poses = self._views.draw(self._clone.minibatch, self._draws)
        found = self.network.seen_pose(images)
        far = torch.linalg.vector_norm(poses[:, :3], dim=1, keepdim=True)
        unit = NEAR[0] + NEAR[1] * far
        unit = torch.cat((unit.expand(-1, 3), 0.5 * unit.expand(-1, 3)), dim=1)
        loss = torch.nn.functional.smooth_l1_loss((found - poses) / unit, torch.zeros_like(poses), beta=1.0)
        self._optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 1.0)
        self._optimiser.step()
        return float(loss.detach())

    def _fly(self, number: int) -> None:
        worlds, robot, task = self._settings.worlds, self._robot, self._task
        simulation = BatchSimulation(
            robot, task, load_scenario(self._settings.scenario), worlds=worlds, seed=self._seed,
            first=number * worlds, training=True, dtype=np.float64,
        )  # fmt: skip
        loop = ControlLoop(
            robot, task, ImageController(self.network, robot, task, robot.timing.control_hz), robots=worlds
        )
        loop.begin(goal_in_float64(simulation.goal))
        for step in range(episode_steps(task, loop.dt)):
            seen = self._sight(simulation.truth)
            if step % self._clone.keep_every == 0:
                self._learn(simulation.truth, simulation.goal, seen)
            done = loop.step(simulation.measured, seen, round(1e9 * step * loop.dt))
            simulation.move(done.command)
            self.steps += worlds

    def _learn(self, state: SpatialState, goal: Goal, seen: Any = None) -> None:
        """Keep views of some states."""
        image = self.network.plan.image
        taken = image.taken((self._sight(state) if seen is None else seen)[image.reading])
        poses = seen_from(state, goal)
        shown = np.isfinite(taken).mean(axis=(1, 2, 3)) if taken.dtype == np.float32 else np.ones(len(taken))
        good = (shown > LEAST_SEEN) & (np.linalg.norm(poses[:, :3], axis=1) < FARTHEST_M)
        if good.any():
            self._views.add(self.network.scaled(torch.as_tensor(taken[good])), poses[good])


def clone_of(settings: TrainingSettings) -> Clone:
    """The algorithm of settings that are for cloning from images."""
    assert isinstance(settings.algorithm, Clone)
    return settings.algorithm


def plan_of(robot: Robot, clone: Clone) -> ImagePlan:
    """The network for a robot.

    Raises:
        ConfigError: Its camera cannot give such images.
    """
    camera = robot.sensors.camera
    if camera is None:
        raise ConfigError(
            f"'{robot.name}' has no camera to learn from. Add 'camera' to the 'sensors' of its file."
        )
    try:
        image = ImageInput.of(camera, clone.reading, every=clone.every)
    except ValueError as error:
        raise ConfigError(f"images of '{robot.name}': {error}") from error
    law = PoseLaw.of(robot, speed=clone.speed, turn_rate=clone.turn_rate)
    scale = tuple(float(value) for value in robot.actuators.scale)
    return ImagePlan(image, clone.channels, clone.features, law, scale)


def train_from_images(
    robot: Robot,
    task: Task,
    settings: TrainingSettings,
    *,
    seed: int,
    out: Path,
    time_limit_s: float | None = None,
    updates: int | None = None,
    command: str = "",
    git_revision: str = "",
    watcher: Watcher,
) -> dict[str, Any]:
    """Learn until a limit is reached or the user interrupts; arguments and errors as in `train.train`.

    Raises:
        ConfigError: The task has no berth, nothing can draw images, or the robot cannot be steered so.
    """
    if not isinstance(task, Dock):
        raise ConfigError(
            f"'kind: clone' learns tasks with a berth that a camera sees, such as dock, not '{task.name}'."
        )
    if time_limit_s is None and updates is None:
        time_limit_s = settings.time_limit_s
    torch.set_num_threads(1)
    clone, limits = clone_of(settings), Limits(time_limit_s, updates)
    began, cpu_began = time.monotonic(), time.process_time()
    checks: list[Check] = []
    with (
        CameraSight(robot, task, plan_of(robot, clone).image.camera) as sight,
        polite_interrupt() as interrupt,
    ):
        learner, number, due = Learner(robot, task, settings, sight, seed), 0, 0.0
        every = (
            settings.evaluate_every_s / settings.time_limit_s
        )  # a share, so that no machine's pace chooses the best
        watcher.begin()
        try:
            while (
                share := limits.progress(time.monotonic() - began, number)
            ) < 1.0 and not interrupt.is_set():
                learner.update(number, share)
                number += 1
                share = limits.progress(elapsed := time.monotonic() - began, number)
                watcher.advance(share, elapsed, learner.steps)
                if share >= min(1.0, due):
                    due = share + every
                    checks.append(_check(learner, robot, task, sight, clone, elapsed))
                    watcher.evaluated(elapsed, checks[-1].success_rate)
                    if checks[-1].score == max(check.score for check in checks):
                        save_network(learner.network, out / NETWORK_FILE)
                    enough = settings.stop_at_success
                    if enough is not None and enough.reached([check.success_rate for check in checks]):
                        break
        finally:
            watcher.end()
    if not checks:
        raise KeyboardInterrupt
    record = {
        "robot": robot.name, "task": task.name, "seed": seed, "command": command, "git_revision": git_revision,
        "control_hz": robot.timing.control_hz, "settings": asdict(settings), "steps": learner.steps,
        "updates": number, "wall_s": round(time.monotonic() - began, 1),
        "cpu_s": round(time.process_time() - cpu_began, 2),
        "steps_per_s": round(learner.steps / (time.monotonic() - began)), "interrupted": interrupt.is_set(),
        "best": asdict(max(checks, key=lambda check: check.score)), "curve": [asdict(check) for check in checks],
        "versions": {name: version(name) for name in ("torch", "mujoco", "numpy")}
        | {"python": platform.python_version()},
    }  # fmt: skip
    write_run_record(out, record)
    if interrupt.is_set():
        raise KeyboardInterrupt
    return record


def _check(learner: Learner, robot: Robot, task: Dock, sight: Sight, clone: Clone, elapsed_s: float) -> Check:
    """Fly held-out flights: success first, then how near the berth they end."""
    controller = ImageController(learner.network, robot, task, robot.timing.control_hz)
    flights = roll_out_in_batch(
        controller,
        robot,
        task,
        load_scenario("nominal"),
        episodes=clone.flights,
        seed=HELD_OUT_SEED,
        sight=sight,
    )
    success = float(summary(flights, task)["success_rate"])
    last = flights.position_error[:, -round(task.tolerance.hold_s * robot.timing.control_hz) :]
    return Check(elapsed_s, learner.steps, success, success - min(1.0, float(np.median(last))))
