"""From a policy of skrl, rl_games or ONNX with RoboRAN's observation to a policy bundle."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np
import onnx
import torch

from fulmar_core.config.bounded_file import IMPORTED_BYTES, read_bounded
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.seeds import HELD_OUT_SEED
from fulmar_core.loop.policy_bundle import (
    FORMAT,
    PASSPORT,
    Golden,
    Passport,
    action_of,
    check_output,
    write_bundle,
)
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.observation import Observer
from fulmar_core.worlds.scenario import load_scenario
from training.foreign_checkpoint import Activations, FeedForward, Format, find_activations, read_checkpoint
from training.foreign_onnx import ForeignOnnx
from training.golden_limits import with_limits
from training.onnx_graph import Graph, Tensor, open_model
from training.roboran_observation import Layout, layout_for, write_observation

GOLDEN_VECTORS = 64
GOLDEN_STEPS = 5  # commands between the two moments that golden vectors are taken at


Source = FeedForward | ForeignOnnx


def import_policy(
    path: Path,
    out: Path,
    *,
    robot_name: str,
    task_name: str,
    wanted: Format | None = None,
    control_hz: float | None = None,
    activation: str | None = None,
    output_activation: str | None = None,
    command: str = "",
) -> Passport:
    """Write the bundle of a policy that another stack trained with RoboRAN's observation.

    The bundle takes our observation, and carries the last actions, which RoboRAN shows its networks, as memory.

    Args:
        path: Checkpoint of skrl (.pt) or rl_games (.pth), or ONNX.
        out: Folder of the bundle; must hold none yet.
        robot_name: The robot that it was trained for.
        task_name: The task that it was trained for.
        wanted: Format of the file; by default what its content says.
        control_hz: Rate that it shall run at; the robot's own by default [Hz].
        activation: Between the layers of a checkpoint; by default from the run's `params/agent.yaml`.
        output_activation: After the last layer of a checkpoint, "none" or "tanh"; by default likewise.
        command: The command line, for the passport.

    Raises:
        ConfigError: The file, or what was asked for, does not fit.
    """
    if (out / PASSPORT).exists():
        raise ConfigError(f"{out}: holds a bundle already. Give another folder, or remove it first.")
    robot, task = load_robot(robot_name), load_task(task_name)
    rate = control_hz or robot.timing.control_hz
    try:
        robot.timing.substeps(rate)
    except ValueError as error:
        raise ConfigError(f"robot '{robot.name}': {error}") from error
    try:
        digest = hashlib.sha256(read_bounded(path, IMPORTED_BYTES)).hexdigest()
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror or error}.") from error
    if wanted == "onnx" or (wanted is None and path.suffix == ".onnx"):
        if activation or output_activation:
            raise ConfigError(f"{path}: an ONNX model holds its activations; it takes no --activation.")
        found: Format = "onnx"
        source: Source = ForeignOnnx(path)
        activations = None
    else:
        checkpoint = read_checkpoint(path, wanted)
        found = checkpoint.format
        activations = find_activations(path, activation, output_activation)
        source = FeedForward(checkpoint, activations)
    count = len(robot.actuators.names)
    _check_outputs(path, source.outputs, robot)
    layout = layout_for(task.kind, source.inputs, count)
    names = Observer(robot, task).names
    adapter = _Adapter(robot, names, layout)
    passport = Passport(
        format=FORMAT,
        robot=robot.name,
        task=task.name,
        control_hz=float(rate),
        observation_names=names,
        actuator_names=robot.actuators.names,
        action=action_of(robot),
        command_scale=tuple(float(value) for value in robot.actuators.scale),
        memory=adapter.memory,
        network_sha256="",
        golden_sha256="",
        training=_origin(path, digest, found, activations, command) | {"roboran_terms": source.inputs},
    )
    golden = _golden(source, adapter, robot, task)
    check_output(golden.logits, golden.commands, golden.next_memories, what=f"{path}: no bundle is written")
    return write_bundle(out, adapter.around(source).SerializeToString(), golden, passport)


class _Adapter:
    """What stands before and after a network of RoboRAN."""

    def __init__(self, robot: Robot, names: tuple[str, ...], layout: Layout) -> None:
        self.memory = len(robot.actuators.names)  # the last actions
        self._actuators, self._names, self._layout = robot.actuators, names, layout

    def around(self, source: Source) -> onnx.ModelProto:
        """The network of a bundle: ours, theirs, ours."""
        graph = Graph()
        raw = source.write(graph, self._before(graph))
        self._after(graph, raw)
        return source.model(graph)

    def before(self) -> onnx.ModelProto:
        """What comes before the network, by itself."""
        graph = Graph()
        graph.output("network_input", self._before(graph), self._layout.width + self.memory)
        return graph.model()

    def after(self, outputs: int) -> onnx.ModelProto:
        """What comes after the network, by itself."""
        graph = Graph()
        self._after(graph, graph.input("network_output", outputs))
        return graph.model()

    def _before(self, graph: Graph) -> Tensor:
        seen = graph.input("observation", len(self._names))
        last = graph.input("memory", self.memory)
        return write_observation(seen, self._names, self._layout, last)

    def _after(self, graph: Graph, raw: Tensor) -> None:
        """Commands, what decides them, and the actions as the next observation shows them.

        A valve has two logits side by side and takes the likelier of (closed, open); other actuators have a share each.
        """
        count = len(self._actuators.names)
        if self._actuators.binary:
            logits = raw.columns(range(1, 2 * count, 2)) - raw.columns(range(0, 2 * count, 2))
            action = graph.node("Cast", logits > graph.constant(0.0), to=onnx.TensorProto.FLOAT)
            command = action
        else:
            logits, action = raw, graph.clip(raw, 1.0)
            command = action * graph.constant(np.asarray(self._actuators.scale, np.float32))
        graph.output("command", command, count)
        graph.output("logits", logits, count)
        graph.output("next_memory", action, count)


def _check_outputs(path: Path, outputs: int, robot: Robot) -> None:
    count = len(robot.actuators.names)
    needed = 2 * count if robot.actuators.binary else count
    if outputs != needed:
        each = "two logits (closed, open) for each" if robot.actuators.binary else "one number for each"
        raise ConfigError(
            f"{path}: the network gives {outputs} numbers, '{robot.name}' needs {needed}: {each} of its {count} "
            "actuators. Give the robot that it was trained for."
        )


def _origin(
    path: Path, digest: str, found: Format, activations: Activations | None, command: str
) -> dict[str, Any]:
    """Where the policy came from, for the passport."""
    origin: dict[str, Any] = {"imported_from": found, "source": path.name, "source_sha256": digest}
    if activations:
        origin |= {"activation": activations.hidden, "output_activation": activations.output}
    return origin | {"command": command, "versions": {"torch": torch.__version__, "onnx": onnx.__version__}}


def _golden(source: Source, adapter: _Adapter, robot: Robot, task: Task) -> Golden:
    """What the source network, in its own library, makes of held-out episodes and at limits; see `export`."""
    worlds = GOLDEN_VECTORS // 2
    simulation = BatchSimulation(
        robot, task, load_scenario("uncertain"), worlds=worlds, seed=HELD_OUT_SEED, training=True
    )
    before, after = open_model(adapter.before()), open_model(adapter.after(source.outputs))
    last = np.zeros((worlds, adapter.memory), dtype=np.float32)

    def infer(seen: np.ndarray, memory: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        (given,) = before.run(None, {"observation": seen, "memory": memory})
        command, logits, next_memory = after.run(None, {"network_output": source.infer(given)})
        return command, logits, next_memory

    moments = []
    for _ in range(GOLDEN_STEPS + 1):
        seen = np.asarray(simulation.observe(), dtype=np.float32)
        command, logits, memory = infer(seen, last)
        moments.append((seen, last, command, logits, memory))
        simulation.step(command)
        last = memory
    golden = Golden(*(np.concatenate(both) for both in zip(moments[0], moments[-1], strict=True)))
    return with_limits(golden, infer, robot.actuators.scale, action_of(robot))


def as_format(text: str | None) -> Format | None:
    """Check the name of a format.

    Raises:
        ConfigError: It is none.
    """
    if text is None or text in ("skrl", "rl_games", "onnx"):
        return cast(Literal["skrl", "rl_games", "onnx"] | None, text)
    raise ConfigError(f"--format {text} is unknown; it must be skrl, rl_games or onnx.")
