"""Judging a training run in MuJoCo: another integrator, another model, episodes it has not seen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.episode import EVALUATION_SEED
from fulmar_core.metrics import summary
from fulmar_core.robot import load_robot
from fulmar_core.rollout import roll_out_in_backends
from fulmar_core.tasks import load_task
from sim_nodes.mujoco_backend import MujocoBackend
from training.network import NetworkController, load_network
from training.run_folder import NETWORK_FILE, read_run_record, write_run_record


def judge_in_mujoco(run: Path, *, episodes: int, scenario: str = "nominal") -> dict[str, Any]:
    """Judge the best network of a run, and write the figures into its record.

    Args:
        run: Run folder.
        episodes: Number of episodes, >= 1.
        scenario: What episodes are drawn from.

    Returns:
        Success rate and every metric.
    """
    record = read_run_record(run)
    robot, task, world = load_robot(record["robot"]), load_task(record["task"]), load_scenario(scenario)
    controller = NetworkController(load_network(run / NETWORK_FILE), robot, task, record["control_hz"])
    trajectories = roll_out_in_backends(
        controller,
        lambda: MujocoBackend.of(robot, task, world),
        task,
        world,
        episodes=episodes,
        seed=EVALUATION_SEED,
    )
    figures: dict[str, Any] = summary(trajectories, task)
    record["mujoco"] = {"scenario": scenario, "seed": EVALUATION_SEED, **figures}
    write_run_record(run, record)
    return figures
