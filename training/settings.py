"""What a training run is made with, as read from `configs/training/<robot>_<task>.yaml` or `<family>.yaml`."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

import yaml

from fulmar_core.config import at_least_1, load_config, positive, shares
from fulmar_core.errors import ConfigError
from fulmar_core.paths import config_names, config_path
from fulmar_core.robot import Robot
from fulmar_core.symmetry import Symmetry
from fulmar_core.tasks import Task

Precision = Literal["float32", "bfloat16"]


@dataclass(frozen=True, kw_only=True)
class OnPolicy:
    """Hyper-parameters of PPO (Schulman et al., arXiv 1707.06347), in its own terms."""

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
        """Refuse what no learner can do."""
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
    lessons: int = 0  # updates in which it first imitates the classical law of the robot's family
    # Of hidden layers while they learn: bfloat16 takes half the time where the processor multiplies it (avx512_bf16 or
    # amx_bf16 in /proc/cpuinfo), and more elsewhere. No processor chooses by itself: a seed asks for one policy.
    precision: Precision = "float32"


@dataclass(frozen=True, kw_only=True)
class RecurrentPpo(OnPolicy):
    """PPO with an LSTM before the hidden layers, of policy and value alike (sb3-contrib)."""

    kind: Literal["recurrent_ppo"] = "recurrent_ppo"
    memory: int  # units of the LSTM

    def __post_init__(self) -> None:
        """The same, and memories of nothing."""
        super().__post_init__()
        at_least_1(memory=self.memory)


@dataclass(frozen=True, kw_only=True)
class OffPolicy:
    """What SAC and TD3 have in common; every step of the batch of worlds is followed by `gradient_steps`."""

    learning_rate: float
    buffer: int  # transitions remembered
    minibatch: int
    first_steps: int  # transitions before learning begins
    gradient_steps: int
    tau: float  # how fast the target networks follow [-]
    gamma: float
    hidden: tuple[int, ...]  # sizes of the hidden layers

    def __post_init__(self) -> None:
        """Refuse what no learner can do."""
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


Algorithm = Ppo | RecurrentPpo | Sac | Td3


@dataclass(frozen=True)
class Refinement:
    """Economy and precision, later in a run: dearer commands, less exploring and smaller updates, all linearly."""

    begin: float  # share of the run after which it begins [-]
    end: float  # same of where it is whole [-]
    effort: float  # factor on what using the actuators costs, in the end [-]
    entropy: float  # weight of the entropy in the loss, in the end; less than 0 makes a policy sure of itself
    updates: float = 1.0  # factor on `target_kl`, in the end

    def __post_init__(self) -> None:
        """Refuse shares that are none."""
        if not 0.0 <= self.begin < self.end <= 1.0 or min(self.effort, self.updates) <= 0.0:
            raise ValueError(
                "'begin' must lie in [0, 1), 'end' beyond it in (0, 1], 'effort' and 'updates' be greater than 0."
            )

    def share(self, progress: float) -> float:
        """How much of it holds, where `progress` is the share of the run that is over [-]."""
        return min(1.0, max(0.0, (progress - self.begin) / (self.end - self.begin)))


@dataclass(frozen=True)
class Orders:
    """Incremental actions (`training.incremental_actions`): astern, hold, or ahead, for actuators that slew."""

    hold: int  # control steps that an order stands for while it learns; deployed, orders come at every step

    def __post_init__(self) -> None:
        """Refuse to hold nothing."""
        if self.hold < 1:
            raise ValueError("'hold' must be at least 1.")


@dataclass(frozen=True)
class SpecialistPlan:
    """A second network, which takes over where dead valves leave no pose to hold (`training.fallback_policy`)."""

    training: str  # its own settings: a file of `configs/training`
    share: float  # of the run that it learns for, before the other begins [-]

    def __post_init__(self) -> None:
        """Refuse to leave nothing to one of them."""
        if not 0.0 < self.share < 1.0:
            raise ValueError("'share' must lie between 0 and 1.")


@dataclass(frozen=True)
class StopAtSuccess:
    """Ends a run early, once it has learned its task."""

    rate: float  # success rate that is enough [-]
    checks: int = 2  # in a row

    def __post_init__(self) -> None:
        """Refuse what would always or never stop."""
        if not 0.0 < self.rate <= 1.0 or self.checks < 1:
            raise ValueError("'rate' must lie in (0, 1] and 'checks' be at least 1.")


@dataclass(frozen=True)
class TrainingSettings:
    """Algorithm, worlds to learn in, and when to stop."""

    algorithm: Algorithm
    scenario: str  # name of the scenario that episodes are drawn from
    worlds: int  # simulated in one batch
    reward_scale: float
    time_limit_s: float  # wall-clock of the learning itself [s]
    # Between checks on held-out episodes, in runs of `time_limit_s`; in runs of so many updates the same share of the
    # run, so that the same seed keeps the same network on any machine.
    evaluate_every_s: float  # [s]
    checkpoint_every_s: float = 30.0  # wall-clock between checkpoints to resume from [s]
    refinement: Refinement | None = None  # of ppo and recurrent_ppo
    stop_at_success: StopAtSuccess | None = None
    specialist: SpecialistPlan | None = None
    told: bool = False  # whether the network is told pushes and dead valves, of robots with on/off valves
    wrench: bool = (
        False  # whether it asks for a wrench that on/off valves are then chosen for, not for single valves
    )
    # Goals on the right are shown, and answered, as on the left; or, by `ends`, those behind as those ahead.
    mirror: Symmetry | None = None
    gas: float = 1.0  # what a valve costs in that choice, as a multiple; less is more exact, and uses more
    compiled: bool = False  # whether steps of the worlds are compiled first
    orders: Orders | None = None  # shares of full command without it
    control_hz: float | None = None  # rate of the commands; the robot's own by default [Hz]

    def __post_init__(self) -> None:
        """Refuse sizes that do not divide."""
        algorithm = self.algorithm
        if isinstance(algorithm, Ppo) and algorithm.lessons and not algorithm.fast:
            raise ValueError("'lessons' are for the fast PPO.")
        if isinstance(algorithm, Ppo) and algorithm.precision != "float32" and not algorithm.fast:
            raise ValueError(f"'precision: {algorithm.precision}' is for the fast PPO.")
        if self.specialist and (not self.told or isinstance(algorithm, RecurrentPpo)):
            raise ValueError(
                "'specialist' needs 'told', to know when its time has come, and a network without memory."
            )
        if self.mirror and isinstance(algorithm, RecurrentPpo):
            raise ValueError("'mirror' is for networks without memory: what they remember has a side, too.")
        if self.orders and (not isinstance(algorithm, Ppo) or algorithm.lessons or self.told or self.wrench):
            raise ValueError("'orders' are for ppo, without 'lessons', 'told' and 'wrench'.")
        if isinstance(algorithm, OnPolicy) and (self.worlds * algorithm.steps) % algorithm.minibatch:
            raise ValueError(
                f"worlds · steps = {self.worlds * algorithm.steps} must be a multiple of 'minibatch'."
            )
        if self.refinement and not isinstance(algorithm, OnPolicy):
            raise ValueError(
                f"'refinement' is for ppo and recurrent_ppo; {algorithm.kind} weighs entropy by itself."
            )
        if self.worlds < 1 or self.time_limit_s <= 0.0:
            raise ValueError("'worlds' must be at least 1, 'time_limit_s' greater than 0.")
        positive(evaluate_every_s=self.evaluate_every_s, checkpoint_every_s=self.checkpoint_every_s)

    def learner_of(self, robot: Robot) -> Robot:
        """The robot as it learns: with the rate of the commands that is asked for.

        Raises:
            ConfigError: The rate does not divide that of the robot's physics.
        """
        if self.control_hz is None:
            return robot
        try:
            return replace(robot, timing=replace(robot.timing, control_hz=self.control_hz))
        except ValueError as error:
            raise ConfigError(f"'{robot.name}' cannot be commanded at this rate: {error}") from error

    def effort(self, progress: float) -> float:
        """Factor on what using the actuators costs when this share of the run is over [-]."""
        return self._refined(progress, 1.0, self.refinement.effort) if self.refinement else 1.0

    def target_kl(self, progress: float) -> float:
        """How far an update of an on-policy learner goes then."""
        assert isinstance(self.algorithm, OnPolicy)
        first = self.algorithm.target_kl
        return first * self._refined(progress, 1.0, self.refinement.updates) if self.refinement else first

    def entropy(self, progress: float) -> float:
        """Weight of the entropy in the loss of an on-policy learner then."""
        assert isinstance(self.algorithm, OnPolicy)
        first = self.algorithm.entropy
        return self._refined(progress, first, self.refinement.entropy) if self.refinement else first

    def _refined(self, progress: float, first: float, last: float) -> float:
        assert self.refinement is not None
        return first + (last - first) * self.refinement.share(progress)


def load_training_settings(robot: Robot, task: Task, name: str | None = None) -> TrainingSettings:
    """Read the settings for a robot and a task.

    Args:
        robot: The robot.
        task: The task.
        name: A file of `configs/training`, or a path to a YAML file; by default `<robot>_<task>`, if there is one,
            else the one of the robot's family of actuators, such as `thrusters`.

    Returns:
        The settings.

    Raises:
        ConfigError: No such file, a mistake in it, or an algorithm that cannot drive this robot.
    """
    own = f"{robot.name}_{task.name}"
    name = name or (own if own in config_names("training") else robot.actuators.kind)
    path = Path(name) if name.endswith((".yaml", ".yml")) else config_path("training", name)
    settings = load_config(TrainingSettings, path)
    if robot.actuators.binary and isinstance(settings.algorithm, OffPolicy):
        raise ConfigError(
            f"{path}: {settings.algorithm.kind} needs actuators that move by degrees, those of '{robot.name}' are "
            "on/off. Use ppo or recurrent_ppo."
        )
    return settings


def write_training_settings(settings: TrainingSettings, path: Path) -> None:
    """Write settings as a YAML file that `load_training_settings` reads."""
    plain = json.loads(json.dumps(asdict(settings)))  # tuples become lists
    path.write_text(yaml.safe_dump(plain, sort_keys=False), encoding="utf-8")
