"""The whole benchmark of FALCON-S: every task by every controller in every scenario, and ground effect over height."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fulmar_benchmarks.falcon.cells import RANDOM, SCENARIOS, FalconCell, falcon_cell
from fulmar_benchmarks.shape import Benchmark, Cell, Check, Figures, Found
from fulmar_benchmarks.tables import number
from fulmar_core.config.errors import ConfigError
from fulmar_core.dynamics.flight_trim import Trim, find_trim
from fulmar_core.robots.airframe.ground_effect import induced_drag_ratio, lift_ratio
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from policy_server.controllers import shipped_policy

HEIGHTS_M = (1.0, 2.5, 5.0, 10.0, 100.0)  # of thesis Table 5.2
THESIS_ENERGY = (0.303, 0.590, 0.689, 0.723, 0.743)  # same
HALF = 0.5  # of the thesis' RMSE, which exact state must stay below
WITH_SENSORS = {"a": 0.03, "d": 0.03, "e": 0.03}  # limits with sensors; elsewhere the thesis' own [m]
MPPI_LIMIT = {"a": 0.03, "d": 0.03, "e": 0.03}  # of MPPI with exact state [m]
# Scenarios that controllers fly where none are named; one that is left out flies them all.
USUAL = {**dict.fromkeys(("lqr", "pid"), ("exact", "calm", "light", "severe")), "mppi": ("exact",)}
DRAWN = "calm"  # scenario whose flights the report draws, where it is flown
SEEDS = 5  # of a controller that draws, with exact state
HOLD = "hold"  # the task whose flights begin at different heights
STEADY = (HOLD, "a", "d", "e", "f")  # tasks that must survive noise, delay and light turbulence
SURVIVAL = 0.95
# Of a policy that holds a height: altitude RMSE with the start and after 10 s [m], and survival, by scenario.
POLICY_LIMITS = {"calm": (0.12, 0.04, 0.99), "light": (0.20, None, 0.97)}


Flights = dict[str, dict[str, dict[str, Any]]]  # by task and controller, as in `cells.first_flight`


class Falcon(Benchmark):
    """Every task by every controller in every scenario, and ground effect over height."""

    name = "falcon"
    report = "fulmar_benchmarks.falcon.report:plots"
    width = 130

    @property
    def title(self) -> str:  # type: ignore[override]
        """Of its page."""
        return f"{self.choice.robot} over the water"

    def check(self) -> None:
        """Refuse what does not fly."""
        if load_robot(self.choice.robot).airframe is None:
            raise ConfigError(
                f"--robot = '{self.choice.robot}' is no aircraft; `fulmar list robots` names them."
            )

    def cells(self) -> list[FalconCell]:
        """What is flown, in its order; of policies only those that are shipped."""
        asked = self.choice
        return [
            falcon_cell(
                asked.robot, task, by, scenario, self._episodes(task, by, scenario), asked.seed, self._policy
            )
            for task in asked.tasks
            for by in asked.controllers
            for scenario in asked.scenarios or USUAL.get(by, tuple(SCENARIOS))
            if by != "policy" or self._policy or shipped_policy(asked.robot, f"fly_{task}") is not None
        ]

    @property
    def _policy(self) -> str:
        return str(self.choice.policy or "")

    def _episodes(self, task: str, controller: str, scenario: str) -> int:
        """Flights of a cell; with exact state those along a path of a controller that draws nothing are all alike."""
        if scenario != "exact" or task == HOLD:
            return int(self.choice.episodes)
        return min(self.choice.episodes, SEEDS) if controller in RANDOM else 1

    def document(self, found: Found) -> dict[str, Any]:
        """See `fulmar benchmark falcon --help`."""
        tasks: dict[str, Any] = {}
        for cell in self.cells():
            each = found[cell.name]
            figures = (
                {"error": each, "survival": None, "episodes": 0} if isinstance(each, str) else each["figures"]
            )
            tasks.setdefault(cell.task, {}).setdefault(cell.controller, {})[cell.scenario] = figures
        return {
            "robot": self.choice.robot,
            "seed": self.choice.seed,
            "episodes": self.choice.episodes,
            "tasks": tasks,
            "ground_effect": ground_effect(self.choice.robot),
        }

    def checks(self, document: Mapping[str, Any]) -> list[Check]:
        """Of what was flown."""
        return requirements(document)

    def tables(self, document: Mapping[str, Any]) -> list[str]:
        """Every figure beside the thesis', then what is required."""
        return [*lines(document), *self.check_lines(document)]

    def drawn(self, document: Mapping[str, Any], found: Found) -> tuple[Any, ...]:
        """Document and flights."""
        return document, self._flights(found)

    def _flights(self, found: Found) -> Flights:
        """A flight of each task by each controller, in calm if flown."""
        flights: Flights = {}
        for cell in self.cells():
            each = found[cell.name]
            if not isinstance(each, str) and (
                cell.scenario == DRAWN or cell.controller not in flights.get(cell.task, {})
            ):
                drawn = each["flight"] | {"scenario": cell.scenario}
                flights.setdefault(cell.task, {})[cell.controller] = drawn
        return flights

    def said(self, cell: Cell, figures: Figures) -> str:
        """The error of a cell."""
        one = figures["figures"]
        return f"RMSE per axis {number(one['rmse_per_axis_m'], 4, '-')} m, {one['survival']:.2f} alive"


