"""Evaluation of a network: on held-out episodes while it learns, and in MuJoCo at the end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_core.config.seeds import EVALUATION_SEED, HELD_OUT_SEED
from fulmar_core.loop.rollout import roll_out_in_backends, roll_out_in_batch
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.metrics import summary
from fulmar_core.tasks import Task, load_task
from fulmar_core.worlds.scenario import Scenario, load_scenario
from training.bodies import KnownBodies
from training.network import DeployedNetwork, NetworkController, controller_of, load_network
from training.policy_network import PolicyNetwork
from training.run_folder import NETWORK_FILE, read_run_record, write_run_record

EPISODES = 256  # of each scenario
Evaluator = Callable[[PolicyNetwork], tuple[float, float]]  # success rate and score

# Weights of further metrics in the score, where a task has them: precision, then economy.
_WEIGHTS = {
    "PT2_percent": 0.005,
    "OT2_percent": 0.001,
    "goals_reached": 0.05,
    "velocity_error_m_s": -1.0,
    "yaw_rate_error_deg_s": -0.02,
    "effort": -0.5,
    "control_variation": -0.05,
}


@dataclass(frozen=True)
class Check:
    """Result of a learner on held-out episodes, in the batch."""

    wall_s: float
    steps: int
    success_rate: float  # mean of the training scenario and the nominal one
    score: float  # ranks checks: success first, then precision, then economy


def held_out_evaluator(robot: Robot, task: Task, scenario: Scenario) -> Evaluator:
    """Evaluator in the training scenario and in the nominal one: a network may be good at either alone."""
    worlds = dict.fromkeys((scenario, load_scenario("nominal")))

    def evaluate(network: PolicyNetwork) -> tuple[float, float]:
        figures = [evaluate_in_batch(network, robot, task, world, episodes=EPISODES) for world in worlds]
        success = _mean(figures, "success_rate")
        more = (weight * _mean(figures, name) for name, weight in _WEIGHTS.items() if name in figures[0])
        return success, success + sum(more)

    return evaluate


def evaluate_in_batch(
    network: PolicyNetwork,
    robot: Robot,
    task: Task,
    scenario: Scenario,
    *,
    episodes: int,
    seed: int = HELD_OUT_SEED,
) -> dict[str, Any]:
    """Figures of a network in the batch; one that asks for a wrench knows the body of each episode.

    Args:
        network: The network.
        robot: The robot.
        task: The task.
        scenario: What episodes are drawn from.
        episodes: Number of episodes, 1 to `WORLDS`.
        seed: Of the episodes.
    """
    if isinstance(network, DeployedNetwork) and network.plan.decision == "allocate":
        numbers = np.arange(episodes)
        network = network.for_bodies(KnownBodies.of_episodes(robot, scenario, seed=seed, numbers=numbers))
    controller = NetworkController(network, robot, task, robot.timing.control_hz)
    figures: dict[str, Any] = summary(
        roll_out_in_batch(controller, robot, task, scenario, episodes=episodes, seed=seed), task
    )
    return figures


def _mean(figures: list[dict[str, Any]], name: str) -> float:
    values = [each[name]["mean"] if isinstance(each[name], dict) else each[name] for each in figures]
    return float(sum(value or 0.0 for value in values)) / len(values)


def evaluate_in_mujoco(run: Path, *, episodes: int, scenario: str = "nominal") -> dict[str, Any]:
    """Evaluate the best network of a run, and write the figures into its record.

    Args:
        run: Run folder.
        episodes: Number of episodes, >= 1.
        scenario: What episodes are drawn from.

    Returns:
        Success rate and every metric.
    """
    # Only here: learning itself needs no MuJoCo.
    from sim_nodes.mujoco_backend import MujocoBackend
    from sim_nodes.sight import sight_of

    record = read_run_record(run)
    robot, task, world = load_robot(record["robot"]), load_task(record["task"]), load_scenario(scenario)
    controller = controller_of(load_network(run / NETWORK_FILE), robot, task, record["control_hz"])
    with sight_of(controller, robot, task) as sight:
        trajectories = roll_out_in_backends(
            controller,
            lambda: MujocoBackend.of(robot, task, world),
            task,
            world,
            episodes=episodes,
            seed=EVALUATION_SEED,
            sight=sight,
        )
    figures: dict[str, Any] = summary(trajectories, task)
    record["mujoco"] = {"scenario": scenario, "seed": EVALUATION_SEED, **figures}
    write_run_record(run, record)
    return figures
