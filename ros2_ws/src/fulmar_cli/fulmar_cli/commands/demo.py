"""`fulmar demo`: two recorded runs and a report in a minute."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from fulmar_bringup.console import log_line, new_table, output, write_line
from fulmar_cli.commands.arguments import invoked_command, option

START, GOAL, DURATION_S, RATE = (2.5, 1.5, 120.0), (0.0, 0.0, 0.0), 30.0, 2.0


def demo(
    out: Annotated[
        Path | None, option("DIR", "Folder of bags and report; runs/demo_<time> by default.")
    ] = None,
) -> None:
    """Run the floating platform with its policy, then with LQR, over real ROS 2; end with a table and a report."""
    from fulmar_cli.installation.extras import require

    require("rclpy", "mujoco", "onnxruntime", "mcap", "rosbags", "matplotlib")
    from fulmar_bags.run_record import read_run
    from fulmar_bringup.completion import completed
    from fulmar_bringup.plan_checks import checked
    from fulmar_bringup.run_plan import RunPlan
    from fulmar_evaluation.report.run_report import write_report
    from fulmar_evaluation.run_outcome import run_and_evaluate

    out = out or Path("runs") / f"demo_{time.strftime('%Y%m%d_%H%M%S')}"
    outcomes = []
    for controller in ("policy", "lqr"):
        log_line(
            f"{controller}: a simulated platform, the {controller} node and a recorder, in separate processes, "
            f"{DURATION_S:g} s at {RATE:g} times real time"
        )
        plan = RunPlan(
            "floating_platform", "go_to_pose", controller, "mujoco", goal=GOAL, start=START, duration_s=DURATION_S,
            rate=RATE, seed=1, record=str(out / controller), command=invoked_command(),
        )  # fmt: skip
        outcome = run_and_evaluate(checked(completed(plan)))
        if outcome.failure:  # Ctrl-C among them: there is nothing to compare
            log_line(f"{controller}: {outcome.failure}")
            raise typer.Exit(outcome.exit_code)
        outcomes.append(outcome)
    output.print(_table([outcome.summary for outcome in outcomes]))
    page = write_report([read_run(out / name) for name in ("policy", "lqr")], out / "report.html")
    write_line(f"report: {page}")
    write_line(f"bags:   {out / 'policy'}  {out / 'lqr'}")
    raise typer.Exit(max(outcome.exit_code for outcome in outcomes))


def _table(summaries: list[dict[str, Any]]) -> Table:
    numbers = ("time to goal", "position", "heading", "valves", "rate", "latency p99", "trips")
    table = new_table("floating platform, go to pose, over ROS 2", ("controller", "goal"), numbers)
    for column in table.columns[:2]:
        column.no_wrap = True
    for s in summaries:
        table.add_row(
            str(s["controller"]),
            "met" if s["success"] else "missed",
            _number(s["time_to_target_s"] if s["success"] else None, 1.0, "s", 1),
            _number(s["final_position_error_m"], 100.0, "cm", 1),
            _number(s["final_heading_error_deg"], 1.0, "°", 1),
            _number(s["actuator_use"], 100.0, "%", 0),
            _number(s["control_rate_hz"], 1.0, "Hz", 1),
            _number(s["latency_ms"]["p99"], 1.0, "ms", 1),
            str(s["watchdog_trips"]),
        )
    return table


def _number(value: float | None, factor: float, unit: str, digits: int) -> str:
    return "–" if value is None else f"{value * factor:.{digits}f} {unit}"
