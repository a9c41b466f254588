"""`fulmar benchmark`: what was measured, beside what was published."""

from __future__ import annotations

import typer

from fulmar_bringup.commands.benchmark_drift import drift
from fulmar_bringup.commands.benchmark_estimator import estimator
from fulmar_bringup.commands.benchmark_hardware import hardware
from fulmar_bringup.commands.benchmark_identify import identify
from fulmar_bringup.commands.benchmark_latency import endurance, latency
from fulmar_bringup.commands.benchmark_network import network
from fulmar_bringup.commands.benchmark_recorder import recorder
from fulmar_bringup.commands.benchmark_roboran import roboran
from fulmar_bringup.commands.benchmark_throughput import throughput
from fulmar_bringup.commands.benchmark_training import training

benchmark = typer.Typer(
    help="Measure policies, simulators, drivers, real time and training, beside what was published.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
benchmark.command()(drift)
benchmark.command()(endurance)
benchmark.command()(estimator)
benchmark.command()(hardware)
benchmark.command()(identify)
benchmark.command()(latency)
benchmark.command()(network)
benchmark.command()(recorder)
benchmark.command()(roboran)
benchmark.command()(throughput)
benchmark.command()(training)
