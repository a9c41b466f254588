"""A policy with its passport: one folder that says what it is and refuses to be anything else.

    policy.onnx     the network: input `observation`, outputs `command` and `logits`; one with memory also takes
                    `memory` and gives `next_memory`, one that sees also takes `image`
    golden.npz      observations and images, and what the network gave for them when it was exported
    passport.json   robot, task, rate, names, hashes of the two files, and how it was made
    signature.json  of the passport, where it is signed: `fulmar_core.loop.bundle_signature`

Knows files and hashes, not how to run a network.
"""

from __future__ import annotations

import contextlib
import difflib
import hashlib
import io
import json
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from fulmar_core.config.atomic_write import write_whole
from fulmar_core.config.bounded_file import WEIGHTS_BYTES, load_arrays, read_bounded
from fulmar_core.config.errors import BundleError, did_you_mean
from fulmar_core.controllers.disturbance_inputs import disturbance_terms
from fulmar_core.loop.image_input import ImageInput
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task
from fulmar_core.tasks.observation import Observer

FORMAT = 2
NETWORK = "policy.onnx"
GOLDEN = "golden.npz"
PASSPORT = "passport.json"
SIGNATURE = "signature.json"
EXPORT = "Export one with `fulmar export RUN --out DIR`"
MOST_OFFERED = 3  # bundles, in place of one that does not exist
MAX_BYTES = WEIGHTS_BYTES  # a file beyond this is no policy of ours, and is not read

Action = Literal["on_off", "continuous"]
# Keys that came after format 2, and what is without them.
LATER: dict[str, Any] = {"remembers_command": False, "image": None, "envelope": None}


@dataclass(frozen=True)
class Passport:
    """What a policy is, and for what."""

    format: int
    robot: str
    task: str
    control_hz: float  # the command rate it was trained at [Hz]
    observation_names: tuple[str, ...]  # in the order of the network's input
    actuator_names: tuple[str, ...]  # in the order of the network's output
    action: Action  # on_off: commands are zeros and ones; continuous: anything up to the scale
    command_scale: tuple[float, ...]  # full command of each actuator, in its own unit
    memory: int  # numbers that the network carries from one command to the next; 0: none
    network_sha256: str
    golden_sha256: str
    training: dict[str, Any] = field(default_factory=dict)  # how it was made, for people
    sha256: str = ""  # of all the above
    # Whether the memory ends with the last command, as shares of full command: where the robot was then commanded
    # otherwise, that takes its place.
    remembers_command: bool = False
    image: ImageInput | None = None  # what it sees; None: nothing
    envelope: dict[str, Any] | None = None  # as `safety.certified_set` reads it; None: not certified

    def sealed(self) -> Passport:
        """The same passport with its own hash filled in."""
        values = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "sha256"}
        return Passport(**values, sha256=self.expected_sha256())

    def plain(self) -> dict[str, Any]:
        """What `passport.json` holds; what came later is left out at its default, so that older passports stay."""
        values = asdict(self)
        return {key: value for key, value in values.items() if key not in LATER or value != LATER[key]}

    def expected_sha256(self) -> str:
        """Hash of everything but the hash itself."""
        values = self.plain()
        del values["sha256"]
        return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class Golden:
    """Inputs and outputs that a loaded network must reproduce."""

    observations: np.ndarray  # (k, n) float32
    memories: np.ndarray  # (k, `memory`) float32
    commands: np.ndarray  # (k, m) float32
    logits: np.ndarray  # (k, m) float32, what the network decided the commands by
    next_memories: np.ndarray  # (k, `memory`) float32
    images: np.ndarray | None = None  # (k, *`ImageInput.shape`) float32, where the network sees

    def arrays(self) -> dict[str, np.ndarray]:
        """Those that there are, by name."""
        found = {each.name: getattr(self, each.name) for each in fields(self)}
        return {name: array for name, array in found.items() if array is not None}


@dataclass(frozen=True)
class Bundle:
    """What the files of a bundle held when each was read, once: what is checked is what runs."""

    folder: Path  # where it was read from, for messages
    passport: Passport
    passport_file: bytes  # which signatures are over
    network: bytes  # ONNX
    golden_file: bytes

    def golden(self) -> Golden:
        """The golden vectors.

        Raises:
            BundleError: If they cannot be read.
        """
        return _golden_of(self.golden_file, self.folder / GOLDEN)


def check_output(*values: np.ndarray, what: str) -> None:
    """Refuse what a network gave if it is no number: a weight is none, as after a training that diverged.

    Raises:
        BundleError: Begins with `what`.
    """
    wrong = [value[~np.isfinite(value)].size for value in values]
    if any(wrong):
        raise BundleError(
            f"{what}: its output is not a number in {sum(wrong)} of {sum(value.size for value in values)} values. Are "
            "all weights finite? A training that diverged leaves such."
        )


