"""`fulmar benchmark`: measurements beside published results."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import typer

from fulmar_benchmarks.catalogue import rows
from fulmar_cli.commands.benchmark_row import OneBenchmark, command_of
from fulmar_core.config.errors import ConfigError

# Of our own machinery, by module of `tests/benchmarks`: they come with a checkout, not with an installed Fulmar.
OF_A_CHECKOUT = {
    "estimator": ("estimator.command", "Compare the state estimator with the mean of 30 poses."),
    "hardware": ("hardware", "Drive emulated devices to their goals, through driver and protocol."),
    "identify": (
        "identification.command",
        "Drive random robots in MuJoCo, and identify them from their bags.",
    ),
    "network": ("network", "Drive a robot by a controller on another host, over a bad cable."),
    "recorder": ("recorder.command", "Measure what recording costs the control loop and what it loses."),
}
CHECKOUT = Path(__file__).resolve().parents[5]

benchmark = typer.Typer(
    help="Measure policies, simulators, drivers, real time and training, beside published results.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
for row in rows().values():
    benchmark.command(row.name, cls=OneBenchmark)(command_of(row))


def _missing(name: str) -> Callable[[typer.Context], None]:
    """A command that explains where it can be run."""

    def refuse(_context: typer.Context) -> None:
        raise ConfigError(
            f"`fulmar benchmark {name}` measures Fulmar's own machinery and lies in tests/benchmarks of its sources. "
            "Run it from a checkout, after `make dev`."
        )

    return refuse


for name, (module, help_line) in OF_A_CHECKOUT.items():
    if (CHECKOUT / "tests" / "benchmarks").is_dir():
        benchmark.command(name)(getattr(import_module(f"tests.benchmarks.{module}"), name))
    else:
        benchmark.command(
            name,
            help=f"{help_line} Only from a checkout.",
            context_settings={"allow_extra_args": True, "ignore_unknown_options": True},
        )(_missing(name))
