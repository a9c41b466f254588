"""Model-predictive path integral control of aircraft on the batched dynamics of the core.

G. Williams, A. Aldrich and E. Theodorou, "Model Predictive Path Integral Control: From Theory to Parallel Computation",
Journal of Guidance, Control, and Dynamics 40(2), 2017; thesis §5.5.2 has it for aircraft. Each plan is a sequence of
corrections to the commands of a law. Flights ahead follow the law under corrections that differ by noise; the next plan
is their mean, weighted by exp(-cost / temperature). With the LQR as the law (`feedback` 1) noise does not grow along
the unstable flight of a craft, and a hundred flights do; with `feedback` 0 the law is level flight, as in the thesis.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.flight_following import FlightFollowing
from fulmar_core.controllers.flight_lqi import FlightLqr, FlightWeights, flight_lqr_weights
from fulmar_core.controllers.flight_observer import ObserverNoise
from fulmar_core.controllers.flight_rollouts import FlightCost, FlightRollouts
from fulmar_core.robots.robot import Robot
from fulmar_core.states.spatial import SpatialState

LONGEST_STEP_S = 0.04  # of the flights ahead, which servos and roll are too fast for beyond [s]
SLOWEST_HZ = 20.0  # of plans


@dataclass(frozen=True)
class MppiSettings:
    """Settings, as read from `configs/controllers/<robot>_mppi.yaml`."""

    law: FlightWeights  # of the LQR that flights follow; with its smoothing of the reference, without its observer
    noise: tuple[float, ...]  # standard deviation of each command, as a share of its largest one [-]
    cost: FlightCost = field(default_factory=FlightCost)
    feedback: float = 1.0  # share of the LQR's answer that flights follow; 0: level flight alone [-]
    rollouts: int = 128  # flights of each plan in pairs of opposite noise; one more goes without any
    horizon_s: float = 1.2  # how far flights go [s]
    step_s: float = 0.04  # of them [s]
    plan_hz: float = 25.0  # plans a second of the robot's own time
    knot_s: float = 0.2  # between two corrections of a plan, with a straight line between them [s]
    temperature: float = 1.0  # cost by which a flight's weight falls to 1/e [-]
    seed: int = 0  # of the noise
    observer: ObserverNoise | None = None  # as in `FlightWeights`

    def __post_init__(self) -> None:
        if self.rollouts < 2 or self.rollouts % 2:
            raise ValueError(f"rollouts = {self.rollouts} must be an even number of 2 or more.")
        if not 0.0 < self.step_s <= LONGEST_STEP_S:
            raise ValueError(
                f"step_s = {self.step_s:g} must be greater than 0, and at most {LONGEST_STEP_S:g} s."
            )
        if self.plan_hz < SLOWEST_HZ:
            raise ValueError(f"plan_hz = {self.plan_hz:g} must be at least {SLOWEST_HZ:g}.")
        if not self.step_s <= self.knot_s <= self.horizon_s:
            raise ValueError("it takes step_s <= knot_s <= horizon_s.")
        if self.temperature <= 0.0 or min(self.noise, default=0.0) <= 0.0:
            raise ValueError("temperature and every noise must be greater than 0.")
        if not 0.0 <= self.feedback <= 1.0:
            raise ValueError(f"feedback = {self.feedback:g} must lie in [0, 1].")
        if self.seed < 0:
            raise ValueError(f"seed = {self.seed} must not be negative.")


class FlightMppi(FlightFollowing):
    """Model-predictive path integral control of an aircraft; its one seed lets each craft fly as it would alone."""

    law = "mppi"
    title = "MPPI of aircraft"

    gains: MppiSettings

    def bind(self) -> None:
        """See `Law.bind`."""
        settings = self.gains
        self.follow(smooth_s=settings.law.smooth_s, observer=settings.observer)
        if len(settings.noise) != len(self._craft.names):
            raise ValueError(
                f"'noise' needs {len(self._craft.names)} numbers: {', '.join(self._craft.names)}."
            )
        self._every = max(1, int(1.0 / (settings.plan_hz * self._dt) + 1e-9))
        self._steps = max(1, round(settings.horizon_s / settings.step_s))
        self._knots = 1 + round(settings.horizon_s / settings.knot_s)
        self._sigma = np.array(settings.noise) * self._craft.scale
        self.seeds = (settings.seed,)
        weights = replace(settings.law, height_integral=0.0, side_integral=0.0, observer=None)
        self._law = FlightLqr(self.robot, self.task, weights, control_hz=self.control_hz)

    def prepare(self) -> None:
        """Lay out the plans."""
        settings = self.gains
        self._rollouts = FlightRollouts(
            self.robot, self._law, settings.cost, step_s=settings.step_s, share=settings.feedback
        )
        self._times = settings.step_s * np.arange(self._steps + 1)
        self._in_steps = self._between(self._times[:-1] + 0.5 * settings.step_s)
        later = settings.knot_s * np.arange(self._knots) + self._every * self._dt
        self._later = self._between(later)
        if settings.feedback:  # beyond the end the law alone is a good plan
            self._later[later > later[-1] - self._every * self._dt + 1e-9] = 0.0

    def _between(self, times: np.ndarray) -> np.ndarray:
        """Shares of the knots at some times, with the last one held after it, shape (times, knots)."""
        place = np.clip(times / self.gains.knot_s, 0.0, self._knots - 1.0)
        return np.asarray(np.maximum(0.0, 1.0 - np.abs(place[:, None] - np.arange(self._knots))))

    def reset(self) -> None:
        """Forget the past; the noise begins anew."""
        super().reset()
        self._law.reset()
        self._plan: np.ndarray | None = None

    def command(self, inputs: Inputs) -> np.ndarray:
        """Choose commands; shapes as in `Controller.act`."""
        aim, state = self.see(inputs)
        servos = self._law.servos_after(inputs)
        count = len(servos)
        if self._plan is None or len(self._plan) != count:
            self._plan = np.zeros((count, self._knots, len(self._sigma)))
            self._since = 0
            self._draws = [np.random.default_rng(seed) for seed in self.seeds]
        phase = self._since % self._every
        if phase == 0:
            if self._since:
                self._plan = np.einsum("jk,nkm->njm", self._later, self._plan)
            self._plan = self._improved(self._plan, state, servos, inputs)
        self._since += 1
        shares = self._between(np.array([(phase + 0.5) * self._dt]))[0]
        wanted = self._law.answers(state, aim, servos, share=self.gains.feedback)
        return np.asarray(wanted + shares @ self._plan)

    def _improved(
        self, plan: np.ndarray, state: SpatialState, servos: np.ndarray, inputs: Inputs
    ) -> np.ndarray:
        """The plan after one more look ahead, shape (n, knots, m)."""
        noise = self._noise(len(plan))
        corrections = np.einsum("tj,nkjm->tnkm", self._in_steps, plan[:, None] + noise)
        cost = self._rollouts.fly(
            state, servos, self._reference.ahead(inputs, self._times.tolist()), corrections
        )
        heat = self.gains.temperature
        # What the noise costs against the law's own commands (Williams et al., eq. 38).
        cost = cost + heat * np.einsum("njm,nkjm->nk", plan / self._sigma**2, noise)
        weight = np.exp((cost.min(axis=1, keepdims=True) - cost) / heat)
        weight /= weight.sum(axis=1, keepdims=True)
        return np.asarray(plan + np.einsum("nk,nkjm->njm", weight, noise))

    def _noise(self, count: int) -> np.ndarray:
        """Noise of the knots: none, then pairs of opposite sign, shape (n, 1 + rollouts, knots, m)."""
        shape = self.gains.rollouts // 2, self._knots, len(self._sigma)
        drawn = np.stack([draws.standard_normal(shape) for draws in self._draws])
        noise = self._sigma * np.concatenate((np.zeros_like(drawn[:, :1]), drawn, -drawn), axis=1)
        return np.asarray(noise[np.arange(count) % len(noise)])

    def derived(self) -> dict[str, Any]:
        """What else the commands depend on."""
        return super().derived() | {"seeds": list(self.seeds)}


def mppi_settings(robot: Robot) -> MppiSettings:
    """Settings of an aircraft without a file."""
    craft, law = robot.actuators, flight_lqr_weights(robot)
    surfaces = craft.positions
    noise = (0.02,) * surfaces + (0.05,) * (len(craft.names) - surfaces)
    return MppiSettings(
        law=replace(law, observer=None),
        noise=noise,
        observer=law.observer,
    )