def write_bundle(folder: Path, network: bytes, golden: Golden, passport: Passport) -> Passport:
    """Write a bundle with its hashes; one in the same folder is replaced when the new one is complete.

    Args:
        folder: Made if need be.
        network: ONNX model.
        golden: Vectors computed with this very model.
        passport: Its hashes are ignored.

    Returns:
        The sealed passport.
    """
    folder.mkdir(parents=True, exist_ok=True)
    vectors = io.BytesIO()
    save: Callable[..., None] = np.savez if golden.images is None else np.savez_compressed
    save(vectors, **golden.arrays())
    values = passport.plain() | {
        "network_sha256": _sha256(network),
        "golden_sha256": _sha256(vectors.getvalue()),
        "sha256": "",
    }
    sealed = _passport_of(values, folder / PASSPORT).sealed()
    text = json.dumps(sealed.plain(), indent=2) + "\n"
    write_whole(
        {
            folder / NETWORK: network,
            folder / GOLDEN: vectors.getvalue(),
            folder / PASSPORT: text.encode(),
        }
    )
    (folder / SIGNATURE).unlink(missing_ok=True)  # it was for what was here before
    return sealed


def reseal(bundle: Bundle, passport: Passport) -> bool:
    """Replace the passport of a bundle whose other files stay; returns whether that undid a signature."""
    folder = bundle.folder
    text = json.dumps(passport.sealed().plain(), indent=2) + "\n"
    signed = (folder / SIGNATURE).is_file()
    write_whole({folder / PASSPORT: text.encode()})
    (folder / SIGNATURE).unlink(missing_ok=True)  # it was for the passport before
    return signed


def read_bundle(folder: Path) -> Bundle:
    """Read every file of a bundle once and check every hash; its signature, if there is one, is not checked.

    Raises:
        BundleError: No bundle, unreadable, of another format, or a file that is not the one it was sealed with.
    """
    text, network, golden = (_content(folder, name) for name in (PASSPORT, NETWORK, GOLDEN))
    try:
        values = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise BundleError(
            f"{folder / PASSPORT}: cannot be read: {error}. Export the policy again."
        ) from error
    found_format = values.get("format", FORMAT) if isinstance(values, dict) else FORMAT
    if isinstance(found_format, int) and found_format != FORMAT:
        raise BundleError(
            f"policy '{folder}' has format {found_format}, this Fulmar reads {FORMAT}. Export it again."
        )
    passport = _passport_of(values, folder / PASSPORT)
    if passport.sha256 != passport.expected_sha256():
        raise BundleError(
            f"{folder / PASSPORT}: was changed after export (its hash does not match). Export it again."
        )
    for name, content, expected in (
        (NETWORK, network, passport.network_sha256),
        (GOLDEN, golden, passport.golden_sha256),
    ):
        found = _sha256(content)
        if found != expected:
            raise BundleError(
                f"{folder / name}: SHA-256 is {found[:12]}…, the passport says {expected[:12]}…. "
                "The file is not the one that was exported; export the policy again."
            )
    return Bundle(folder, passport, text, network, golden)


def read_passport(folder: Path) -> Passport:
    """The passport of a bundle, after every hash was checked; see `read_bundle`."""
    return read_bundle(folder).passport


def check_folder(folder: Path, known: Iterable[Path] = ()) -> None:
    """Reject a path that is no folder, and name the nearest bundles, of `known` and of the same parent folder.

    Raises:
        BundleError: There is no such folder.
    """
    if folder.is_dir():
        return
    beside = (path.parent for path in folder.parent.glob(f"*/{PASSPORT}"))
    bundles = {bundle.name: bundle for bundle in (*known, *beside)}
    near = difflib.get_close_matches(folder.name, bundles, n=MOST_OFFERED) or list(bundles)[:MOST_OFFERED]
    found = "is a file; a policy is the folder around it" if folder.exists() else "the folder does not exist"
    offer = f"Nearest bundles: {', '.join(str(bundles[name]) for name in near)}" if near else EXPORT
    raise BundleError(f"policy '{folder}': {found}. {offer}.")


def remove_bundle(folder: Path) -> None:
    """Remove the files of a bundle, and its folder if nothing else is in it."""
    for name in (NETWORK, GOLDEN, PASSPORT, SIGNATURE):
        (folder / name).unlink(missing_ok=True)
    with contextlib.suppress(OSError):
        folder.rmdir()


def read_golden(folder: Path) -> Golden:
    """Read the golden vectors alone; their hash is not checked.

    Raises:
        BundleError: If they cannot be read.
    """
    return _golden_of(_content(folder, GOLDEN), folder / GOLDEN)


