"""From a run folder to a policy bundle: ONNX, golden vectors, passport, and proof that all agree."""

from __future__ import annotations

import json
import logging
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch

from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.episode import HELD_OUT_SEED
from fulmar_core.errors import ConfigError
from fulmar_core.policy_bundle import FORMAT, Golden, Passport, write_bundle
from fulmar_core.robot import Robot, load_robot
from fulmar_core.simulation import BatchSimulation
from fulmar_core.tasks import Task, load_task
from training.network import DeployedNetwork, load_network
from training.train import NETWORK_FILE, RUN_FILE

GOLDEN_VECTORS = 64
OPSET = 18


def export(run: Path, out: Path) -> Passport:
    """Write the bundle of a training run.

    Args:
        run: Run folder that `train` left.
        out: Folder of the bundle.

    Returns:
        The sealed passport.

    Raises:
        ConfigError: `run` is no run folder, or its robot or task has changed since.
    """
    record = read_run_record(run)
    robot, task = load_robot(record["robot"]), load_task(record["task"])
    network = load_network(run / NETWORK_FILE)
    if network.observation_count != len(task.observation_names):
        raise ConfigError(
            f"{run}: the network takes {network.observation_count} terms, task '{task.name}' now has "
            f"{len(task.observation_names)}. Train again."
        )
    passport = Passport(
        format=FORMAT,
        robot=robot.name,
        task=task.name,
        control_hz=float(record["control_hz"]),
        observation_names=task.observation_names,
        actuator_names=robot.actuators.names,
        network_sha256="",
        golden_sha256="",
        training={
            key: record[key] for key in ("command", "seed", "steps", "wall_s", "settings", "best", "versions")
        }
        | {"git_revision": record.get("git_revision", ""), "interrupted": record.get("interrupted", False)}
        | _verdict(record),
    )
    return write_bundle(out, _to_onnx(network), _golden(network, robot, task), passport)


def read_run_record(run: Path) -> dict[str, Any]:
    """What `train` wrote about a run.

    Raises:
        ConfigError: If `run` is no finished run folder.
    """
    path = run / RUN_FILE
    if not path.is_file() or not (run / NETWORK_FILE).is_file():
        raise ConfigError(
            f"{run}: no finished training run ({RUN_FILE} or {NETWORK_FILE} is missing). Run `fulmar train`."
        )
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ConfigError(f"{path}: not valid JSON: {error}. Train again.") from error
    needed = (
        "robot",
        "task",
        "control_hz",
        "command",
        "seed",
        "steps",
        "wall_s",
        "settings",
        "best",
        "versions",
    )
    missing = [key for key in needed if not isinstance(record, dict) or key not in record]
    if missing:
        raise ConfigError(
            f"{path}: lacks '{missing[0]}', so it is not what `fulmar train` left. Train again."
        )
    return dict(record)


def _verdict(record: dict[str, Any]) -> dict[str, Any]:
    """What judging in MuJoCo gave, in its main figures; empty if the run was not judged."""
    judged = record.get("mujoco")
    if not judged:
        return {}
    told = {key: judged[key] for key in ("scenario", "seed", "episodes", "success_rate")}
    means = {key: judged[key]["mean"] for key in judged if key.startswith(("PT", "OT")) or key == "AAS"}
    return {"mujoco": told | means}


def _to_onnx(network: DeployedNetwork) -> bytes:
    example = torch.zeros(2, network.observation_count)
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)  # it warns of optional packages that nobody needs
    program = torch.onnx.export(
        network,
        (example,),
        input_names=["observation"],
        output_names=["command", "logits"],
        dynamic_shapes=({0: torch.export.Dim("worlds")},),
        opset_version=OPSET,
        dynamo=True,
        verbose=False,
    )
    assert program is not None
    model = program.model_proto
    _strip_metadata(model)
    return bytes(model.SerializeToString())


def _strip_metadata(model: onnx.ModelProto) -> None:
    """Take out the stack traces that the exporter leaves: they name files of this machine."""
    graph = model.graph
    for part in (
        model,
        graph,
        *graph.node,
        *graph.value_info,
        *graph.input,
        *graph.output,
        *graph.initializer,
    ):
        del part.metadata_props[:]
        part.doc_string = ""


def _golden(network: DeployedNetwork, robot: Robot, task: Task) -> Golden:
    """Observations from the start of held-out episodes and a second later, with what the network makes of them."""
    simulation = BatchSimulation(
        robot, task, load_scenario("uncertain"), worlds=GOLDEN_VECTORS // 2, seed=HELD_OUT_SEED, training=True
    )
    observations = [task.observe(simulation.measured, simulation.goal)]
    for _ in range(5):
        command, _ = network.infer(task.observe(simulation.measured, simulation.goal))
        simulation.step(command)
    observations.append(task.observe(simulation.measured, simulation.goal))
    batch = np.concatenate(observations).astype(np.float32)
    return Golden(batch, *network.infer(batch))
