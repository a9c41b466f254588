"""Report of a twin: what the robot is now, and whether the new bundle is better and by how much."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fulmar_evaluation.success_interval import gain_interval, wilson
from fulmar_evaluation.twin.request import TwinRequest

BESIDES = ("success_rate", "control_steps", "steps_per_s", "wall_s", "control_hz", "episode_s")


def report_of(
    request: TwinRequest,
    identification: Mapping[str, Any],
    old: Mapping[str, Any],
    training: Mapping[str, Any],
    new: Mapping[str, Any] | None,
    bags: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    """The report, ready for JSON.

    Args:
        request: What was asked for.
        identification: Result of the step of this name.
        old: Figures of the old bundle on the identified robot.
        training: Result of the step of this name.
        new: Figures of the new bundle; None: none was trained.
        bags: Answers of both bundles to the bags.

    Returns:
        `better` is whether the 95 % interval of the gain of success lies above 0.
    """
    before, after = _success(old), None if new is None else _success(new)
    gain = None
    if after is not None:
        low, high = gain_interval(before["success_rate"], after["success_rate"], request.episodes)
        gain = {"value": after["success_rate"] - before["success_rate"], "low": low, "high": high}
    better = gain is not None and gain["low"] > 0.0
    report = {
        "robot": request.robot,
        "task": request.task,
        "bags": [str(bag) for bag in request.bags],
        "driven_s": identification["driven_s"],
        "scale": identification["scale"],
        "trusted": identification["trusted"],
        "estimates": _beside_nominal(identification),
        "not_determined": identification["untold"],
        "noise": identification["noise"],
        "calibration": identification["calibration"],
        "episodes": request.episodes,
        "old": before,
        "training": dict(training),
        "new": after,
        "gain": gain,
        "figures": {} if new is None else _figures(old, new),
        "better": better,
        "reruns": list(bags),
        "warnings": identification["warnings"],
    }
    return report | {"result": _result(report)}


def _success(figures: Mapping[str, Any]) -> dict[str, Any]:
    rate = float(figures["success_rate"])
    low, high = wilson(rate, int(figures["episodes"]))
    return {
        "bundle": figures["bundle"],
        "sha256": figures["sha256"],
        "success_rate": rate,
        "low": low,
        "high": high,
        "envelope": figures.get("envelope"),
    }


def _beside_nominal(identification: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Each estimate with the number of the robot's YAML, and the ratio of both where that says something."""
    nominal = identification["nominal"]
    return {
        name: {
            **estimate,
            "nominal": nominal.get(name),
            "ratio": estimate["value"] / nominal[name] if nominal.get(name) else None,
        }
        for name, estimate in identification["estimates"].items()
    }


def _figures(old: Mapping[str, Any], new: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    """Means of every figure that both evaluations have."""
    found = {}
    for name, value in old.items():
        other = new.get(name)
        if name in BESIDES or not isinstance(value, dict) or not isinstance(other, dict):
            continue
        before, after = value.get("mean"), other.get("mean")
        if isinstance(before, int | float) and isinstance(after, int | float):
            found[name] = {"old": float(before), "new": float(after)}
    return found


def _result(report: Mapping[str, Any]) -> str:
    old, new, gain = report["old"], report["new"], report["gain"]
    if new is None:
        return (
            f"the old bundle succeeds in {old['success_rate']:.3f} of {report['episodes']} episodes on the robot as "
            "identified: it stays"
        )
    change = f"{old['success_rate']:.3f} to {new['success_rate']:.3f} of {report['episodes']} episodes"
    if report["better"]:
        return f"the new bundle is better by {gain['value']:.3f} ({gain['low']:.3f} to {gain['high']:.3f}): {change}"
    return f"the new bundle is not better: {change}. Train longer: --updates N"


def page_of(report: Mapping[str, Any]) -> str:
    """The report as a page of Markdown."""
    lines = [
        f"# Twin of {report['robot']}, {report['task']}",
        "",
        f"{report['result'][0].upper()}{report['result'][1:]}.",
        "",
        "## The robot",
        "",
        f"From {report['driven_s']:g} s in {len(report['bags'])} bags: {', '.join(report['bags'])}. "
        f"{report['scale'][0].upper()}{report['scale'][1:]}.",
        "",
        *_table(("quantity", "value", "95 % from", "to", "unit", "YAML", "of the YAML"), _rows(report)),
        "",
        f"Not determined: {', '.join(report['not_determined']) or 'none'}. Calibration: `{report['calibration']}`.",
        "",
        *_table(
            ("noise of", "standard deviation", "95 % from", "to"),
            [
                (name, *(f"{noise[part]:.4g}" for part in ("value", "low", "high")))
                for name, noise in report["noise"].items()
            ],
        ),
        "",
        "## The bundles",
        "",
        *_table(
            ("bundle", "success in MuJoCo", "95 % from", "to", "robot in its certified set"), _bundles(report)
        ),
        "",
        *_trained(report),
    ]
    return "\n".join(lines) + "\n"


def _rows(report: Mapping[str, Any]) -> list[tuple[str, ...]]:
    return [
        (
            name,
            *(f"{e[part]:.5g}" for part in ("value", "low", "high")),
            e["unit"],
            "" if e["nominal"] is None else f"{e['nominal']:.5g}",
            "" if e["ratio"] is None else f"{e['ratio']:.3f}",
        )
        for name, e in report["estimates"].items()
    ]


def _bundles(report: Mapping[str, Any]) -> list[tuple[str, ...]]:
    return [
        (
            f"{which}, `{found['bundle']}`",
            *(f"{found[part]:.3f}" for part in ("success_rate", "low", "high")),
            _place(found["envelope"]),
        )
        for which in ("old", "new")
        if (found := report[which]) is not None
    ]


def _place(envelope: Mapping[str, Any] | None) -> str:
    """Where the robot lies, in words."""
    if envelope is None:
        return "it has none"
    return "inside" if envelope["inside"] else f"outside: {'; '.join(envelope['problems'])}"


def _trained(report: Mapping[str, Any]) -> list[str]:
    """What the page has of a new bundle."""
    training = report["training"]
    if not training["trained"]:
        return [f"No training: {training['reason']}."]
    return [
        f"Trained for {training['updates']} updates, {training['steps']:,} steps in {training['wall_s']:.0f} s: "
        f"`{training['run']}`.",
        "",
        *_table(
            ("figure, mean", "old", "new"),
            [(name, f"{f['old']:.4g}", f"{f['new']:.4g}") for name, f in report["figures"].items()],
        ),
        "",
        "## The bags, re-run",
        "",
        *_table(
            ("bag", "steps", "answered", "other command than the old bundle"),
            [_rerun(each) for each in report["reruns"]],
        ),
    ]


def _rerun(line: Mapping[str, Any]) -> tuple[str, ...]:
    if "skipped" in line:
        return line["bag"], "", "", line["skipped"]
    share = line["differing"]
    return (
        line["bag"],
        str(line["steps"]),
        str(line["asked"]),
        "" if share is None else f"{100.0 * share:.1f} %",
    )


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    return [f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *rows)]
