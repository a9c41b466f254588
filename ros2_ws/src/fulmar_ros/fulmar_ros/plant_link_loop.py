"""Lock step over a simulated radio link: the controller answers each odometry that arrives, and the plant moves on.

Time moves on by ticks. At each one the plant publishes what arrives at the controller, and waits until it is answered;
then the command that arrives at the plant counts from this tick on. So a run of one seed gives the same bytes, and the
watchdog trips by the plant's clock where commands fail to come.
"""

from __future__ import annotations

import threading
import time

import numpy as np

from fulmar_core.config.errors import LockstepError
from fulmar_core.simulation.backend import Sample
from fulmar_ros.plant_loops import RESEND_S, LockstepLoop, OnStep


class LinkLoop(LockstepLoop):
    """Steps a backend tick by tick; odometry leaves with each control step."""

    def run(
        self, sample: Sample, steps: int | None, stop: threading.Event, on_step: OnStep | None = None
    ) -> None:
        """As in `LockstepLoop`."""
        self._stop = stop
        super().run(sample, steps, stop, on_step)

    def _exchange(self, sample: Sample, stop: threading.Event) -> np.ndarray | None:
        """Send the readings of a control step; what counts at its first tick."""
        self._grounded = self._update_bearing()
        self._sample, self._commanded = sample, False
        self._wires.publish_sample(sample, self._clock.now_ns)
        command = self._tick()
        return None if stop.is_set() else command

    def _step(self, command: np.ndarray) -> Sample:
        dt, sample = self._backend.robot.timing.physics_dt, self._sample
        for tick in range(self._substeps):
            if tick:
                self._sample = sample
                command = self._tick(command)
            sample = self._backend.step(command, begins=0 if tick else self._substeps)
            self._compare(command, dt, sample)
            self._clock.advance(dt)
        return sample

    def _tick(self, before: np.ndarray | None = None) -> np.ndarray:
        """Let arrive what arrives now; returns what to apply, and publishes it where it is another than `before`."""
        now_ns, wires = self._clock.now_ns, self._wires
        for sample, stamp in wires.arrived_readings():
            self._answer(sample, stamp)
        with wires.lock:
            answers = wires.commands.answers
            wires.commands.take_arrived()
            self._commanded = self._commanded or wires.commands.answers > answers
            command = self._guard.output(wires.commands.steady_ns, self._sample.odometry, plant_ns=now_ns)
        if self._grounded:
            command = self._backend.robot.actuators.safe_command
        if before is None or not np.array_equal(command, before):
            wires.publish_applied(command, now_ns)
        return command

    def _answer(self, sample: Sample, stamp: int) -> None:
        """Publish readings that have arrived at the controller, and wait until its command is on its way back.

        Raises:
            LockstepError: It does not come in time.
        """
        wires, began = self._wires, time.monotonic()
        before = wires.commands.answered_ns
        wires.commands.await_answer(stamp)
        wires.publish_measured(sample, stamp)
        with wires.lock:
            while not wires.commands.wait_for_answer(stamp, RESEND_S):
                waited = time.monotonic() - began
                if self._stop.is_set():
                    return
                if waited > self._answer_timeout_s:
                    raise LockstepError(
                        f"no command answers the odom of t = {stamp / 1e9:.2f} s for {waited:.1f} s "
                        f"(limit {self._answer_timeout_s:g} s): {self._why_unanswered(before)} Look at its output."
                    )
                # The first messages can get lost while endpoints still find each other: those of every sensor count.
                wires.repeat_sample(sample, stamp, whole=before is None)
