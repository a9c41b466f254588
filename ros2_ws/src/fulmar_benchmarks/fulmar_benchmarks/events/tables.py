"""The benchmark of event-based rates as text."""

from __future__ import annotations

from typing import Any

NAMES = {
    "single": "one camera",
    "dual": "two cameras",
    "flow": "local flow, one",
    "fused": "thesis §6.4.5, two",
}


def lines(document: dict[str, Any]) -> list[str]:
    """Lines for a terminal; rates in °/s."""
    found = []
    if "single" in document:
        found.append(
            f"errors of {document['runs']} windows, RMS °/s" + 11 * " " + "p        q        r        RSS"
        )
        for name, what in NAMES.items():
            found.append(f"  {what:28}" + _row(document[name]))
        for name, row in document["thesis"].items():
            found.append(f"  {'thesis, ' + NAMES[name]:28}" + _row(row))
        cpu, sky = document["computation_s"], document["sky_s"]
        found.append(
            f"  normalised error inside its {100 * document['band']:.0f} % band: {document['nees_inside']:.3f}"
        )
        found.append(
            f"  computation p50 {1e3 * cpu['p50']:.0f} ms, p99 {1e3 * cpu['p99']:.0f} ms of windows of "
            f"{1e3 * document['window_s']:.0f} ms, at {document['events_per_s']:.0f} events/s of each of two cameras"
        )
        found.append(f"  a second of one camera's sky takes {sky['p50']:.2f} s, at most {sky['max']:.2f} s")
    found += [
        f"  field of view {row['fov_deg']:4.0f}°: boresight / cross-axis {row['ratio']:6.2f}, "
        f"expected {row['expected']:6.2f} ({100 * row['off']:+.0f} %)"
        for row in document.get("fov_ratio", ())
    ]
    for part in ("sensitivity", "slow_and_fast"):
        for name, row in document.get(part, {}).items():
            found.append(
                f"  {name:18} stars {row['stars']:4.0f}, one camera"
                + _row(row["single"])
                + ", two"
                + _row(row["dual"])
            )
    if "pointing" in document:
        found += _pointing(document["pointing"])
    return found


def _row(row: dict[str, Any]) -> str:
    if not row.get("windows", 1):
        return "  nothing found"
    return "".join(f" {row[key]:8.5f}" for key in ("rms_p", "rms_q", "rms_r", "rss"))


def _pointing(found: dict[str, Any]) -> list[str]:
    rms = found["rms_deg"]
    without = found["without_star_tracker"][0]
    return [
        f"  nadir pointing without a gyroscope, {found['seconds']:.0f} s, {len(found['episodes'])} episodes: RMS "
        f"{rms['median']:.4f}°, at most {rms['max']:.4f}°; largest error {found['max_deg']:.4f}°",
        f"  star tracker: {found['star_tracker']}",
        f"  without it after the first minute: {without['end_deg']:.3f}° off in the end",
    ]
