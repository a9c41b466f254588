"""Last check before the actuators: publisher, names, values, limits, slew, watchdog and e-stop in one place."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from fulmar_core.robots.actuators.family import Actuators
from fulmar_core.robots.actuators.refuge import Refuge
from fulmar_core.safety.command_end import CommandEnd
from fulmar_core.safety.command_gate import OneWriter, command_problem, name_problem
from fulmar_core.safety.estop import EstopMonitor
from fulmar_core.safety.watchdog import Watchdog
from fulmar_core.states.state import RigidBodyState

LAST_WORDS_NS = 200_000_000  # so long after a person gave back, safe commands by hand may be under way
# A wing that follows its last command for as long as a watchdog waits may be in the water by then. Its safe controller
# bridges a shorter silence, which is no trip, and gives back with the next command.
BRIDGED_S, BRIDGED_PERIODS = 0.05, 2.5
LEFTOVERS_NS = 2_000_000_000  # so long after the last command, an older one may come out of a queue


class ActuatorGuard:
    """Holds the newest acceptable command for as long as the watchdog and the e-stop let it.

    A person's command takes the actuators from the controller, and keeps them, also in silence, until the person gives
    them back. Not thread-safe; the caller holds a lock.

    Attributes:
        command: The newest that was taken, whatever watchdog and e-stop say.
        rejected: How many commands could not be carried out.
        last_rejection: Why not the last of them.
        person: Whether a person has the actuators.
        publishers: Which nodes publish the controller's commands; of two none is obeyed.
        refuge: Safe controller.
        doing: What a safe controller that steers does now, in words; empty while it does not act.
        held: Why a device that did not carry out commands is held safe; empty while it is not.
    """

    def __init__(
        self,
        actuators: Actuators,
        watchdog: Watchdog,
        *,
        estop: EstopMonitor | None = None,
        control_dt: float = 0.0,
        period_s: float | None = None,
        lockstep: bool = False,
        refuge: Refuge | None = None,
        wall_ns: Callable[[], int] | None = None,
    ) -> None:
        """Begin with the safe command.

        Args:
            actuators: What they can take, and how fast they may follow.
            watchdog: Ends a command that nobody repeats.
            estop: Ends any command; none by default.
            control_dt: Time between commands: what they may differ by follows from it; 0 for no such limit [s].
            period_s: The same by the steady clock, which silences are measured by; `control_dt` by default [s].
            lockstep: Time stands still between commands, so nothing slows down while one is waited for.
            refuge: Safe controller; that of the actuators by default.
            wall_ns: Steady clock of the e-stop and of `publishers`, where commands go by another one, as where a
                link loses some in lock step [ns].
        """
        self._actuators, self.watchdog = actuators, watchdog
        self.estop = estop or EstopMonitor(required=False)
        self.publishers = OneWriter()
        self._control_dt, self._lockstep, self._wall_ns = control_dt, lockstep, wall_ns
        self.refuge = refuge or actuators.refuge
        self._steers = math.isinf(self.refuge.longest_s)
        period_s = control_dt if period_s is None else period_s
        self._bridge_ns = round(1e9 * max(BRIDGED_S, BRIDGED_PERIODS * period_s))
        self.rejected = 0
        self.last_rejection = ""
        self._given_back_ns: int | None = None
        self.reset()

    def reset(self) -> None:
        """Forget the command: a plant that starts again begins with the safe one, and with the controller."""
        self.command = self._actuators.safe_command
        self._applied_last = self.command  # newest command that was; what comes under a stop is not
        self._safe_since_ns: int | None = None  # since when the safe controller has acted
        self.person = False
        self.held = self._refusal = ""
        self._stamp_ns = 0
        self._stopped_ns: int | None = None
        self._taken_ns: int | None = None
        self._asked_ns: int | None = (
            None  # since when the controller of what cannot stop commands what is safe
        )
        self.failed = ""
        self._stuck: tuple[str, float] | None = None
        self._steering_ns: int | None = None  # by the plant's clock, since when the safe controller steers
        self._handed_over_ns: int | None = None  # since when the safe controller has the actuators for good
        self.watchdog.reset()

    def begin_with(self, command: np.ndarray | None) -> None:
        """Take what simulated actuators do when an episode begins for the last command, where none came yet, (n,)."""
        if self._taken_ns is None and command is not None:
            self.command = self._applied_last = np.asarray(command, dtype=float)

    @property
    def doing(self) -> str:
        """See the class."""
        return self.refuge.doing if self._steering_ns is not None else ""

    @property
    def is_safe(self) -> bool:
        """Whether the safe state is applied in the place of what the controller commands, whatever the reason."""
        return self._safe_since_ns is not None or self._stopped_ns is not None or self.handed_over

    @property
    def handed_over(self) -> bool:
        """Whether the safe controller has the actuators for good."""
        return self._handed_over_ns is not None

    def hand_over(self, now_ns: int) -> None:
        """Give the actuators to the safe controller until `reset`, whatever is commanded.

        The plant is about to end, or a part has failed.
        From then on no command is due, so that no silence counts as a trip. `now_ns` is by the steady clock [ns].
        """
        if self._handed_over_ns is None:
            self._handed_over_ns = now_ns

    def fail(self, words: str, now_ns: int, stuck: tuple[str, float] | None = None) -> None:
        """Hand over to the safe controller until the next reset, for a part that has failed.

        Args:
            words: What failed.
            now_ns: Steady clock [ns].
            stuck: Its name and where it stands, if it does.
        """
        if not self.failed:
            self.failed, self._stuck = words, stuck
        self.hand_over(now_ns)

    def offer(
        self,
        names: Sequence[str],
        values: Sequence[float],
        now_ns: int,
        *,
        stamp_ns: int | None = None,
        outdated: bool = False,
        plant_ns: int | None = None,
    ) -> bool:
        """Take a controller's command if it can be carried out and no person has the actuators.

        A refused command does not feed the watchdog: a controller that sends nothing but nonsense, or what it should
        have said long ago, counts as silent. The safe command is taken however old the observation is.

        Args:
            names: Actuator names as sent.
            values: Values as sent.
            now_ns: Steady clock [ns].
            stamp_ns: Stamp of the observation that it answers; None or 0 where the sender sets none [ns].
            outdated: Whether that observation is known to be older than the watchdog.
            plant_ns: Time of a simulated plant, by which actuators follow; `now_ns` by default [ns].

        Returns:
            Whether it was taken.
        """
        if self.person:
            return False
        if self.watchdog.silent_ns(now_ns) > LEFTOVERS_NS:
            self._stamp_ns = 0  # one stray stamp from the future must not lock everybody out for good
        outdated = outdated and not self._is_safe(values)  # it comes late where a sensor fell silent
        if not self._check(names, values, self._stamp_problem(stamp_ns or 0, outdated=outdated)):
            return False
        answers_anew = bool(stamp_ns) and (stamp_ns or 0) > self._stamp_ns
        self._take(values, now_ns, plant_ns, self._control_dt if answers_anew else None)
        self._stamp_ns = stamp_ns or self._stamp_ns
        return True

    def offer_by_hand(
        self,
        names: Sequence[str],
        values: Sequence[float],
        now_ns: int,
        *,
        plant_ns: int | None = None,
    ) -> bool:
        """Take a person's command if it can be carried out, and the actuators with it; arguments as in `offer`."""
        if not self._check(names, values, None):
            return False
        if not self.person:
            if self._is_last_word(values, now_ns):
                return False
            self.person = True
            self.command = self._actuators.safe_command  # what the controller wanted is over
        self._take(values, now_ns, plant_ns, None)
        return True

    def see_refusal(self, refusal: str) -> None:
        """Take what a device says of the last command: why it did not carry it out, empty where it did.

        One that refused is in other hands, or has a fault: it is held safe until a person gives control back, since a
        robot must not start by itself when it obeys again.
        """
        self._refusal = refusal
        self.held = refusal or self.held

    def give_back(self, now_ns: int) -> str:
        """Give the actuators back to the controller.

        Args:
            now_ns: Steady clock [ns].

        Returns:
            Why the person keeps them; empty if they are given back.
        """
        if self._refusal:
            return f"refused: {self._refusal}"
        if not self.person and not self.held:
            return "nobody has taken the actuators"
        if np.any(self.output(now_ns) != self._actuators.safe_command):
            return "refused: the last command by hand still moves the robot. Let go first."
        self.reset()
        self._given_back_ns = now_ns
        return ""

    def output(
        self, now_ns: int, state: RigidBodyState | None = None, *, plant_ns: int | None = None
    ) -> np.ndarray:
        """What to apply at this time of the steady clock.

        After a silence and under the e-stop that is the family's own safe controller (`actuators/refuge.py`): valves
        close at once, wheels slow down as fast as they may. What cannot stop flies by it also where its controller
        commands what is safe, and after a silence of `BRIDGED_S` already.

        Args:
            now_ns: Steady clock [ns].
            state: Newest measured state, for families whose safe controller steers; None without one.
            plant_ns: Time of the plant, by which a safe controller steers; `now_ns` by default [ns].
        """
        return self._applied(self._ended_ns(now_ns), now_ns, state, plant_ns)

    def answer(
        self, now_ns: int, state: RigidBodyState | None = None, *, plant_ns: int | None = None
    ) -> np.ndarray:
        """What to apply in lock step, where time stands still between commands and only the e-stop may end one.

        What cannot stop flies on by its safe controller, for which `state` is the newest one; as in `output`.
        """
        since_ns = self._ended_by_decision(now_ns)
        if since_ns is None or self._steers:
            return self._applied(since_ns, now_ns, state, plant_ns)
        return self._actuators.safe_command

    def _applied(
        self, since_ns: int | None, now_ns: int, state: RigidBodyState | None, plant_ns: int | None
    ) -> np.ndarray:
        """The command, or that of the safe controller where the command has ended [ns]."""
        if since_ns is None:
            self._steering_ns = self._safe_since_ns = None
            self._applied_last = self.command
            return self.command
        # A stop that follows a silence, with commands between them, must not begin the way to rest anew.
        if self._safe_since_ns is None or since_ns < self._safe_since_ns:
            self._safe_since_ns = since_ns
        since_s = max(0, now_ns - self._safe_since_ns) / 1e9
        if self._steers:
            self.refuge.stuck = self._stuck
        if self._steers and plant_ns is not None:
            if self._steering_ns is None:
                self._steering_ns = plant_ns
            since_s = (plant_ns - self._steering_ns) / 1e9
        return self.refuge.command(since_s, self._applied_last, state)

    def end(self, now_ns: int) -> CommandEnd:
        """Why the controller's commands are not applied at this time of the steady clock [ns]."""
        if self._ended_by_decision(now_ns) is not None:
            return CommandEnd.STOPPED
        if self._taken_ns is None:
            return CommandEnd.WAITING
        return CommandEnd.NONE if self._ended_ns(now_ns) is None else CommandEnd.SILENT

    def _ended_by_decision(self, now_ns: int) -> int | None:
        """Since when the plant's end, the e-stop, a second publisher or the controller has ended the command [ns]."""
        ends = [self._handed_over_ns, self._stopped(now_ns), self._asked_ns]
        return min((end for end in ends if end is not None), default=None)

    def _ended_ns(self, now_ns: int) -> int | None:
        """When the command came to its end; None if it holds."""
        if self._handed_over_ns is not None:
            return self._handed_over_ns
        ends = [self._ended_by_decision(now_ns)]
        if self.watchdog.expired(now_ns):
            ends.append(now_ns - self.watchdog.silent_ns(now_ns) + self.watchdog.timeout_ns)
        if self._steers and self.watchdog.silent_ns(now_ns) > self._bridge_ns:
            ends.append(now_ns - self.watchdog.silent_ns(now_ns) + self._bridge_ns)
        return min((end for end in ends if end is not None), default=None)

    def _stopped(self, now_ns: int) -> int | None:
        """Since when the e-stop, a second publisher or the device's refusal holds the robot; None if none does."""
        seen_ns = now_ns if self._wall_ns is None else self._wall_ns()
        contested = not self.person and self.publishers.reason(seen_ns)
        if not self.estop.reason(seen_ns) and not contested and not self.held:
            if self._stopped_ns is not None and not self._steers:
                self.command = self._slowed(
                    self._stopped_ns, now_ns
                )  # never back to the command before the stop
            self._stopped_ns = None
        elif self._stopped_ns is None:
            self._stopped_ns = now_ns
        return self._stopped_ns

    def _slowed(self, since_ns: int, now_ns: int) -> np.ndarray:
        """Where a stop has brought the actuators by now, one that began at `since_ns` or within another one [ns]."""
        if self._lockstep:
            return self._actuators.safe_command
        if self._safe_since_ns is not None:
            since_ns = min(since_ns, self._safe_since_ns)
        return self.refuge.command(max(0, now_ns - since_ns) / 1e9, self._applied_last, None)

    def _is_last_word(self, values: Sequence[float], now_ns: int) -> bool:
        """Whether a person who has just given back would take the actuators with a safe command that came late."""
        if self._given_back_ns is None or now_ns - self._given_back_ns > LAST_WORDS_NS:
            return False
        return self._is_safe(values)

    def _is_safe(self, values: Sequence[float] | np.ndarray) -> bool:
        safe = self._actuators.safe_command
        return len(values) == len(safe) and bool(np.all(np.asarray(values, dtype=float) == safe))

    def _check(self, names: Sequence[str], values: Sequence[float], problem: str | None) -> bool:
        count = len(self._actuators.names)
        if len(values) > count:  # before anything is made of what may be millions
            problem = f"command has {len(values)} values, must have {count}"
        else:
            command = np.asarray(values, dtype=float)
            problem = (
                name_problem(names, self._actuators.names) or command_problem(command, (count,)) or problem
            )
        if problem:
            self.rejected += 1
            self.last_rejection = problem
        return not problem

    def _take(
        self, values: Sequence[float], now_ns: int, plant_ns: int | None, seconds: float | None
    ) -> None:
        """Take a good command; `seconds` is the time it has had to change in, None for that since the last one."""
        time_ns = now_ns if plant_ns is None else plant_ns
        if self._stopped(now_ns) is not None:
            if self._steers:
                # What goes on after the stop.
                self.command = self._actuators.limited(np.asarray(values, dtype=float))
            elif self._is_safe(self.output(now_ns)):
                self.command = self._actuators.safe_command  # nothing is left to slow down from
        else:
            if not (self._lockstep or self._steers) and self.watchdog.expired(now_ns):
                self.command = self.output(now_ns)  # where wheels have slowed down to
            self.command = self._slewed(np.asarray(values, dtype=float), time_ns, seconds)
        if not (self._steers and self._is_safe(values)):
            self._asked_ns = None
        elif self._asked_ns is None:
            self._asked_ns = now_ns
        self._taken_ns = time_ns
        self.watchdog.feed(now_ns)

    def _slewed(self, values: np.ndarray, time_ns: int, seconds: float | None) -> np.ndarray:
        """Within the limits, and no further from the command before than actuators follow."""
        wanted: np.ndarray = self._actuators.limited(values)
        slew = self._actuators.response.slew
        if not slew or not self._control_dt:
            return wanted
        if seconds is None:
            since_s = self._control_dt if self._taken_ns is None else (time_ns - self._taken_ns) / 1e9
            seconds = max(0.0, min(self._control_dt, since_s))
        most = seconds * np.asarray(slew) * (1.0 + 1e-9)
        # Who keeps to the limit already gets the very command, to the last bit.
        within = np.abs(wanted - self.command) <= most
        near: np.ndarray = np.where(
            within, wanted, self.command + np.clip(wanted - self.command, -most, most)
        )
        return near

    def _stamp_problem(self, stamp_ns: int, *, outdated: bool) -> str | None:
        if outdated and not self._lockstep:
            limit_ms = self.watchdog.timeout_ns / 1e6
            return f"command answers an observation older than the watchdog's {limit_ms:.0f} ms"
        if stamp_ns and stamp_ns < self._stamp_ns:
            return f"command answers an observation {(self._stamp_ns - stamp_ns) / 1e6:.0f} ms older than the last"
        return None
