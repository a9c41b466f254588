"""The outcome of the benchmark as one JSON-ready document: what tables, pages and other programs read."""

from __future__ import annotations

from typing import Any

import numpy as np

from fulmar_benchmarks.drift.conditions import CONDITIONS, PATHS
from fulmar_benchmarks.drift.physics import Physics
from fulmar_benchmarks.drift.targets import FIGURES, TRACKING, band_of, drop_percent, published, requirements
from fulmar_benchmarks.pairs import Pair
from fulmar_benchmarks.results import PairResult, statistics
from fulmar_benchmarks.shape import Choice

Key = tuple[str, str]  # row and controller
# Names of our figures by those of the thesis.
OURS = {
    **{f"{kind}T{limit}": f"{kind}T{limit}_percent" for kind in "PO" for limit in (5, 2, 1)},
    "ALV": "ALV_m_s",
    "AAV": "AAV_rad_s",
    "AAS": "AAS",
}
OF_PATHS = {
    "velocity_error": "velocity_error_m_s",
    "velocity_error_std": "velocity_error_std_m_s",
    "velocity_error_under_way": "velocity_error_under_way_m_s",
    "velocity_error_under_way_std": "velocity_error_under_way_std_m_s",
    "path_error": "path_error_m",
    "path_error_std": "path_error_std_m",
    "path_error_most": "path_error_most_m",
    "ALV": "ALV_m_s",
    "AAS": "AAS",
}


def document_of(
    choice: Choice, *, pairs: dict[Key, Pair], found: dict[Key, PairResult | str], physics: dict[str, Physics]
) -> dict[str, Any]:
    """The whole document; docs/evaluation.md names its keys.

    Args:
        choice: What was asked for.
        pairs: Who drives, by row and controller.
        found: Results, or why there is none.
        physics: What is possible in the conditions, by row.
    """
    rows = {
        row.name: _row(row, choice, pairs, found, physics.get(row.name))
        for row in (*CONDITIONS, *PATHS)
        if row.name in choice.rows
    }
    _add_drops(rows)
    results = [one for one in found.values() if isinstance(one, PairResult)]
    steps = sum(one.about["control_steps"] for one in results)
    busy_s = sum(one.about["wall_s"] for one in results)
    return {
        "through": choice.through,
        "seed": choice.seed,
        "episodes": choice.episodes,
        "controllers": list(choice.controllers),
        "rows": rows,
        "requirements": [
            each for row in rows for name in choice.controllers for each in _checks(row, name, rows)
        ],
        "control_steps": steps,
        "steps_per_s": steps / busy_s if busy_s else None,
    }


def _row(
    row: Any,
    choice: Choice,
    pairs: dict[Key, Pair],
    found: dict[Key, PairResult | str],
    physics: Physics | None,
) -> dict[str, Any]:
    entry: dict[str, Any] = {"title": row.title, "kind": "path" if physics is None else "pose"}
    if physics is None:
        mean, std = TRACKING[row.name]
        entry |= {"goals": row.goals, "published": {"velocity_error": mean, "velocity_error_std": std}}
    else:
        entry |= {
            "scenario": row.scenario,
            "lost_thrusters": row.lost,
            "bound": {figure: statistics(most) for figure, most in physics.bounds.items()},
            "feasible_share": float(np.mean(physics.can_hold)),
        }
    entry["controllers"] = {
        name: _entry(row.name, name, physics, pairs[row.name, name], found.get((row.name, name)))
        for name in choice.controllers
    }
    return entry


def _entry(
    row: str, name: str, physics: Physics | None, pair: Pair, outcome: PairResult | str | None
) -> dict[str, Any]:
    result = outcome if isinstance(outcome, PairResult) else None
    entry: dict[str, Any] = {
        "status": "missing" if pair.missing else "failed" if result is None else "judged",
        "reason": pair.reason or (outcome if isinstance(outcome, str) else None),
        "law": pair.law or None,
        "sha256": pair.sha256 or None,
    }
    if physics is not None:
        beside, figures = published(row, name)
        entry |= {"published_controller": beside, "published": figures}
    if result is None:
        return entry | {"figures": {}}
    names = OF_PATHS if physics is None else OURS
    about = result.about
    if physics is not None and physics.can_hold.any():
        able = physics.can_hold
        entry["where_feasible"] = {
            "episodes": int(np.sum(able)),
            "success_rate": float(np.mean(result.succeeded[able])),
            "figures": {key: statistics(result.figures[ours][able]) for key, ours in names.items()},
        }
    return entry | {
        "episodes": len(result.succeeded),
        "success_rate": float(np.mean(result.succeeded)),
        "figures": {key: statistics(result.figures[ours]) for key, ours in names.items()},
        "control_hz": about["control_hz"],
        "control_steps": about["control_steps"],
        "wall_s": about["wall_s"],
        "steps_per_s": about["control_steps"] / about["wall_s"],
    }


def _add_drops(rows: dict[str, Any]) -> None:
    """Add to each figure how far it falls behind the ideal row of the same controller, ours and published."""
    ideal = rows.get("ideal", {"controllers": {}})["controllers"]
    for name, row in rows.items():
        if row["kind"] == "path":
            continue
        for controller, entry in row["controllers"].items():
            own = ideal.get(controller, {}).get("figures", {})
            entry["drops"] = {
                figure: _drop(figure, entry["figures"][figure]["mean"], own[figure]["mean"])
                for figure in FIGURES
                if entry["figures"] and own
            }
            best = published("ideal", controller)[1]
            entry["published_drops"] = {
                figure: _drop(figure, value, best[figure])
                for figure, value in published(name, controller)[1].items()
            }


def _drop(figure: str, value: float, ideal: float) -> dict[str, Any] | None:
    drop = drop_percent(figure, value, ideal)
    return None if drop is None else {"percent": drop, "band": band_of(drop).name}


def _checks(row: str, controller: str, rows: dict[str, Any]) -> list[dict[str, Any]]:
    figures = rows[row]["controllers"][controller]["figures"]
    return [
        {
            "row": row,
            "controller": controller,
            "figure": asked.figure,
            "better": "more" if asked.at_least else "less",
            "measured": check.measured,
            "limit": check.limit,
            "met": check.met,
        }
        for asked in requirements(row, controller)
        for check in (asked.check(figures[asked.figure]["mean"] if figures else None),)
    ]
