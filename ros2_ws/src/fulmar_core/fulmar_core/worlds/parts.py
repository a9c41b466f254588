"""What may disturb an episode, each part as read from a scenario's YAML."""

from __future__ import annotations

from dataclasses import dataclass

Range = tuple[float, float]


@dataclass(frozen=True)
class Push:
    """A force and a torque, as shares of what the robot itself can bring up (`performance` of its YAML)."""

    force: float = 0.0  # largest [-]
    torque: float = 0.0  # largest, of either sign [-]
    least: float = 0.0  # smallest, as a share of the largest [-]

    def __post_init__(self) -> None:
        if min(self.force, self.torque) < 0.0 or not 0.0 <= self.least <= 1.0:
            raise ValueError("force and torque must not be negative, and 'least' must lie in [0, 1].")


@dataclass(frozen=True)
class Wave:
    """A push that is sinusoidal in the place: an uneven floor (RANS `cfg/task/disturbances`)."""

    force: float = 0.0  # largest amplitude, share of the robot's own [-]
    torque: float = 0.0  # same [-]
    least: float = 0.0  # smallest, as a share of the largest [-]
    wave_number: Range = (0.25, 3.0)  # [rad/m]

    def __post_init__(self) -> None:
        if min(self.force, self.torque, self.wave_number[0]) < 0.0 or not 0.0 <= self.least <= 1.0:
            raise ValueError(
                "force, torque and wave_number must not be negative, 'least' must lie in [0, 1]."
            )
        if self.wave_number[0] > self.wave_number[1]:
            raise ValueError("'wave_number' must be [low, high] with low <= high.")


@dataclass(frozen=True)
class Kick:
    """A push for one control step, again and again (RoboRAN `domain_randomization`)."""

    force: float = 0.0  # largest, share of the robot's own [-]
    every_s: Range = (4.0, 6.0)  # [s]

    def __post_init__(self) -> None:
        if self.force < 0.0:
            raise ValueError("'force' must not be negative.")
        if not 0.0 < self.every_s[0] <= self.every_s[1]:
            raise ValueError("'every_s' must be [low, high] with low <= high, and greater than 0.")


@dataclass(frozen=True)
class Tether:
    """An air line that hangs from somewhere above: a pendulum's pull, and with it a moment."""

    stiffness: Range = (0.0, 0.0)  # pull per metre aside of the anchor [N/m]
    reach: float = 0.0  # farthest that the anchor is from the world's origin [m]
    lever: float = 0.0  # farthest that the line is fastened from the body's origin [m]

    def __post_init__(self) -> None:
        low, high = self.stiffness
        if min(low, self.reach, self.lever) < 0.0 or low > high:
            raise ValueError(
                "'stiffness' must be [low, high] with 0 <= low <= high; reach and lever must not be negative."
            )


@dataclass(frozen=True)
class Slope:
    """A floor that is not level: weight pulls the same way everywhere."""

    milliradians: Range = (0.0, 0.0)
    direction_deg: float = 0.0  # in which it falls, in the world [deg]

    def __post_init__(self) -> None:
        if not 0.0 <= self.milliradians[0] <= self.milliradians[1] <= 100.0:
            raise ValueError("'milliradians' must be [low, high] with 0 <= low <= high <= 100.")


@dataclass(frozen=True)
class Solar:
    """Pressure of sunlight on a satellite, along the world's −x."""

    force: float = 0.0  # [N]
    arm: float = 0.0  # of its centre from the centre of mass, along the body's z [m]

    def __post_init__(self) -> None:
        if self.force < 0.0:
            raise ValueError("'force' must not be negative.")


