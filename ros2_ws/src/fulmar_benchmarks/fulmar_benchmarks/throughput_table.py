"""The figures of `fulmar benchmark throughput` as a table."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.table import Table


def print_table(figures: dict[str, Any], output: Console) -> None:
    """Print a row for each robot, and how MuJoCo integrates them."""
    table = Table(
        title=f"steps/s · {figures['worlds']:,} worlds · {figures['task']} · {figures['scenario']} · "
        f"{figures['library']} on {figures['device']} · {figures['cores']} cores"
    )
    table.add_column("robot")
    for column in ("batch", "MuJoCo", "ratio", "otherwise", "ratio then"):
        table.add_column(column, justify="right")
    for name, found in figures["robots"].items():
        table.add_row(
            name,
            f"{found['batch_steps_per_s']:,.0f}",
            *_with_mujoco(found),
            *_otherwise(found),
        )
    output.print(table)
    for line in dict.fromkeys(
        f"MuJoCo of {', '.join(n for n, f in figures['robots'].items() if _method(f) == _method(found))}: "
        f"{_method(found)}"
        for found in figures["robots"].values()
        if "ratio" in found
    ):
        output.print(line, markup=False, soft_wrap=True)


def _method(found: dict[str, Any]) -> str:
    """How MuJoCo integrates a robot; empty for one that it does not."""
    if "ratio" not in found:
        return ""
    return f"{found['mujoco_integrator']}, steps of {found['mujoco_step_s']:g} s"


def _with_mujoco(found: dict[str, Any]) -> tuple[str, str]:
    """Figures of MuJoCo's rollout; none of aircraft."""
    if "ratio" not in found:
        return "", ""
    return f"{found['mujoco_steps_per_s']:,.0f}", f"{found['ratio']:.1f}"


def _otherwise(found: dict[str, Any]) -> tuple[str, ...]:
    """Figures of robots on water, in space and in the air; none for others."""
    for pace, ratio, how in (
        ("mujoco_with_water_steps_per_s", "ratio_with_water", "in water"),
        ("mujoco_euler_steps_per_s", "ratio_with_euler", "Euler"),
        ("jsbsim_steps_per_s", "ratio_with_jsbsim", "JSBSim"),
    ):
        if ratio in found:
            return f"{how} {found[pace]:,.0f}", f"{found[ratio]:.1f}"
    return ()
