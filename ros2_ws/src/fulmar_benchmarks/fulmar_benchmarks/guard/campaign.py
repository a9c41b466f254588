"""The benchmark: every defect of every robot beside guard off; MuJoCo and wrong beliefs of those that float."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

from fulmar_benchmarks.guard.defects import ADVERSARY, NONE
from fulmar_benchmarks.guard.moving_trial import WING_RUN_S, decision_of, drive, field_of
from fulmar_benchmarks.guard.trial import BATCH, BELIEFS, MUJOCO, SOUND, Trial, decision_ms, fly
from fulmar_benchmarks.pairs import policy_hash
from fulmar_benchmarks.shape import ALONE, Benchmark, Cell, Check, Figures, Found, Progress, known
from fulmar_benchmarks.tables import Entry, Row, Shown, Table
from fulmar_core.config.errors import ConfigError
from fulmar_core.loop.envelope import check_guard
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.envelope.braking import floats

LEFT_SHARE, FARTHEST_M = 0.02, 0.3  # of the runs that may leave, and how far [m]
BACKUP_SHARE, TRIP_SHARE, SUCCESS = 0.02, 0.2, 0.01  # of nominal runs
DECISION_MS, ROLLOUT_MS = 0.5, 5.0  # in closed form, and by rollouts
PERIOD_SHARE = 0.05  # of the control period that the slowest of 100 decisions may take
WRONG_SHARE = 0.05  # of the runs that may leave where the guard's beliefs are wrong
PARTS = ("defects", "beliefs", "mujoco", "decision")
MODULES = ("defects", "trial", "moving_defects", "wing_defects", "moving_trial")


@dataclass(frozen=True, kw_only=True)
class GuardCell(Cell):
    """The runs of one defect."""

    modules = tuple(f"{__package__}.{name}" for name in MODULES)
    trial: Trial

    def parts(self) -> dict[str, Any]:
        """A bundle counts by what is in it."""
        its, robot = self.trial, load_robot(self.trial.robot)
        task = robot.kind.usual_task if floats(robot) else field_of(its.robot).task.name
        return {"trial": asdict(its), "policy": policy_hash(its.robot, task, its.controller, "")}

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """As in `trial.fly`."""
        made = fly if floats(load_robot(self.trial.robot)) else drive
        return made(self.trial, lambda share: progress(share * self.cost))


@dataclass(frozen=True, kw_only=True)
class DecisionCell(Cell):
    """Processor time of a decision."""

    modules = tuple(f"{__package__}.{name}" for name in MODULES)
    robot: str
    controller: str
    seed: int

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """As in `trial.decision_ms`."""
        made = decision_ms if floats(load_robot(self.robot)) else decision_of
        return made(self.robot, self.controller, self.seed)


class GuardRuns(Benchmark):
    """Robots within their bounds, with defective controllers, with and without the envelope guard."""

    name = "guard"
    title = "Envelope guard against defective controllers"

    def check(self) -> None:
        """Refuse robots that have no such guard, and parts that do not exist."""
        for name in self.choice.robots:
            check_guard(load_robot(name))
        if self.choice.runs < 1:
            raise ConfigError(f"--runs {self.choice.runs} must be at least 1.")

    def _trials(self, robot: str) -> Iterator[Trial]:
        """Every trial of a robot; wrong beliefs and MuJoCo are of those that float."""
        asked, moved = self.choice, load_robot(robot)
        afloat = floats(moved)
        base = Trial(robot, NONE, guarded=True, runs=asked.runs, seed=asked.seed, controller=asked.controller)
        if moved.airframe is not None:
            base = replace(base, seconds=WING_RUN_S)
        if "defects" in asked.parts:
            for defect in asked.defects:
                for guarded in (True, False):
                    yield replace(base, defect=defect, guarded=guarded)
        if "beliefs" in asked.parts and afloat:
            for belief in BELIEFS[1:]:
                yield replace(base, defect=ADVERSARY, belief=belief)
        if "mujoco" in asked.parts and afloat:
            for defect in asked.defects:
                yield replace(base, defect=defect, way=MUJOCO, runs=max(1, asked.runs // 2))

    def cells(self) -> list[Cell]:
        """Every trial of every robot, and the decisions."""
        asked = self.choice
        found: list[Cell] = [
            GuardCell(
                name=_name(trial), cost=30.0 if trial.way == MUJOCO else 5.0, way=trial.way, trial=trial
            )
            for robot in asked.robots
            for trial in self._trials(robot)
        ]
        if "decision" in asked.parts:
            found += [
                DecisionCell(
                    name=f"{robot}_decision", where=ALONE, robot=robot, controller=asked.controller,
                    seed=asked.seed,
                )
                for robot in asked.robots
            ]  # fmt: skip
        return found

    def document(self, found: Found) -> dict[str, Any]:
        """Figures by robot and trial."""
        asked = self.choice
        robots = [
            {
                "robot": robot,
                "trials": [asdict(trial) | known(found, _name(trial)) for trial in self._trials(robot)],
                "decision_ms": known(found, f"{robot}_decision") if "decision" in asked.parts else None,
            }
            for robot in asked.robots
        ]
        return {"controller": asked.controller, "runs": asked.runs, "seed": asked.seed, "robots": robots}

    def checks(self, document: Mapping[str, Any]) -> list[Check]:
        """Those of the defects; wrong beliefs are required apart."""
        return [check for one in document["robots"] for check in _checks(one)]

    def tables(self, document: Mapping[str, Any]) -> list[Shown]:
        """A row for each trial, then what is required."""
        rows = [
            Row(
                tuple(
                    Entry(text)
                    for text in (
                        one["robot"], each["way"], each["defect"], each["belief"],
                        "on" if each["guarded"] else "off", f"{each['left']} of {each['runs']}",
                        f"{each['worst_m']:+.2f}", f"{each['backup_share']:.2%}", f"{each['trip_share']:.1%}",
                        f"{each['success']:.3f}",
                    )
                )
            )
            for one in document["robots"]
            for each in one["trials"]
        ]  # fmt: skip
        titles = ("robot", "in", "defect", "beliefs", "guard", "left", "farthest out [m]", "backup", "trips",
                  "at goal")  # fmt: skip
        times = [
            f"{one['robot']}: a decision takes {its['p50']:.3f} ms, p99 {its['p99']:.3f} ms" + _of_period(its)
            for one in document["robots"]
            if (its := one["decision_ms"])
        ]
        table = Table(f"{document['controller']}, {document['runs']} runs", titles, rows)
        return [table, *times, *self.check_lines(document)]

    def said(self, cell: Cell, figures: Figures) -> str:
        """How many left."""
        if "left" not in figures:
            return f"{figures['p50']:.3f} ms"
        return (
            f"{figures['left']} of {figures['runs']} left, at most {figures['worst_m']:+.2f} m beyond a side"
        )


def _name(trial: Trial) -> str:
    guard = "on" if trial.guarded else "off"
    its = (
        trial.robot,
        trial.controller,
        trial.defect,
        trial.belief,
        trial.way,
        guard,
        trial.runs,
        trial.seed,
    )
    return "_".join(map(str, its))


def _checks(one: Mapping[str, Any]) -> Iterator[Check]:
    """What is required of one robot."""
    for each in one["trials"]:
        if not each["guarded"]:
            continue
        wrong = each["belief"] != SOUND
        what = f"{one['robot']}, {each['way']}, " + (
            f"wrong belief '{each['belief']}'" if wrong else f"defect '{each['defect']}'"
        )
        limit = WRONG_SHARE if wrong else LEFT_SHARE
        yield Check.most(f"{what}: share that leaves", each["left"] / each["runs"], limit)
        if not wrong:
            yield Check.most(f"{what}: farthest out [m]", max(each["worst_m"], 0.0), FARTHEST_M)
    nominal = {
        each["guarded"]: each
        for each in one["trials"]
        if each["defect"] == NONE and each["way"] == BATCH and each["belief"] == SOUND
    }
    if len(nominal) == 2:
        on, off = nominal[True], nominal[False]
        yield Check.most(f"{one['robot']}, nominal: time in backup", on["backup_share"], BACKUP_SHARE)
        yield Check.most(f"{one['robot']}, nominal: runs with a trip", on["trip_share"], TRIP_SHARE)
        lost = off["success"] - on["success"]
        yield Check.most(f"{one['robot']}, nominal: success lost by the guard", lost, SUCCESS)
    if one["decision_ms"]:
        took, name = one["decision_ms"], one["robot"]
        limit = DECISION_MS if floats(load_robot(name)) else ROLLOUT_MS
        yield Check.most(f"{name}: a decision [ms]", took["p50"], limit)
        share = took["p99"] / took["period"]
        yield Check.most(f"{name}: 99th percentile of a decision, of the period", share, PERIOD_SHARE)


def _of_period(its: Mapping[str, float]) -> str:
    """What the slowest of 100 decisions takes of a control period, in words."""
    return f", {its['p99'] / its['period']:.1%} of the period (aim {PERIOD_SHARE:.0%})"