@dataclass(frozen=True)
class Air:
    """The air around an aircraft."""

    wind: Range = (0.0, 0.0)  # steady, level, from anywhere [m/s]
    turbulence: float = 0.0  # wind at 20 ft that it comes from: 7.7 light, 15.4 moderate, 23.1 severe [m/s]
    least_turbulence: float = 1.0  # of any episode, as a share of `turbulence` [-]
    altitude: float = 0.0  # of the ground or the water above mean sea level [m]

    def __post_init__(self) -> None:
        if not 0.0 <= self.wind[0] <= self.wind[1] or self.turbulence < 0.0:
            raise ValueError("'wind' must be [low, high] with 0 <= low <= high, 'turbulence' not negative.")
        if not 0.0 <= self.least_turbulence <= 1.0:
            raise ValueError(f"'least_turbulence' = {self.least_turbulence:g} must lie in [0, 1].")
        if not -1000.0 <= self.altitude <= 11_000.0:
            raise ValueError(f"'altitude' = {self.altitude:g} m must lie between -1000 and 11000.")


@dataclass(frozen=True)
class InertiaChange:
    """How the inertia of a satellite changes in an episode, all of it by one factor (arXiv 2510.16738)."""

    step: float = 0.0  # share that comes at once [-]
    step_s: float = 0.0  # when [s]
    drift: float = 0.0  # share that comes in each second [1/s]
    swing: float = 0.0  # amplitude of a sine, as a share [-]
    swing_hz: float = 0.0  # its frequency [Hz]

    def __post_init__(self) -> None:
        if self.step <= -1.0 or not -1.0 < self.swing < 1.0:
            raise ValueError("'step' and 'swing' must leave some inertia: greater than -1.")
        if min(self.step_s, self.swing_hz) < 0.0:
            raise ValueError("step_s and swing_hz must not be negative.")

    @property
    def numbers(self) -> tuple[float, ...]:
        """All of it, in the order of the fields."""
        return self.step, self.step_s, self.drift, self.swing, self.swing_hz


@dataclass(frozen=True)
class Stuck:
    """One part that stands at a value from a time on, whatever it is commanded; which one is drawn."""

    # Names, or patterns as in file names, of the parts of which one sticks: thruster_*, elevator. Empty: none.
    actuators: tuple[str, ...] = ()
    at: float = 0.0  # share of its largest value: 0 closed, dead or neutral, 1 open, 0.5 half travel [-]
    from_s: Range = (0.0, 0.0)  # from when on in an episode [s]

    def __post_init__(self) -> None:
        if not -1.0 <= self.at <= 1.0:
            raise ValueError(f"'at' = {self.at:g} must lie in [-1, 1], a share of the part's largest value.")
        if not 0.0 <= self.from_s[0] <= self.from_s[1]:
            raise ValueError("'from_s' must be [low, high] with 0 <= low <= high.")


@dataclass(frozen=True)
class Supply:
    """What drives all actuators, as pressure or voltage, and how it falls within an episode."""

    left: float = 1.0  # share that is left in the end; what actuators do falls by it [-]
    from_s: float = 0.0  # when it begins to fall [s]
    over_s: float = 1.0  # how long it falls [s]
    # Of robots with a tank in their file: its pressure at the start, by that of the full one. In batches tanks empty
    # only where this is below 1; in simulators, which run for longer, they always do [-].
    tank: float = 1.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.left <= 1.0:
            raise ValueError(f"'left' = {self.left:g} must lie in [0, 1], a share of the full supply.")
        if self.from_s < 0.0 or self.over_s <= 0.0:
            raise ValueError("'from_s' must not be negative, and 'over_s' must be greater than 0.")
        if not 0.0 <= self.tank <= 1.0:
            raise ValueError(
                f"'tank' = {self.tank:g} must lie in [0, 1], a share of the full tank's pressure."
            )


