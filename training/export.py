"""From a run folder to a policy bundle: ONNX, golden vectors, passport, and proof that all agree."""

from __future__ import annotations

import logging
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.seeds import HELD_OUT_SEED
from fulmar_core.controllers.disturbance_inputs import disturbance_terms, with_disturbances
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.loop.policy_bundle import FORMAT, Golden, Passport, action_of, check_output, write_bundle
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.tasks.observation import Observer
from fulmar_core.worlds.scenario import load_scenario
from training.golden_limits import with_limits
from training.golden_views import golden_views
from training.image_network import ImageNetwork
from training.network import DeployedNetwork, NetworkController, load_network
from training.policy_network import PolicyNetwork
from training.run_folder import NETWORK_FILE, read_run_record
from training.session import polite_interrupt

GOLDEN_VECTORS = 64
GOLDEN_STEPS = 5  # commands between the two moments that golden vectors are taken at
OPSET = 18


def export(run: Path, out: Path, other: str | None = None) -> Passport:
    """Write the bundle of a training run.

    Args:
        run: Run folder that `train` left.
        out: Folder of the bundle.
        other: Robot that it is for, where the network asks for a wrench; the one it was trained on by default.

    Raises:
        ConfigError: `run` is no run folder, its robot or task has changed since, or it is not for the other robot.
    """
    record = read_run_record(run)
    robot, task = load_robot(record["robot"]), load_task(record["task"])
    network = load_network(run / NETWORK_FILE)
    if other is not None and other != robot.name:
        robot = load_robot(other)
        task.check(robot)
        network, record = network.for_robot(robot), record | {"trained_on": record["robot"]}
        record["control_hz"] = robot.timing.control_hz
        record.pop("mujoco", None)
    names, plan = Observer(robot, task).names, network.plan
    names += disturbance_terms(robot) if plan.disturbances else ()
    if plan.observed != len(names):
        raise ConfigError(
            f"{run}: the network takes {plan.observed} terms, '{robot.name}' and '{task.name}' now have {len(names)}. "
            "Train again."
        )
    if plan.on_off != robot.actuators.binary or len(plan.command_scale) != len(robot.actuators.names):
        raise ConfigError(f"{run}: the actuators of '{robot.name}' have changed since. Train again.")
    passport = Passport(
        format=FORMAT,
        robot=robot.name,
        task=task.name,
        control_hz=float(record["control_hz"]),
        observation_names=names,
        actuator_names=robot.actuators.names,
        action=action_of(robot),
        command_scale=plan.command_scale,
        memory=plan.memory,
        remembers_command=network.remembers_command,
        network_sha256="",
        golden_sha256="",
        training={
            key: record[key] for key in ("command", "seed", "steps", "wall_s", "settings", "best", "versions")
        }
        | {"git_revision": record.get("git_revision", ""), "interrupted": record.get("interrupted", False)}
        | {
            key: record[key]
            for key in ("updates", "cpu_s", "trained_on", "recipe", "fallback_policy", "learned_tasks")
            if key in record
        }
        | {"curve": _curve(record)}
        | _mujoco_result(record),
        image=network.plan.image if isinstance(network, ImageNetwork) else None,
    )
    golden = (
        golden_views(network, robot, task)
        if isinstance(network, ImageNetwork)
        else _golden(network, robot, task)
    )
    check_output(golden.logits, golden.commands, golden.next_memories, what=f"{out}: no bundle is written")
    return write_bundle(out, _to_onnx(network), golden, passport)


def _curve(record: dict[str, Any]) -> list[dict[str, float]]:
    """Success at each check on held-out episodes, for plots."""
    return [
        {
            "wall_s": round(check["wall_s"], 1),
            "steps": check["steps"],
            "success_rate": round(check["success_rate"], 4),
        }
        for check in record.get("curve", ())
    ]


def _mujoco_result(record: dict[str, Any]) -> dict[str, Any]:
    """Main metrics of the evaluation in MuJoCo; empty without one."""
    result = record.get("mujoco")
    if not result:
        return {}
    main = {key: result[key] for key in ("scenario", "seed", "episodes", "success_rate")}
    means = {key: result[key]["mean"] for key in result if key.startswith(("PT", "OT")) or key == "AAS"}
    return {"mujoco": main | means}


def _to_onnx(network: PolicyNetwork) -> bytes:
    memory = network.plan.memory
    more = {"memory": torch.zeros(2, memory)} if memory else {}
    if isinstance(network, ImageNetwork):
        more["image"] = torch.ones(2, *network.plan.image.shape)
    example = [torch.zeros(2, network.plan.observed), *more.values()]
    worlds = torch.export.Dim("worlds")
    logging.getLogger("torch.onnx").setLevel(
        logging.ERROR
    )  # it warns of optional packages that are not needed
    with warnings.catch_warnings():
        warnings.filterwarnings(
            "ignore", message=".*axis name: worlds will not be used"
        )  # both inputs share it
        with polite_interrupt() as interrupt:  # the exporter would report a Ctrl-C as its own error
            program = torch.onnx.export(
                network,
                tuple(example),
                input_names=["observation", *more],
                output_names=["command", "logits", *(["next_memory"] if memory else [])],
                dynamic_shapes=tuple({0: worlds} for _ in example),
                opset_version=OPSET,
                dynamo=True,
                verbose=False,
            )
    if interrupt.is_set():
        raise KeyboardInterrupt
    assert program is not None
    model = program.model_proto
    _strip_metadata(model)
    return bytes(model.SerializeToString())


def _strip_metadata(model: onnx.ModelProto) -> None:
    """Remove the exporter's stack traces, which name files of this machine."""
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


def _golden(network: PolicyNetwork, robot: Robot, task: Task) -> Golden:
    """Golden vectors of held-out episodes at their start, a few commands later, and at limits.

    With a fallback policy, every other robot has an uncontrollable set of dead valves.
    """
    simulation = BatchSimulation(
        robot, task, load_scenario("uncertain"), worlds=GOLDEN_VECTORS // 2, seed=HELD_OUT_SEED, training=True
    )
    loop = ControlLoop(
        robot,
        task,
        NetworkController(network, robot, task, robot.timing.control_hz),
        robots=simulation.worlds,
    )
    loop.begin(goal_in_float64(simulation.goal))
    memory = np.zeros((simulation.worlds, network.plan.memory), dtype=np.float32)
    moments = []
    for number in range(GOLDEN_STEPS + 1):
        inputs = loop.inputs(simulation.measured, {}, round(1e9 * number * loop.dt))
        seen = with_disturbances(loop.observer, inputs) if network.plan.disturbances else inputs.observation
        seen = seen.astype(np.float32)
        if isinstance(network, DeployedNetwork) and network.fallback is not None:
            losses = network.losses.numpy()
            valves = seen[::2, -losses.shape[1] :]
            valves[:] = 1.0 - np.resize(losses, valves.shape)
        command, logits, after = network.infer(seen, memory)
        moments.append((seen, memory, command, logits, after))
        simulation.move(loop.take(inputs, command).command)
        memory = after
    golden = Golden(*(np.concatenate(both) for both in zip(moments[0], moments[-1], strict=True)))
    golden = with_limits(golden, network.infer, robot.actuators.scale, action_of(robot))
    clear = network.clear(golden.observations, golden.memories)
    if not clear.any():
        raise ConfigError(
            "every golden vector of the network is so near a tie that another processor may answer otherwise: it has "
            "not learned yet. Train for longer."
        )
    return Golden(**{name: rows[clear] for name, rows in vars(golden).items() if rows is not None})
