"""The same flights in the core's batch, through ROS nodes in lock step, and through nodes in real time."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from fulmar_bags.run_record import read_run
from fulmar_benchmarks.pairs import policy_hash
from fulmar_benchmarks.shape import (
    ALONE,
    POOL,
    ROS,
    Benchmark,
    Cell,
    Check,
    Choice,
    Figures,
    Found,
    Progress,
    known,
)
from fulmar_benchmarks.tables import number
from fulmar_bringup.completion import completed
from fulmar_bringup.domains import own_domain
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.run_executor import execute
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.flight_figures import flight_figures
from fulmar_core.simulation.metrics import join
from fulmar_core.tasks import load_task
from fulmar_evaluation.evaluation import Trial, runs_of
from fulmar_evaluation.run_evaluation import evaluate_run
from fulmar_evaluation.run_summary import summarise
from fulmar_evaluation.trial_plan import plan_trial
from policy_server.controllers import usual_hz

ALTITUDE = "altitude_rmse_m"
APART_M = 0.02  # figures through nodes may differ so much from those of the batch
PERIOD_MS = 3.0  # limit of the 99th percentile of the control period's error, in real time
SHOWN = (ALTITUDE, "late_altitude_rmse_m", "rmse_per_axis_m", "peak_error_m", "survival")


@dataclass(frozen=True, kw_only=True)
class LiveCell(Cell):
    """The same flights in one way."""

    modules = (f"{__package__}.cells",)
    trial: Trial
    way_of_flying: str  # batch, lockstep, or realtime: one flight, with its twin in the batch

    def parts(self) -> dict[str, Any]:
        """A bundle counts by what is in it."""
        plan = self.trial.plan
        policy = policy_hash(plan.robot, plan.task, plan.controller, plan.policy)
        return {"plan": asdict(replace(plan, policy=policy)), "episodes": self.trial.episodes}

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """Figures of the way; of a flight in real time those of its twin, too."""
        if self.way_of_flying == "lockstep":
            return _flown(self.trial, progress, pool)
        batch = _flown(replace(self.trial, through="batch"))
        return batch if self.way_of_flying == "batch" else {**_by_the_clock(self.trial), "batch": batch}


class LiveFlights(Benchmark):
    """Flights in the batch, through nodes in lock step, and in real time."""

    name = "flights"
    title = "Flights through nodes beside the batch"

    def __init__(self, choice: Choice) -> None:
        """Plan the flights in lock step.

        Raises:
            ConfigError: There is no such robot, task or controller, or one does not fit.
        """
        super().__init__(choice)
        hz = choice.control_hz or usual_hz(
            choice.controller, load_robot(choice.robot), load_task(choice.task), choice.policy
        )
        self._trial = plan_trial(
            robot=choice.robot, task=choice.task, controller=choice.controller, policy=choice.policy, through="ros",
            episodes=choice.episodes, seed=choice.seed, scenario=choice.scenario, control_hz=hz, jobs=choice.jobs,
            episode_s=choice.episode_s, steps=None, worlds=None, bounds=None,
        )  # fmt: skip

    def cells(self) -> list[LiveCell]:
        """Batch, lock step, and each flight in real time."""
        plan, seeds = self._trial.plan, range(self.choice.seed, self.choice.seed + self.choice.real_time)
        ones = [replace(self._trial, episodes=1, plan=replace(plan, seed=seed)) for seed in seeds]
        every = [(self._trial, "batch"), (self._trial, "lockstep"), *((one, "realtime") for one in ones)]
        return [
            LiveCell(
                name=f"{plan.robot}_{plan.task}_{plan.controller}_{way}"
                + (f"_{trial.plan.seed}" if way == "realtime" else ""),
                cost=trial.episodes * plan.duration_s * plan.control_hz * (0.01 if way == "batch" else 1.0),
                where={"batch": POOL, "lockstep": ROS, "realtime": ALONE}[way],
                way="batch" if way == "batch" else "ros",
                trial=trial,
                way_of_flying=way,
            )
            for trial, way in every
        ]

    def document(self, found: Found) -> dict[str, Any]:
        """Figures by way."""
        batch, lockstep, *ones = self.cells()
        plan = self._trial.plan
        clock = [{"seed": one.trial.plan.seed, **_or_error(found[one.name])} for one in ones]
        figures = known(found, batch.name), known(found, lockstep.name)
        required = requirements(*figures, clock)
        return {
            **{
                key: getattr(plan, key)
                for key in ("robot", "task", "controller", "control_hz", "scenario", "seed")
            },
            "episode_s": plan.duration_s,
            "episodes": self._trial.episodes,
            "batch": figures[0],
            "lockstep": figures[1],
            "realtime": clock,
            "required": required,
            "passed": all(row["passed"] for row in required),
        }

    def checks(self, document: Mapping[str, Any]) -> list[Check]:
        """What is required of figures through nodes."""
        return [
            Check(row["what"], row["value"], row["limit"], row["passed"], "less")
            for row in document["required"]
        ]

    def tables(self, document: Mapping[str, Any]) -> list[str]:
        """Figures of every way, and what is required."""
        return [*lines(document), *self.check_lines(document)]

    def said(self, cell: Cell, figures: Figures) -> str:
        """Its altitude."""
        return f"altitude RMSE {number(figures[ALTITUDE], 4, '-')} m"


def _flown(trial: Trial, progress: Progress = lambda steps: None, pool: Any = None) -> Figures:
    runs = join(list(runs_of(trial, progress, pool=pool)))
    found = flight_figures(runs, trial.plan.task.removeprefix("fly_"), trial.robot)
    return {name: found[name] for name in SHOWN}


def _or_error(figures: Figures | str) -> dict[str, Any]:
    """Figures of a flight in real time; of one that failed `error`, which keeps what others have flown."""
    if not isinstance(figures, str):
        return figures
    lost = {**dict.fromkeys(SHOWN), "survival": 0.0, "period_error_ms": {"p99": None}}
    return {**lost, "error": figures, "batch": dict.fromkeys(SHOWN)}


def _by_the_clock(trial: Trial) -> Figures:
    """One flight in real time, as `fulmar run` does it, with its bag."""
    plan = trial.plan
    with tempfile.TemporaryDirectory(prefix="fulmar_", ignore_cleanup_errors=True) as folder, own_domain():
        asked = replace(
            plan,
            start=(),
            lockstep=False,
            record=str(Path(folder) / "bag"),
            command="fulmar benchmark flights",
        )
        asked = checked(completed(asked))
        execution = execute(asked)
        record = read_run(Path(asked.record))
        result, summary = evaluate_run(record), summarise(record)
    if execution.failure or result is None:
        raise RunFailed(f"flight of seed {plan.seed}: {execution.failure or 'nothing of it was recorded'}")
    found = flight_figures(result.run, plan.task.removeprefix("fly_"), trial.robot)
    return {
        **{name: found[name] for name in SHOWN},
        "period_error_ms": summary["period_error_ms"],
        "latency_ms": summary["latency_ms"],
        "overruns": summary["overruns"],
        "watchdog_trips": summary["watchdog_trips"],
    }


def requirements(
    batch: dict[str, Any], lockstep: dict[str, Any], clock: list[dict[str, Any]]
) -> list[dict[str, Any]]:
    """What is required of figures through nodes, and whether it is met."""

    def line(what: str, value: float | None, limit: float) -> dict[str, Any]:
        return {
            "what": what,
            "value": value,
            "limit": limit,
            "passed": value is not None and value <= limit,
        }

    def apart(found: dict[str, Any], beside: dict[str, Any]) -> float | None:
        pair = found[ALTITUDE], beside[ALTITUDE]
        return None if None in pair else abs(pair[0] - pair[1])

    rows = [line("altitude RMSE in lock step, off the batch's [m]", apart(lockstep, batch), APART_M)]
    for each in clock:
        name = f"real time, seed {each['seed']}"
        rows.append(
            line(f"{name}: altitude RMSE off that in the batch [m]", apart(each, each["batch"]), APART_M)
        )
        rows.append(line(f"{name}: period error, p99 [ms]", each["period_error_ms"]["p99"], PERIOD_MS))
    return rows


def lines(document: Mapping[str, Any]) -> list[str]:
    """Figures of every way."""
    ways = [("batch", document["batch"]), ("lock step", document["lockstep"])]
    ways += [(f"real time, seed {each['seed']}", each) for each in document["realtime"]]
    found = [
        f"{document['robot']}, {document['task']} by {document['controller']} at {document['control_hz']:g} Hz, "
        f"{document['episode_s']:g} s, {document['scenario']}, seed {document['seed']}",
        f"{'':24} {'altitude RMSE':>14} {'after 10 s':>11} {'peak':>7} {'alive':>6} {'period p99':>11}",
    ]
    for name, each in ways:
        period = each.get("period_error_ms", {}).get("p99")
        figures = [number(each[key], 4, "-") for key in (ALTITUDE, "late_altitude_rmse_m", "peak_error_m")]
        found.append(
            f"{name:24} {figures[0]:>12} m {figures[1]:>9} m {figures[2]:>5} m {each['survival']:>6.2f} "
            f"{number(period, 4, '-'):>8} ms"
        )
        found += [f"{'':24} {each['error']}"] if "error" in each else []
    return found