def ground_effect(name: str) -> dict[str, Any]:
    """Trim over height beside thesis Table 5.2, and the ratios of thesis Fig. 5.1."""
    robot = load_robot(name)
    frame = robot.airframe
    assert frame is not None  # of an aircraft
    trims = [find_trim(robot, frame.speed, height) for height in HEIGHTS_M]
    over_span = np.geomspace(0.1, 3.0, 40)
    best = _least_energy(robot, frame.speed)
    return {
        "heights_m": list(HEIGHTS_M),
        "energy": [trim.throttle**2 for trim in trims],
        "thrust_n": [trim.thrust for trim in trims],
        "thesis_energy": list(THESIS_ENERGY),
        "energy_per_m": trims[0].throttle ** 2 / frame.speed,
        "least_energy_per_m": best.throttle**2 / best.speed,
        "least_energy_speed": best.speed,
        "height_over_span": over_span.tolist(),
        "lift_ratio": lift_ratio(over_span, frame.aspect_ratio, frame.taper).tolist(),
        "induced_drag_ratio": induced_drag_ratio(over_span, frame.aspect_ratio, frame.taper).tolist(),
    }


def _least_energy(robot: Robot, speed: float) -> Trim:
    """Trim at the first of `HEIGHTS_M`, near a speed [m/s], whose squared throttle over the speed is least."""
    trims = []
    for share in np.linspace(0.8, 1.2, 41):
        with contextlib.suppress(ConfigError):  # there is no level flight as slow as that
            trims.append(find_trim(robot, share * speed, HEIGHTS_M[0]))
    return min(trims, key=lambda trim: float(trim.throttle**2 / trim.speed))


def requirements(document: Mapping[str, Any]) -> list[Check]:
    """What is required of what was flown; a cell that could not be flown does not meet it."""
    found = []
    for task, controllers in document["tasks"].items():
        if task in MPPI_LIMIT and "exact" in controllers.get("mppi", {}):
            one = controllers["mppi"]["exact"]
            name = f"MPPI, ({task}), exact, {one['episodes']} seeds: largest RMSE per axis [m]"
            found.append(_most(name, one, "rmse_per_axis_worst_m", MPPI_LIMIT[task]))
        for scenario, one in controllers.get("lqi", {}).items():
            thesis = one.get("thesis", {}).get("rmse_per_axis_m")
            if thesis and scenario in ("exact", "calm"):
                limit = HALF * thesis if scenario == "exact" else WITH_SENSORS.get(task, thesis)
                found.append(
                    _most(f"LQI, ({task}), {scenario}: RMSE per axis [m]", one, "rmse_per_axis_m", limit)
                )
            if scenario in ("noise", "delay", "late", "light") and task in STEADY:
                found.append(_alive(f"LQI, {task}, {scenario}", one, SURVIVAL))
        for scenario, (whole, late, survival) in POLICY_LIMITS.items() if task == HOLD else ():
            if scenario not in controllers.get("policy", {}):
                continue
            one = controllers["policy"][scenario]
            about = f"policy, hold, {scenario}, {one['episodes']} flights"
            found.append(_alive(about, one, survival))
            found.append(_most(f"{about}: altitude RMSE [m]", one, "altitude_rmse_m", whole, lost=True))
            if late is not None:
                found.append(
                    _most(f"{about}: same after 10 s [m]", one, "late_altitude_rmse_m", late, lost=True)
                )
    return found


