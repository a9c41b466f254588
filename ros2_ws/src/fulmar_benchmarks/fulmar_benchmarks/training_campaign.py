"""Our faster PPO beside the one of Stable-Baselines3, kept run by run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from fulmar_benchmarks.shape import AGAIN, ALONE, Benchmark, Cell, Check, Choice, Figures, Found, Progress
from fulmar_core.simulation.counts import PROCESS_BYTES, check_count
from training.benchmark import KINDS, benchmark_jobs, compare
from training.executors import LocalExecutor
from training.jobs import Job, Outcome
from training.progress import JobBars


@dataclass(frozen=True, kw_only=True)
class TrainingCell(Cell):
    """Some runs side by side: those of one seed, or of as many as run at once."""

    jobs: tuple[Job, ...]
    at_once: int

    def parts(self) -> dict[str, Any]:
        """Not where the runs lie."""
        return {"jobs": [{**asdict(job), "out": ""} for job in self.jobs], "at_once": self.at_once}

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """Record of each run, or how it failed."""
        with JobBars([job.name for job in self.jobs]) as bars:
            outcomes = LocalExecutor(self.at_once).run(self.jobs, bars)
        failed = any(each.record is None for each in outcomes)
        return {"runs": [{"record": each.record, "error": each.error} for each in outcomes], AGAIN: failed}


class Training(Benchmark):
    """Speed, and success over time, of both on the same seeds."""

    name = "training"
    title = "Our PPO beside the stock one"

    def __init__(self, choice: Choice) -> None:
        """Plan the runs.

        Raises:
            ConfigError: The robot and the task do not learn with PPO, or this is too much.
        """
        super().__init__(choice)
        check_count("--seeds", choice.seeds)
        check_count("--at-once", choice.at_once, bytes_each=PROCESS_BYTES)
        self._jobs = benchmark_jobs(
            choice.robot, choice.task, seeds=range(1, choice.seeds + 1), seconds=choice.seconds,
            check_every_s=choice.check_every, out=choice.out,
        )  # fmt: skip

    def cells(self) -> list[TrainingCell]:
        """As many runs as are side by side; the two kinds of a seed stay together."""
        step = max(len(KINDS), self.choice.at_once)
        groups = [tuple(self._jobs[first : first + step]) for first in range(0, len(self._jobs), step)]
        return [
            TrainingCell(
                name="_".join(job.name.replace(" ", "_") for job in group), where=ALONE, way="training", jobs=group,
                at_once=self.choice.at_once,
            )
            for group in groups
        ]  # fmt: skip

    def document(self, found: Found) -> dict[str, Any]:
        """Figures by kind; see `training.benchmark.compare`."""
        return compare(self._jobs, _Known(self.cells(), found), lambda *_: None)

    def checks(self, document: Mapping[str, Any]) -> list[Check]:
        """Every run must end."""
        return [Check.most("runs that failed", len(document["failed"]), 0)]

    def tables(self, document: Mapping[str, Any]) -> list[str]:
        """Both kinds side by side."""
        return [*lines(document), *self.check_lines(document)]


@dataclass(frozen=True)
class _Known:
    """Stands for an executor: what is known of each run."""

    cells: Sequence[TrainingCell]
    found: Found

    def run(self, jobs: Sequence[Job], watch: Any) -> list[Outcome]:
        """Outcomes of the runs."""
        known: dict[str, Outcome] = {}
        for cell in self.cells:
            figures = self.found[cell.name]
            failed = [{"record": None, "error": figures}] * len(cell.jobs)
            runs = failed if isinstance(figures, str) else figures["runs"]
            known |= {job.name: Outcome(job, **one) for job, one in zip(cell.jobs, runs, strict=True)}
        return [known[job.name] for job in jobs]


def lines(result: Mapping[str, Any]) -> list[str]:
    """Failures, speed, and success over time."""
    kinds = [kind for kind in KINDS if kind in result]
    arrivals = [result[kind]["time_to_0.9_s"] for kind in kinds]
    never = ["never" if value is None else f"{value:.0f} s" for value in arrivals]
    found = [f"failed: {failure}" for failure in result["failed"]]
    found += [
        f"{result['robot']} · {result['task']}: success as lowest – median – highest",
        f"{'':<14}" + "".join(f"{kind:^26}" for kind in kinds),
        f"{'steps/s':<14}" + "".join(f"{result[kind]['steps_per_s']:^26,.0f}" for kind in kinds),
        f"{'success 0.9':<14}" + "".join(f"{cell:^26}" for cell in never),
    ]
    for rows in zip(*(result[kind]["curve"] for kind in kinds), strict=True):
        cells = [f"{row['lowest']:.3f} – {row['success']:.3f} – {row['highest']:.3f}" for row in rows]
        found.append(f"{rows[0]['wall_s']:>8.0f} s    " + "".join(f"{cell:^26}" for cell in cells))
    ratio = [f"fast is {result['speed_ratio']:.1f} times as fast as stock"] if "speed_ratio" in result else []
    return found + ratio
