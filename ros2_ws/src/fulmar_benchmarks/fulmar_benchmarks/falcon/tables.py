"""The benchmark of FALCON-S as lines of text."""

from __future__ import annotations

from typing import Any

from fulmar_benchmarks.cells import number
from fulmar_benchmarks.falcon.campaign import requirements


def lines(document: dict[str, Any]) -> list[str]:
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
    for name, asked, shown, good in requirements(document):
        found.append(f"{'met' if good else 'NOT MET':8} {name}: {shown} ({asked})")
    return found