def _most(name: str, one: Mapping[str, Any], figure: str, limit: float, *, lost: bool = False) -> Check:
    """An error that must not be larger; unless some may be `lost`, every flight has to survive."""
    check = Check.most(name, one.get(figure), limit)
    return replace(check, met=bool(check.met) and (lost or one["survival"] == 1.0))


def _alive(about: str, one: Mapping[str, Any], least: float) -> Check:
    """Share of flights that must survive."""
    check = Check.least(f"{about}: survival", one["survival"], least)
    return replace(check, met=bool(check.met))


def lines(document: Mapping[str, Any]) -> list[str]:
    """Every figure beside the thesis', then what is required."""
    found = [
        f"{document['robot']}, seed {document['seed']}; RMSE per axis in m, of the thesis in brackets (*: crashed)",
        f"{'task':5} {'by':7} {'scenario':8} {'RMSE':>17} {'worst':>8} {'altitude':>8} {'peak':>7} {'settles':>8} "
        f"{'energy':>7} {'alive':>6} {'wall s':>7}",
    ]
    for task, controllers in document["tasks"].items():
        for controller, scenarios in controllers.items():
            for scenario, each in scenarios.items():
                if "error" in each:
                    found.append(f"{task:5} {controller:7} {scenario:8} {each['error']}")
                    continue
                thesis = each["thesis"].get("rmse_per_axis_m")
                crash = "*" if each["thesis"].get("crashed") else ""
                beside = f"({thesis:.3f}{crash})" if thesis is not None else ""
                found.append(
                    f"{task:5} {controller:7} {scenario:8} {number(each['rmse_per_axis_m'], 4, '-'):>8}{beside:>9} "
                    f"{number(each['rmse_per_axis_worst_m'], 4, '-'):>8} {number(each['altitude_rmse_m'], 4, '-'):>8} "
                    f"{number(each['peak_error_m'], 3, '-'):>7} {number(each['settling_s'], 2, '-'):>8} "
                    f"{number(each['energy'], 3, '-'):>7} {each['survival']:>6.2f} "
                    f"{number(each['wall_s'], 1, '-'):>7}"
                )
    ground = document["ground_effect"]
    found.append("mean squared throttle in level flight over height, and of the thesis (Table 5.2):")
    found += [
        f"  {height:g} m: {ours:.3f} ({theirs:.3f})"
        for height, ours, theirs in zip(
            ground["heights_m"], ground["energy"], ground["thesis_energy"], strict=True
        )
    ]
    found.append(
        f"energy, the mean squared throttle added up over time, per metre at {ground['heights_m'][0]:g} m [s/m]: "
        f"{1e3 * ground['energy_per_m']:.3f}e-3 in trim at the task's speed, at least "
        f"{1e3 * ground['least_energy_per_m']:.3f}e-3, at {ground['least_energy_speed']:.1f} m/s; flown:"
    )
    found += [
        f"  {by}, {scenario}: {1e3 * each['energy_per_m']:.3f}e-3"
        for by, scenarios in document["tasks"].get("hold", {}).items()
        for scenario, each in scenarios.items()
        if each.get("energy_per_m") is not None
    ]
    return found