@dataclass(frozen=True)
class Actuation:
    """What may be wrong with the actuators."""

    noise: float = 0.0  # largest error at each control step, uniform, as a share of full command [-]
    least_noise: float = 0.0  # smallest of these, as a share of the largest [-]
    gain: Range = (1.0, 1.0)  # each actuator's own factor, for a whole episode [-]
    delay_s: float = 0.0  # largest delay of commands; with one of opening at most one control step [s]
    least_delay: float = 0.0  # smallest of these, as a share of the largest [-]
    opening_delay_s: Range = (0.0, 0.0)  # by which closed valves open late; closing does not wait [s]
    failures: int = 0  # most actuators that stay closed or still for a whole episode
    failure_chance: float = 0.0  # of each of these [-]
    # Only failures, all at once, after which no pose can be held, where a robot has thrusters that can fail so.
    stranding: bool = False  # word: key of scenario files
    stuck: Stuck = Stuck()
    supply: Supply = Supply()

    @property
    def changes(self) -> bool:
        """Whether actuators change within an episode."""
        return bool(self.stuck.actuators) or self.supply.left < 1.0

    def __post_init__(self) -> None:
        if min(self.noise, self.delay_s, self.failures, self.gain[0], self.failure_chance) < 0.0:
            raise ValueError("noise, delay, gain and failures must not be negative.")
        if self.gain[0] > self.gain[1] or self.failure_chance > 1.0:
            raise ValueError("'gain' must be [low, high] with low <= high, 'failure_chance' at most 1.")
        if not 0.0 <= self.opening_delay_s[0] <= self.opening_delay_s[1]:
            raise ValueError("'opening_delay_s' must be [low, high] with 0 <= low <= high.")
        if (self.failures > 0) != (self.failure_chance > 0.0):
            raise ValueError(
                "'failures' and 'failure_chance' need one another: how many may fail, and how often."
            )
        if self.stranding and not self.failures:  # word: key of scenario files
            needs = "'stranding' needs 'failures'"  # word: key of scenario files
            raise ValueError(f"{needs}, the number of those that are lost together.")
        if not (0.0 <= self.least_noise <= 1.0 and 0.0 <= self.least_delay <= 1.0):
            raise ValueError("'least_noise' and 'least_delay' must lie in [0, 1].")


@dataclass(frozen=True)
class Sensing:
    """What may be wrong with the sensors, beyond what the robot's YAML says: the odometry unless said otherwise."""

    noise: float = 1.0  # factor on the robot's own noise [-]
    bias: float = 1.0  # factor on the robot's own biases and errors of scale [-]
    # Largest delay beyond the robot's own. It counts in whole readings: in training half a control step is none [s].
    delay_s: float = 0.0
    dropout: float = 0.0  # largest chance that a measurement is lost [-]
    # Beside the noise of the robot's own sensors, and where these are perfect too; uniform, anew each time.
    velocity_noise: Range = (0.0, 0.0)  # largest error of each measured velocity, for a whole episode [m/s]
    yaw_rate_noise: Range = (0.0, 0.0)  # same for the turn rate [rad/s]
    gyroscope: float = 1.0  # factor on noise and walk of the inertial unit's gyroscope [-]
    # Time in an episode from which on the unit reports nothing; None: it lives on [s].
    gyroscope_dies_s: float | None = None
    least_delay: float = 0.0  # smallest `delay_s`, as a share of the largest [-]

    def __post_init__(self) -> None:
        if min(self.noise, self.bias, self.delay_s, self.dropout) < 0.0 or self.dropout > 1.0:
            raise ValueError("noise, bias, delay and dropout must not be negative, 'dropout' at most 1.")
        if not 0.0 <= self.least_delay <= 1.0:
            raise ValueError(f"'least_delay' = {self.least_delay:g} must lie in [0, 1].")
        if min(self.gyroscope, self.gyroscope_dies_s or 0.0) < 0.0:
            raise ValueError("gyroscope and gyroscope_dies_s must not be negative.")
        for low, high in (self.velocity_noise, self.yaw_rate_noise):
            if not 0.0 <= low <= high:
                raise ValueError(
                    "velocity_noise and yaw_rate_noise must be [low, high] with 0 <= low <= high."
                )

    @property
    def blurred(self) -> bool:
        """Whether measured velocities err beyond the robot's own sensors."""
        return max(*self.velocity_noise, *self.yaw_rate_noise) > 0.0
