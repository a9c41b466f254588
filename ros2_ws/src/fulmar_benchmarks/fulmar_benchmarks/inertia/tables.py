"""The benchmark of inertia identification as text."""

from __future__ import annotations

from typing import Any

from fulmar_benchmarks.inertia.campaign import METHODS, requirements
from fulmar_core.tasks.torque_profiles import OWN


def lines(document: dict[str, Any]) -> list[str]:
    """Lines for a terminal; errors in percent."""
    found = []
    for level, satellites in document["cells"].items():
        found.append(
            f"{level} gyroscope: largest error of a moment [%]" + "".join(f"{m:>9}" for m in METHODS)
        )
        for satellite, profiles in satellites.items():
            for profile, cell in profiles.items():
                errors = "".join(f"{100 * cell[method]['error_max']:9.4f}" for method in METHODS)
                full = (
                    f"  wheels full {100 * cell['ls']['saturated']:3.0f} % of the time"
                    if cell["ls"]["saturated"]
                    else ""
                )
                found.append(f"  {satellite + ', ' + profile:40}" + errors + full)
    for change, satellites in document["dynamic"].items():
        found.append(f"{change}: RMS error after the first minute [%]           EKF    batch  observable")
        for satellite, profiles in satellites.items():
            for profile, cell in profiles.items():
                text = f"  {satellite + ', ' + profile:40} {100 * cell['ekf']:9.3f} {100 * cell['ls']:8.3f}"
                text += f" {100 * cell['observable']:6.0f} %"
                if change == "step":
                    text += f"  found after {cell['found_s']:.1f} s" if cell["found"] else "  not found"
                    text += ", says that it cannot observe it" if cell["says_it_cannot_observe"] else ""
                found.append(text)
    for satellite, profiles in document["excitation"].items():
        for kind in ("diagonal", "full"):
            others = {name: each[kind] for name, each in profiles.items() if name != OWN}
            if OWN in profiles and others:
                best = max(others, key=lambda name: others[name])
                ratio = profiles[OWN][kind] / max(others[best], 1e-300)
                found.append(
                    f"D-criterion a second, {satellite}, {kind}: ours {ratio:.2f} times that of {best}, the best"
                )
    for name, text, good in requirements(document):
        found.append(f"{'met   ' if good else 'NOT   '} {name}: {text}")
    return found
