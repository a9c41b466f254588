"""Settings of a training run, as read from `configs/training/<robot>_<task>.yaml` or `<family>.yaml`."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names, config_path
from fulmar_core.config.strict_yaml import at_least_1, load_config, positive, shares
from fulmar_core.config.yaml_text import dump
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.symmetry import Symmetry
from fulmar_core.tasks import Task

Precision = Literal["float32", "bfloat16"]
ActionSpace = Literal["actuators", "wrench"]

# Keys of earlier versions, and what to write today.
RENAMED = {
    "lessons": "'cloning_updates'",  # word: an old key
    "told": "'disturbance_inputs'",  # word: an old key
    "wrench": "'action_space: wrench'",
    "gas": "'valve_cost'",  # word: an old key
    "orders": "'incremental_actions'",  # word: an old key
    "refinement": "'annealing'",  # word: an old key
    "updates": "'target_kl' in 'annealing'",
    "specialist": "'fallback_policy'",  # word: an old key
    "training": "'settings' in 'fallback_policy'",
}


@dataclass(frozen=True, kw_only=True)
class OnPolicy:
    """Hyper-parameters of PPO (Schulman et al., arXiv 1707.06347)."""

    steps: int  # actions of each world between updates
    minibatch: int
    epochs: int
    learning_rate: float  # to begin with
    learning_rate_range: tuple[float, float]
    target_kl: float  # the learning rate moves to keep the KL divergence of an update near this
    gamma: float
    gae_lambda: float
    clip_range: float
    max_grad_norm: float
    hidden: tuple[int, ...]  # sizes of the hidden layers, of policy and value alike
    entropy: float = 0.0  # weight of the entropy in the loss
    log_std: float = 0.0  # logarithm of the first standard deviation of continuous actions

    def __post_init__(self) -> None:
        at_least_1(steps=self.steps, minibatch=self.minibatch, epochs=self.epochs, hidden=self.hidden)
        low, high = self.learning_rate_range
        if not 0.0 < low <= high:
            raise ValueError("'learning_rate_range' must be [low, high] with 0 < low <= high.")
        positive(
            learning_rate=self.learning_rate,
            target_kl=self.target_kl,
            clip_range=self.clip_range,
            max_grad_norm=self.max_grad_norm,
        )
        shares(gamma=self.gamma, gae_lambda=self.gae_lambda)


@dataclass(frozen=True, kw_only=True)
class Ppo(OnPolicy):
    """PPO without memory."""

    kind: Literal["ppo"] = "ppo"
    fast: bool = True  # our faster computation of it instead of the one of Stable-Baselines3
    cloning_updates: int = 0  # first updates, which clone the classical law of the robot's family
    # Of hidden layers while they learn: bfloat16 takes half the time where the processor multiplies it (avx512_bf16 or
    # amx_bf16 in /proc/cpuinfo), and more elsewhere. It is never chosen by the processor: one seed, one policy.
    precision: Precision = "float32"


@dataclass(frozen=True, kw_only=True)
class RecurrentPpo(OnPolicy):
    """PPO with an LSTM before the hidden layers, of policy and value alike (sb3-contrib)."""

    kind: Literal["recurrent_ppo"] = "recurrent_ppo"
    memory: int  # units of the LSTM

    def __post_init__(self) -> None:
        super().__post_init__()
        at_least_1(memory=self.memory)


@dataclass(frozen=True, kw_only=True)
class OffPolicy:
    """Hyper-parameters that SAC and TD3 share; `gradient_steps` follow every step of the batch of worlds."""

    learning_rate: float
    buffer: int  # transitions remembered
    minibatch: int
    first_steps: int  # transitions before learning begins
    gradient_steps: int
    tau: float  # how fast the target networks follow [-]
    gamma: float
    hidden: tuple[int, ...]  # sizes of the hidden layers

    def __post_init__(self) -> None:
        at_least_1(
            buffer=self.buffer,
            minibatch=self.minibatch,
            gradient_steps=self.gradient_steps,
            hidden=self.hidden,
        )
        if self.first_steps < 0:
            raise ValueError("'first_steps' must not be negative.")
        positive(learning_rate=self.learning_rate)
        shares(tau=self.tau, gamma=self.gamma)


@dataclass(frozen=True, kw_only=True)
class Sac(OffPolicy):
    """Soft actor-critic (Haarnoja et al., arXiv 1812.05905); its temperature adapts itself."""

    kind: Literal["sac"] = "sac"


@dataclass(frozen=True, kw_only=True)
class Td3(OffPolicy):
    """Twin delayed DDPG (Fujimoto et al., arXiv 1802.09477)."""

    kind: Literal["td3"] = "td3"
    action_noise: float  # standard deviation of the exploration, as a share of full command [-]


@dataclass(frozen=True, kw_only=True)
class Dreamer:
    """Hyper-parameters of DreamerV3 (Hafner et al., arXiv 2301.04104), which sheeprl computes; see `make dreamer`.

    An update is one gradient step of world model, actor and critic.
    """

    kind: Literal["dreamer"] = "dreamer"
    recurrent: int  # numbers of the deterministic state
    groups: int  # variables of the discrete state
    classes: int  # of each
    dense: int  # units of each hidden layer
    layers: int  # hidden layers of encoder, decoder, actor and critic
    minibatch: int  # sequences of a gradient step
    sequence: int  # control steps of each
    horizon: int  # control steps that are imagined
    replay_ratio: float  # gradient steps for each control step
    first_steps: int  # control steps with random actions
    buffer: int  # control steps remembered
    learning_rate: float  # of the world model
    actor_rate: float  # learning rate of actor and critic
    gamma: float

    def __post_init__(self) -> None:
        at_least_1(
            recurrent=self.recurrent, groups=self.groups, classes=self.classes, dense=self.dense,
            layers=self.layers, minibatch=self.minibatch, sequence=self.sequence, horizon=self.horizon,
            buffer=self.buffer, first_steps=self.first_steps,
        )  # fmt: skip
        positive(replay_ratio=self.replay_ratio, learning_rate=self.learning_rate, actor_rate=self.actor_rate)
        shares(gamma=self.gamma)


@dataclass(frozen=True, kw_only=True)
class Clone:
    """Learning to see a goal from images, for a fixed law that steers there (`training.image_cloning`)."""

    kind: Literal["clone"] = "clone"
    reading: Literal["camera_depth", "camera_image"] = "camera_depth"
    every: int  # of so many pixels along each side of an image one is taken; odd
    channels: tuple[int, ...]  # of the convolutions
    features: int  # of the layer behind them
    views: int  # drawn to begin with
    buffer: int  # views remembered
    keep_every: int  # control steps of a flight between two views that are kept
    flights: int  # of a check on held-out episodes
    minibatch: int
    gradient_steps: int  # of an update
    learning_rate: float
    speed: float  # of the approach [m/s]
    turn_rate: float  # [rad/s]

    def __post_init__(self) -> None:
        at_least_1(
            every=self.every,
            channels=self.channels,
            features=self.features,
            views=self.views,
            buffer=self.buffer,
            keep_every=self.keep_every,
            flights=self.flights,
            minibatch=self.minibatch,
            gradient_steps=self.gradient_steps,
        )
        positive(learning_rate=self.learning_rate, speed=self.speed, turn_rate=self.turn_rate)


Algorithm = Ppo | RecurrentPpo | Sac | Td3 | Dreamer | Clone


@dataclass(frozen=True)
class Annealing:
    """Linear schedule of effort, entropy and update size, for economy and precision late in a run."""

    begin: float  # share of the run at which it begins [-]
    end: float  # share of the run at which it ends [-]
    effort: float  # final factor on the cost of using the actuators [-]
    entropy: float  # final weight of the entropy in the loss; below 0 it makes the policy deterministic
    target_kl: float = 1.0  # final factor on the algorithm's `target_kl`

    def __post_init__(self) -> None:
        if not 0.0 <= self.begin < self.end <= 1.0 or min(self.effort, self.target_kl) <= 0.0:
            raise ValueError(
                "'begin' must lie in [0, 1), 'end' beyond it in (0, 1], 'effort' and 'target_kl' be greater than 0."
            )

    def share(self, progress: float) -> float:
        """Position in the schedule [-], where `progress` is the share of the run that is over [-]."""
        return min(1.0, max(0.0, (progress - self.begin) / (self.end - self.begin)))


@dataclass(frozen=True)
class IncrementalActions:
    """Actions astern, hold or ahead for actuators with slew (`training.incremental_actions`)."""

    hold: int  # control steps for which an action is held in training; a deployed policy acts at every step

    def __post_init__(self) -> None:
        if self.hold < 1:
            raise ValueError("'hold' must be at least 1.")


@dataclass(frozen=True)
class FallbackPlan:
    """A second policy for robots that dead valves make uncontrollable (`training.fallback_policy`)."""

    settings: str  # its own settings: a file of `configs/training`
    share: float  # of the run, for which it learns before the main policy begins [-]

    def __post_init__(self) -> None:
        if not 0.0 < self.share < 1.0:
            raise ValueError("'share' must lie between 0 and 1.")


@dataclass(frozen=True)
class StopAtSuccess:
    """Early end of a run that has learned its task."""

    rate: float  # success rate that is enough [-]
    checks: int = 2  # in a row

    def __post_init__(self) -> None:
        if not 0.0 < self.rate <= 1.0 or self.checks < 1:
            raise ValueError("'rate' must lie in (0, 1] and 'checks' be at least 1.")

    def reached(self, rates: Sequence[float]) -> bool:
        """Whether the last checks, of these success rates, were all good enough."""
        last = rates[-self.checks :]
        return len(last) == self.checks and all(rate >= self.rate for rate in last)


@dataclass(frozen=True)
class TrainingSettings:
    """Algorithm, worlds to learn in, and when to stop."""

    algorithm: Algorithm
    scenario: str  # name of the scenario that episodes are drawn from
    worlds: int  # simulated in one batch
    reward_scale: float
    time_limit_s: float  # wall-clock of the learning itself [s]
    # Between evaluations on held-out episodes, in runs of `time_limit_s`. In runs of a number of updates it is the same
    # share of the run, so that a seed gives the same best network on any machine.
    evaluate_every_s: float  # [s]
    checkpoint_every_s: float = 30.0  # wall-clock between checkpoints to resume from [s]
    annealing: Annealing | None = None  # of ppo and recurrent_ppo
    stop_at_success: StopAtSuccess | None = None
    fallback_policy: FallbackPlan | None = None
    disturbance_inputs: bool = False  # pushes and dead valves are network inputs; for on/off valves
    action_space: ActionSpace = "actuators"  # or a wrench, for which actuators are then chosen
    body_inputs: bool = (
        False  # what the body can do is network inputs; with a wrench, for thrusters by degrees
    )
    # The policy sees goals on the right mirrored to the left, or with `ends` goals behind mirrored to the front.
    mirror: Symmetry | None = None
    valve_cost: float = 1.0  # of an open valve in the choice for a wrench, as a multiple; less is more exact
    compiled: bool = False  # whether steps of the worlds are compiled first
    incremental_actions: IncrementalActions | None = None  # without: shares of full command
    control_hz: float | None = None  # rate of the commands; the robot's own by default [Hz]

    def __post_init__(self) -> None:
        algorithm = self.algorithm
        wrench = self.action_space == "wrench"
        cloning = isinstance(algorithm, Ppo) and algorithm.cloning_updates > 0
        if isinstance(algorithm, Ppo) and cloning and not algorithm.fast:
            raise ValueError("'cloning_updates' are for the fast PPO.")
        if isinstance(algorithm, Ppo) and algorithm.precision != "float32" and not algorithm.fast:
            raise ValueError(f"'precision: {algorithm.precision}' is for the fast PPO.")
        if self.fallback_policy and (not self.disturbance_inputs or isinstance(algorithm, RecurrentPpo)):
            raise ValueError(
                "'fallback_policy' needs 'disturbance_inputs', which say when it takes over, and a network without "
                "memory."
            )
        if self.mirror and isinstance(algorithm, RecurrentPpo):
            raise ValueError("'mirror' is for networks without memory: a memory has a side, too.")
        if self.incremental_actions and (
            not isinstance(algorithm, Ppo) or cloning or self.disturbance_inputs or wrench
        ):
            raise ValueError(
                "'incremental_actions' are for ppo, without 'cloning_updates', 'disturbance_inputs' and "
                "'action_space: wrench'."
            )
        special = self.disturbance_inputs or wrench or self.mirror or self.compiled
        if isinstance(algorithm, Dreamer) and special:
            raise ValueError(
                "'disturbance_inputs', 'action_space: wrench', 'mirror' and 'compiled' are not for dreamer, whose "
                "worlds are Gymnasium's."
            )
        if wrench and isinstance(algorithm, OffPolicy):
            raise ValueError(
                f"'action_space: wrench' is for ppo and recurrent_ppo, not for {algorithm.kind}."
            )
        if self.body_inputs and (not wrench or self.disturbance_inputs):
            raise ValueError(
                "'body_inputs' need 'action_space: wrench', and go without 'disturbance_inputs'."
            )
        if isinstance(algorithm, OnPolicy) and (self.worlds * algorithm.steps) % algorithm.minibatch:
            raise ValueError(
                f"worlds · steps = {self.worlds * algorithm.steps} must be a multiple of 'minibatch'."
            )
        if self.annealing and not isinstance(algorithm, OnPolicy):
            raise ValueError(
                f"'annealing' is for ppo and recurrent_ppo; {algorithm.kind} weighs entropy by itself."
            )
        if self.worlds < 1 or self.time_limit_s <= 0.0:
            raise ValueError("'worlds' must be at least 1, 'time_limit_s' greater than 0.")
        positive(evaluate_every_s=self.evaluate_every_s, checkpoint_every_s=self.checkpoint_every_s)

    def learner_of(self, robot: Robot) -> Robot:
        """The robot with the control rate of these settings.

        Raises:
            ConfigError: The rate does not divide the rate of the robot's physics.
        """
        if self.control_hz is None:
            return robot
        try:
            return replace(robot, timing=replace(robot.timing, control_hz=self.control_hz))
        except ValueError as error:
            raise ConfigError(f"'{robot.name}' cannot be commanded at this rate: {error}") from error

    def effort(self, progress: float) -> float:
        """Factor on the cost of using the actuators when this share of the run is over [-]."""
        return self._annealed(progress, 1.0, self.annealing.effort) if self.annealing else 1.0

    def target_kl(self, progress: float) -> float:
        """KL divergence at which an on-policy update aims then."""
        assert isinstance(self.algorithm, OnPolicy)
        first = self.algorithm.target_kl
        return first * self._annealed(progress, 1.0, self.annealing.target_kl) if self.annealing else first

    def entropy(self, progress: float) -> float:
        """Weight of the entropy in the loss of an on-policy learner then."""
        assert isinstance(self.algorithm, OnPolicy)
        first = self.algorithm.entropy
        return self._annealed(progress, first, self.annealing.entropy) if self.annealing else first

    def _annealed(self, progress: float, first: float, last: float) -> float:
        assert self.annealing is not None
        return first + (last - first) * self.annealing.share(progress)


def load_training_settings(robot: Robot, task: Task, name: str | None = None) -> TrainingSettings:
    """Read the settings for a robot and a task.

    Args:
        robot: The robot.
        task: The task.
        name: A file of `configs/training`, or a path to a YAML file; by default `<robot>_<task>`, if there is one,
            else the robot's own `recipe`, such as `thrusters`.

    Raises:
        ConfigError: No such file, a mistake in it, or an algorithm that cannot drive this robot.
    """
    own = f"{robot.name}_{task.name}"
    name = name or (own if own in config_names("training") else robot.recipe)
    path = Path(name) if name.endswith((".yaml", ".yml")) else config_path("training", name)
    try:
        settings = load_config(TrainingSettings, path)
    except ConfigError as error:
        unknown = re.match(r"(.*): unknown key '(\w+)'", str(error))
        if unknown is None or unknown[2] not in RENAMED:
            raise
        raise ConfigError(
            f"{unknown[1]}: '{unknown[2]}' has a new name: write {RENAMED[unknown[2]]}."
        ) from error
    if robot.actuators.binary and isinstance(settings.algorithm, OffPolicy | Dreamer):
        raise ConfigError(
            f"{path}: {settings.algorithm.kind} needs actuators that move by degrees, those of '{robot.name}' are "
            "on/off. Use ppo or recurrent_ppo."
        )
    return settings


def write_training_settings(settings: TrainingSettings, path: Path) -> None:
    """Write settings as a YAML file that `load_training_settings` reads."""
    plain = json.loads(json.dumps(asdict(settings)))  # tuples become lists
    path.write_text(dump(plain), encoding="utf-8")
