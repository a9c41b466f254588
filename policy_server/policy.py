"""A policy bundle as a controller: ONNX, without ROS and without torch; rejected unless everything fits."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime

from fulmar_core.config.errors import BundleError
from fulmar_core.controllers.controller import Inputs, StateObserver
from fulmar_core.controllers.disturbance_inputs import ESTIMATOR, with_disturbances
from fulmar_core.loop.bundle_signature import verify_bundle
from fulmar_core.loop.policy_bundle import (
    GOLDEN,
    NETWORK,
    Bundle,
    Golden,
    Passport,
    check_fit,
    check_output,
    read_bundle,
    takes_disturbances,
)
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task
from fulmar_core.tasks.observation import Observer, slewed
from policy_server.inference import open_network

# Of the logits: float32 sums in another order on another processor differ by about 1e-6.
GOLDEN_TOLERANCE = 1e-4
COMMAND_TOLERANCE = 1e-6  # of full command, within which a command is the one that was chosen


class Policy:
    """A network that was validated against its passport, the robot, the task and the rate."""

    name = "policy"

    def __init__(
        self,
        folder: Path,
        robot: Robot,
        task: Task,
        *,
        control_hz: float | None = None,
        trusted: Path | None = None,
    ) -> None:
        """Load a bundle.

        Args:
            folder: The bundle.
            robot: The robot it shall drive.
            task: The task it shall do.
            control_hz: The rate it shall run at; the robot's own by default [Hz].
            trusted: File or folder of public keys, one of which must have signed it; None: any bundle.

        Raises:
            BundleError: Anything is missing, damaged, not signed, of other shape, made for something else, or does not
                reproduce its golden vectors.
            ConfigError: There is no readable key.
        """
        bundle = read_bundle(folder)
        if trusted is not None:
            verify_bundle(bundle, trusted)
        self.passport = bundle.passport
        self.control_hz = control_hz or robot.timing.control_hz
        check_fit(self.passport, robot, task, self.control_hz, where=str(folder))
        self._observer = Observer(robot, task)
        self.estimator = ESTIMATOR if takes_disturbances(self.passport.observation_names, robot) else None
        self.image = self.passport.image
        seen = (self.image.reading,) if self.image else ()
        self.readings: tuple[str, ...] = (*self._observer.readings, *seen)
        self.observer: StateObserver[Any] | None = None
        self._session = _open(bundle)
        self._memory: np.ndarray | None = None
        self._robot = robot
        self._expected: np.ndarray | None = None  # of the last command, after the robot's own limits
        _check_shapes(self._session, self.passport, folder)
        _check_golden(self._session, bundle)

    def reset(self) -> None:
        """Clear the memory, if the network has one."""
        self._memory = self._expected = None

    def act(self, inputs: Inputs) -> np.ndarray:
        """Choose actuators; see `Controller.act`."""
        seen = with_disturbances(self._observer, inputs) if self.estimator else inputs.observation
        batch = np.asarray(seen, dtype=np.float32)
        feed = {"observation": batch}
        if self.image is not None:
            feed["image"] = self.image.taken(inputs.readings[self.image.reading])
        if self.passport.memory:
            if self._memory is None or len(self._memory) != len(batch):
                self._memory = np.zeros((len(batch), self.passport.memory), dtype=np.float32)
                self._expected = None
            feed["memory"] = self._corrected(self._memory, inputs.previous)
            command, self._memory = self._session.run(["command", "next_memory"], feed)
            if self.passport.remembers_command:
                limited = self._robot.actuators.limited(np.asarray(command, dtype=float))
                self._expected = slewed(limited, inputs.previous, self._robot, inputs.dt)
        else:
            (command,) = self._session.run(["command"], feed)
        return np.asarray(command)

    def _corrected(self, memory: np.ndarray, previous: np.ndarray) -> np.ndarray:
        """Memory of what was commanded, where it was not what the network chose: a guard or an operator stepped in.

        The limits of the robot alone change nothing: the network learned with its own choice before them.
        """
        if self._expected is None:
            return memory
        scale = np.asarray(self.passport.command_scale)
        other = np.abs(previous - self._expected) > COMMAND_TOLERANCE * scale
        if not other.any():
            return memory
        memory = memory.copy()
        memory[:, -len(scale) :][other] = (previous / scale)[other]
        return memory

    def metadata(self) -> dict[str, Any]:
        """The passport, with the name of the controller."""
        return {"controller": self.name, **self.passport.plain()}


def _open(bundle: Bundle) -> onnxruntime.InferenceSession:
    try:
        return open_network(bundle.network)
    except Exception as error:
        reason = str(error).splitlines()[0]
        raise BundleError(
            f"{bundle.folder / NETWORK}: onnxruntime refuses it: {reason}. Export the policy again."
        ) from error


def _check_shapes(session: onnxruntime.InferenceSession, passport: Passport, folder: Path) -> None:
    inputs = {node.name: node for node in session.get_inputs()}
    outputs = {node.name: node for node in session.get_outputs()}
    wanted: list[tuple[dict[str, Any], str, tuple[int, ...]]] = [
        (inputs, "observation", (len(passport.observation_names),)),
        (outputs, "command", (len(passport.actuator_names),)),
        (outputs, "logits", (len(passport.actuator_names),)),
    ]
    takes = ["observation"]
    if passport.memory:
        wanted += [(inputs, "memory", (passport.memory,)), (outputs, "next_memory", (passport.memory,))]
        takes.append("memory")
    if passport.image is not None:
        wanted.append((inputs, "image", passport.image.shape))
        takes.append("image")
    for found, name, sizes in wanted:
        if name not in found:
            raise BundleError(f"{folder / NETWORK}: has no tensor '{name}', only {', '.join(found)}.")
        shape, kind = found[name].shape, found[name].type
        if not shape or isinstance(shape[0], int) or tuple(shape[1:]) != sizes:
            raise BundleError(
                f"{folder / NETWORK}: '{name}' has shape {shape}, the passport needs (any number, "
                f"{', '.join(map(str, sizes))})."
            )
        if kind != "tensor(float)":
            raise BundleError(f"{folder / NETWORK}: '{name}' is a {kind}, it must be a tensor(float).")
    if len(inputs) > len(takes):
        alone = " and ".join(f"'{name}'" for name in takes)
        raise BundleError(f"{folder / NETWORK}: takes {', '.join(inputs)}; it must take {alone} alone.")


def _check_golden(session: onnxruntime.InferenceSession, bundle: Bundle) -> None:
    folder, passport, golden = bundle.folder, bundle.passport, bundle.golden()
    _check_golden_shapes(golden, passport, folder)
    feed = {"observation": golden.observations}
    names = ["command", "logits"]
    if passport.memory:
        feed["memory"] = golden.memories
        names.append("next_memory")
    if golden.images is not None:
        feed["image"] = golden.images
    try:
        command, logits, *memories = session.run(names, feed)
    except Exception as error:
        reason = str(error).splitlines()[0]
        raise BundleError(f"{folder / NETWORK}: cannot be run: {reason}. Export the policy again.") from error
    check_output(command, logits, *memories, what=f"policy '{folder}'")
    pairs = [(logits, golden.logits), *((found, golden.next_memories) for found in memories)]
    worst = float(np.max([np.max(np.abs(found - expected)) for found, expected in pairs]))
    if not worst <= GOLDEN_TOLERANCE:
        raise BundleError(
            f"policy '{folder}' differs from its golden vectors by {worst:.2g} (at most {GOLDEN_TOLERANCE:g}). "
            "This computer computes something else than the one that exported it."
        )
    if passport.action == "on_off":
        clear = np.abs(golden.logits) > GOLDEN_TOLERANCE  # a logit of nearly zero may round either way
        same = np.array_equal(command[clear], golden.commands[clear])
    else:
        away = np.abs(command - golden.commands) / np.asarray(passport.command_scale)
        same = bool(np.all(away <= GOLDEN_TOLERANCE))
    if not same:
        raise BundleError(f"policy '{folder}' gives other commands than its golden vectors. Export it again.")


def _check_golden_shapes(golden: Golden, passport: Passport, folder: Path) -> None:
    count = len(golden.observations) if golden.observations.ndim else 0
    if (golden.images is None) != (passport.image is None):
        raise BundleError(
            f"{folder / GOLDEN}: has {'no ' if golden.images is None else ''}'images', which the passport "
            f"{'names' if passport.image else 'does not name'}. Export the policy again."
        )
    wanted: list[tuple[str, tuple[int, ...]]] = [
        ("observations", (len(passport.observation_names),)),
        ("memories", (passport.memory,)),
        ("commands", (len(passport.actuator_names),)),
        ("logits", (len(passport.actuator_names),)),
        ("next_memories", (passport.memory,)),
        *([("images", passport.image.shape)] if passport.image else []),
    ]
    for name, sizes in wanted:
        found = getattr(golden, name)
        if count == 0 or found.shape != (count, *sizes) or found.dtype != np.float32:
            raise BundleError(
                f"{folder / GOLDEN}: '{name}' is {found.dtype} of shape {found.shape}, it must be float32 of shape "
                f"({count or 'at least 1'}, {', '.join(map(str, sizes))}). Export the policy again."
            )
