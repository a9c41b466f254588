"""The result of `fulmar parity` as lines for a terminal and as a page of Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fulmar_evaluation.parity.divergence import QUANTITIES

NAMES = dict(
    zip(QUANTITIES, ("position [m]", "attitude [°]", "velocity [m/s]", "turn rate [°/s]"), strict=True)
)


def page_of(document: Mapping[str, Any]) -> str:
    """The page.

    Args:
        document: Result of `parity`.
    """
    d = document
    lines = [
        f"# {d['robot']} in every simulator",
        "",
        f"Task {d['task']}, controller {d['controller']} at {d['control_hz']:g} Hz, scenario {d['scenario']}, seed "
        f"{d['seed']}.",
        "",
        "## The same commands",
        "",
        f"{d['runs']} runs of {d['duration_s']:g} s: the controller drives the core, the others repeat its commands "
        "from the same starts in the same worlds. Distance from the core, median over the runs; in parentheses the "
        "largest.",
        "",
    ]
    for name, apart in d["divergence"].items():
        lines += [f"### {name}", "", *_divergence(apart, d["noise"]), ""]
    lines += _success(d)
    lines += [f"- {name}: {reason}" for name, reason in d["skipped"].items()]
    return "\n".join(lines) + "\n"


def lines_of(document: Mapping[str, Any]) -> list[str]:
    """The same in a few lines."""
    lines = []
    for name, apart in document["divergence"].items():
        if apart["lost_runs"]:
            lines.append(f"{name}: {apart['lost_runs']} of {document['runs']} runs lost their state")
        parts = [
            f"{NAMES[key]} {apart[key]['at'][-1]['median']:.3g} (largest {apart[key]['largest']:.3g}, sensor "
            f"{document['noise'][key]:.3g})"
            for key in QUANTITIES
            if key in apart
        ]
        if parts:
            lines.append(f"{name}, after {document['duration_s']:g} s: {'; '.join(parts)}")
    for name, found in document["success"].items():
        rate = found.get("problem") or (
            f"success {found['success_rate']:.3f} ({found['low']:.3f} to {found['high']:.3f}) of "
            f"{document['episodes']} episodes"
        )
        lines.append(f"{name}: {rate}")
    return [*lines, *(f"{name}: {reason}" for name, reason in document["skipped"].items())]


def _divergence(apart: Mapping[str, Any], noise: Mapping[str, float]) -> list[str]:
    lines = [f"{apart['lost_runs']} runs lost their state.", ""] if apart["lost_runs"] else []
    there = [name for name in QUANTITIES if name in apart]
    if not there:
        return lines
    rows: list[Sequence[str]] = [("time [s]", *(NAMES[name] for name in there)), ["---"] * (len(there) + 1)]
    for number, first in enumerate(apart[there[0]]["at"]):
        cells = (apart[name]["at"][number] for name in there)
        rows.append(
            (f"{first['time_s']:g}", *(f"{cell['median']:.2g} ({cell['largest']:.2g})" for cell in cells))
        )
    rows.append(
        ("noise of one reading", *(f"{noise[name]:.2g}" if noise[name] else "none" for name in there))
    )
    rows.append(("beyond that after [s]", *(_seen(apart[name]["seen_after_s"]) for name in there)))
    return lines + [f"| {' | '.join(row)} |" for row in rows]


def _seen(time_s: float | None) -> str:
    return "never" if time_s is None else f"{time_s:g}"


def _success(document: Mapping[str, Any]) -> list[str]:
    if not document["success"]:
        return []
    rows: list[Sequence[str]] = [("simulator", "success", "95 % from", "to"), ["---"] * 4]
    for name, found in document["success"].items():
        numbers = [found.get(part) for part in ("success_rate", "low", "high")]
        if "problem" in found:
            rows.append((name, found["problem"], "", ""))
        else:
            rows.append((name, *(f"{number:.3f}" for number in numbers)))
    head = ["## The same controller", "", f"{document['episodes']} episodes, the same in each.", ""]
    return [*head, *(f"| {' | '.join(row)} |" for row in rows), ""]
