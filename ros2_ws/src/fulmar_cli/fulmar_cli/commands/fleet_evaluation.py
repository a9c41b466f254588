"""`fulmar evaluate --system FLEET`: a fleet run once for each seed."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

from fulmar_bringup.console import print_result, write_line
from fulmar_cli.commands.fleet import check_alone
from fulmar_cli.commands.folders import dated_folder
from fulmar_core.config.errors import FAILED, ConfigError

FLEET_HELP = "A fleet from `fulmar list systems`, in the place of robot and task; through ros."
RESULTS_HELP = "Folder of a fleet's results, a file for each seed; seeds that are there do not run again."
TAKES = (
    "--system",
    "--through",
    "--episodes",
    "--episode-s",
    "--seed",
    "--real-time",
    "--no-keep-apart",
    "--results",
    "--json",
)


def both_given(robot: str | None, task: str | None) -> tuple[str, str]:
    """Robot and task of an evaluation without a fleet.

    Raises:
        ConfigError: One is missing.
    """
    if robot is None or task is None:
        raise ConfigError("say which robot and task: fulmar evaluate ROBOT TASK; or --system FLEET.")
    return robot, task


@dataclass(frozen=True)
class FleetSeeds:
    """What is asked for: a fleet, how it runs and for how long [s], and how many seeds from which on."""

    fleet: str
    through: str
    episodes: int
    seed: int
    real_time: bool
    keep_apart: bool
    results: Path | None
    duration_s: float | None = None

    def evaluate(self, robot: str | None, *, as_json: bool) -> None:
        """Run every seed and print them.

        Raises:
            ConfigError: An option of one robot is given, or the fleet cannot run.
            typer.Exit: 1 where a robot did not arrive, hulls touched, or a run failed.
        """
        if robot is not None:
            raise ConfigError(f"give the robot '{robot}' or --system {self.fleet}, not both.")
        check_alone(f"--system {self.fleet}", TAKES, sys.argv[2:])
        if self.through != "ros":
            raise ConfigError(f"--through {self.through}: a fleet runs through ros. Add --through ros.")
        from fulmar_evaluation.fleet_seeds import Choice, evaluate_seeds, line_of, summed_up

        self._check()
        choice = Choice(
            self.fleet,
            lockstep=not self.real_time,
            keep_apart=self.keep_apart,
            duration_s=self.duration_s,
        )
        folder = self.results or Path(dated_folder("runs", f"{self.fleet}_seeds"))
        seeds = range(self.seed, self.seed + self.episodes)
        say = (lambda _found: None) if as_json else (lambda found: write_line(line_of(found)))
        found = summed_up(choice, evaluate_seeds(choice, seeds, folder, say))
        print_result(found, lambda sums: write_line(_words(sums, folder)), as_json=as_json)
        good = found["all_arrived"] == found["count"] and not (
            found["touched"] or found["failed"] or found["crossed"]
        )
        if not good:
            raise typer.Exit(FAILED)

    def _check(self) -> None:
        from fulmar_bringup.fleet_plan import FleetChoices, fleet_plan
        from fulmar_cli.installation.extras import check_plan

        asked = FleetChoices(self.seed, keep_apart=self.keep_apart, duration_s=self.duration_s)
        for one in fleet_plan(self.fleet, asked).robots:
            check_plan(one)


def _words(sums: dict[str, Any], folder: Path) -> str:
    near = sums["least_distance_m"]
    least = "" if near is None else f", least distance {near:.3f} m"
    return (
        f"all arrived: {sums['all_arrived']} of {sums['count']}; hulls touched: {sums['touched']}; "
        f"runs failed: {sums['failed']}{least}; results in {folder}"
    )
