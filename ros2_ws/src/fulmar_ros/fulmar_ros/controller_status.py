"""Status of a controller node on `controller/status` and `/diagnostics`."""

from __future__ import annotations

import time
from collections.abc import Mapping

from fulmar_core.estimators.actuator_health.beliefs import Beliefs
from fulmar_core.loop.guarded_loop import GuardedLoop
from fulmar_core.robots.wire_check import BETWEEN, WIRE_WARNINGS
from fulmar_core.safety.arbiter import Decision, Mode
from fulmar_core.safety.keep_out import ENTERED, HAD_ENTERED, HAD_HELD
from fulmar_ros.controller_swap import ControllerSwap
from fulmar_ros.deadline import Deadlines, Spread
from fulmar_ros.health import Health

PERIOD_S = 0.4  # at least 2 Hz


class ControllerStatus:
    """Status of a controller.

    Attributes:
        steps: Control steps so far.
        inference_ms: Time that the controller took to act.
        wire_problems: Publishers from which nothing arrives, in words.
        contested: Which nodes publish one input, where more than one does, in words.
        two_cameras: The same of images, which is a warning alone: a camera that died is started anew.
        goal_by: Which node gave the goal that counts, as far as that is known.
        inputs_refused: How many readings beside the odometry were refused, and why the newest of them was; empty if it
            was not.
    """

    def __init__(self, swap: ControllerSwap, identity: Mapping[str, str], *, goals_streamed: bool) -> None:
        """Report swaps of controllers and the values of `node_identity` too; streamed goals count as no change."""
        self._swap, self._identity, self._goals_streamed = swap, dict(identity), goals_streamed
        self.steps = 0
        self.inference_ms = Spread()
        self.wire_problems: list[str] = []
        self.contested = self.two_cameras = ""
        self.inputs_refused = 0, ""
        self.goal_by = ""
        self._said: tuple[object, ...] = ()
        self._said_at = 0.0

    def repeat(self) -> None:
        """Publish the next time whether or not anything changed."""
        self._said_at = 0.0

    def publish(
        self,
        health: Health,
        decision: Decision,
        guard: GuardedLoop,
        deadlines: Deadlines,
        *,
        beliefs: Beliefs,
    ) -> None:
        """Publish on `health`, on change and at least twice a second.

        `decision` is the arbiter's for now, `beliefs` are warnings about actuators.
        """
        mission, switch = guard.mission, guard.switch
        refusal = guard.refusal if guard.refusal.reason else guard.too_far
        held, apart, leaderless = guard.held, guard.kept_apart, guard.lost_leader
        hindered = leaderless or apart
        standby, last_input_ns = switch.current, guard.flags.last_input_ns
        changed = (
            decision.mode,
            decision.reason.split(" (")[0][:24],
            not self._goals_streamed and (mission.goal_stamp_ns, mission.goals_received),
            mission.obstacles_stamp_ns,
            refusal.stamp_ns,
            switch.rejections,
            standby.sha256,
            switch.fell_back,
            self._swap.said,
            *self.wire_problems,
            bool(self.inputs_refused[1]),
            beliefs.dead,
            beliefs.open,
            len(beliefs.words),
            guard.flags.unconverged,
            bool(held),
            apart,
            leaderless,
            guard.input_warning,
            self.contested,
            self.two_cameras,
            self._swap.requests,
            self.goal_by,
        )
        now = time.monotonic()
        if changed == self._said and now - self._said_at < PERIOD_S:
            return
        self._said, self._said_at = changed, now
        unconverged = guard.flags.unconverged
        level = {Mode.ACTIVE: "ok", Mode.FAULT: "error"}.get(decision.mode, "warn")
        level = "error" if unconverged or self.contested else level
        level = "error" if ENTERED in held else level
        doubtful = (
            switch.fell_back
            or held
            or hindered
            or self.wire_problems
            or beliefs.words
            or self.inputs_refused[1]
        )
        level = "warn" if level == "ok" and doubtful else level
        age_ms = (time.monotonic_ns() - last_input_ns) / 1e6 if last_input_ns else 0.0
        values = {
            **self._identity,
            "mode": decision.mode.value,
            "reason": decision.reason,
            "sha256": standby.sha256,
            "controller": standby.controller.name,
            "fell_back": switch.fell_back,
            "swap": self._swap.said,
            "believed_dead": ", ".join(beliefs.dead),
            "believed_open": ", ".join(beliefs.open),
            "beliefs": "; ".join(beliefs.words),
            "unconverged": unconverged,
            "keep_out": held,
            "keep_apart": apart,
            "formation": leaderless,
            "keep_apart_steps": str(guard.loop.keep_apart.interventions if guard.loop.keep_apart else 0),
            "swap_requests": str(self._swap.requests),
            "epoch": str(guard.epoch),
            "goal_stamp_ns": str(mission.goal_stamp_ns),
            "goal_by": self.goal_by,
            "obstacles_stamp_ns": str(mission.obstacles_stamp_ns),
            "goal_refused": refusal.reason,
            "goal_refused_stamp_ns": str(refusal.stamp_ns),
            "goals_received": str(mission.goals_received),
            "goals_done": str(mission.done),
            "goal_distance_m": f"{guard.flags.goal_distance:.3f}",
            "at_goal": str(guard.at_goal()).lower(),
            "inputs_refused": str(self.inputs_refused[0]),
            "last_input_refusal": self.inputs_refused[1],
            WIRE_WARNINGS: BETWEEN.join(self.wire_problems),
            "steps": str(self.steps),
            "observation_age_ms": f"{age_ms:.1f}",
            "control_rate_hz": f"{deadlines.rate_hz:.4f}",
            "overruns": str(deadlines.overruns),
            "rejections": str(switch.rejections),
            **self.inference_ms.percentiles("inference_ms"),
            **deadlines.period_error_ms.percentiles("period_error_ms"),
        }
        warnings = BETWEEN.join([*self.wire_problems, *beliefs.words])
        message = decision.reason or held or hindered or warnings or decision.mode.value
        entered = HAD_ENTERED if ENTERED in held else HAD_HELD if held else ""
        its = unconverged, entered, self.contested, self.two_cameras, guard.input_warning
        warned = [*beliefs.warnings, *(words for words in its if words)]
        health.publish(level, message, values, warnings=warned)