def check_fit(passport: Passport, robot: Robot, task: Task, control_hz: float, *, where: str) -> None:
    """Refuse a policy that was made for something else.

    Args:
        passport: The policy's.
        robot: The robot it shall drive.
        task: The task it shall do.
        control_hz: The rate it shall run at [Hz].
        where: The bundle's folder, for the message.

    Raises:
        BundleError: On the first thing that differs.
    """
    if passport.robot != robot.name:
        raise BundleError(f"policy '{where}' was trained for robot '{passport.robot}', not '{robot.name}'.")
    if passport.task != task.name:
        raise BundleError(f"policy '{where}' was trained for task '{passport.task}', not '{task.name}'.")
    if not abs(passport.control_hz - control_hz) <= 1e-9:  # so that what is not a number is refused too
        raise BundleError(
            f"policy '{where}' was trained at {passport.control_hz:g} Hz, but would run at {control_hz:g} Hz. "
            f"Train and export it at {control_hz:g} Hz, or run it with control_hz = {passport.control_hz:g}."
        )
    needed = Observer(robot, task).names
    if takes_disturbances(passport.observation_names, robot):
        needed += disturbance_terms(robot)
    _check_names("observation", passport.observation_names, needed, where)
    _check_names("actuator", passport.actuator_names, robot.actuators.names, where)
    action = action_of(robot)
    if passport.action != action:
        raise BundleError(
            f"policy '{where}' gives {passport.action} commands, '{robot.name}' takes {action}."
        )
    scale = tuple(float(value) for value in robot.actuators.scale)
    if passport.command_scale != scale:
        raise BundleError(
            f"policy '{where}' was trained for full commands of {list(passport.command_scale)}, those of "
            f"'{robot.name}' are {list(scale)}. Train and export it again."
        )
    if passport.image is not None and (problem := passport.image.problem(robot, control_hz)):
        raise BundleError(f"policy '{where}' {problem}")


def takes_disturbances(names: tuple[str, ...], robot: Robot) -> bool:
    """Whether a network with inputs of these names takes estimated disturbances of a robot."""
    return not set(disturbance_terms(robot)).isdisjoint(names)


def action_of(robot: Robot) -> Action:
    """What kind of commands a robot takes."""
    return "on_off" if robot.actuators.binary else "continuous"


def _check_names(what: str, found: tuple[str, ...], needed: tuple[str, ...], where: str) -> None:
    if found == needed:
        return
    if len(found) != len(needed):
        raise BundleError(f"policy '{where}' has {len(found)} {what} names, {len(needed)} are needed.")
    index = next(i for i, (a, b) in enumerate(zip(found, needed, strict=True)) if a != b)
    raise BundleError(
        f"policy '{where}': {what} {index + 1} is '{found[index]}', it must be '{needed[index]}'."
    )


def _passport_of(values: Any, path: Path) -> Passport:
    if not isinstance(values, dict):
        raise BundleError(f"{path}: must hold one JSON object. Export the policy again.")
    known = {f.name for f in fields(Passport)}
    for name in values:
        if name not in known:
            raise BundleError(f"{path}: unknown key '{name}'.{did_you_mean(name, known)}")
    values = LATER | values
    missing = known - values.keys()
    if missing:
        raise BundleError(f"{path}: lacks the key '{min(missing)}'. Export the policy again.")
    for name, kinds in _KINDS.items():
        if not isinstance(values[name], kinds) or isinstance(values[name], bool) != (kinds is bool):
            raise BundleError(
                f"{path}: '{name}' is {values[name]!r}, which is of the wrong type. Export the policy again."
            )
    if values["action"] not in get_args(Action) or values["memory"] < 0:
        raise BundleError(f"{path}: 'action' or 'memory' has no meaning. Export the policy again.")
    if not all(isinstance(value, int | float) for value in values["command_scale"]):
        raise BundleError(f"{path}: 'command_scale' must hold numbers. Export the policy again.")
    if not isinstance(values["envelope"], dict | None):
        raise BundleError(f"{path}: 'envelope' has no meaning. Certify the policy again: fulmar certify")
    for name in ("observation_names", "actuator_names"):
        values[name] = tuple(map(str, values[name]))
    values["command_scale"] = tuple(map(float, values["command_scale"]))
    try:
        values["image"] = None if values["image"] is None else ImageInput.from_plain(values["image"])
    except (ValueError, TypeError) as error:
        raise BundleError(f"{path}: 'image' has no meaning: {error}. Export the policy again.") from error
    return Passport(**values)


_KINDS: dict[str, type | tuple[type, ...]] = {
    "format": int,
    "robot": str,
    "task": str,
    "control_hz": (int, float),
    "observation_names": (list, tuple),
    "actuator_names": (list, tuple),
    "action": str,
    "command_scale": (list, tuple),
    "memory": int,
    "network_sha256": str,
    "golden_sha256": str,
    "training": dict,
    "sha256": str,
    "remembers_command": bool,
}


def _content(folder: Path, name: str) -> bytes:
    path = folder / name
    check_folder(folder)
    if not path.is_file():
        raise BundleError(f"policy '{folder}' has no {name}. {EXPORT}.")
    try:
        return read_bounded(path, MAX_BYTES)
    except OSError as error:
        raise BundleError(f"{path}: cannot be read: {error.strerror}. Export the policy again.") from error


def _golden_of(content: bytes, path: Path) -> Golden:
    try:
        arrays = load_arrays(content, MAX_BYTES)
        found = {f.name: arrays[f.name] for f in fields(Golden) if f.name in arrays}
        missing = [f.name for f in fields(Golden) if f.name not in (*found, "images")]
        if missing:
            raise ValueError(f"lacks an array: {missing[0]}")
        return Golden(**found)
    except ValueError as error:
        raise BundleError(f"{path}: cannot be read: {error}. Export the policy again.") from error


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
