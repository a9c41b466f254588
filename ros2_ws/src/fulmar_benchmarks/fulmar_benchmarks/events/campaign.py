"""The whole benchmark of event-based rates: random windows, fields of view, sensitivities, and pointing on them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import chi2

from fulmar_benchmarks.events.pointing import point_without_gyroscope
from fulmar_benchmarks.events.random_windows import Conditions, measure_window
from fulmar_benchmarks.workers import mapped

# Thesis Table 6.2 [deg/s].
THESIS = {
    "single": {"rms_p": 0.0165, "rms_q": 0.0192, "rms_r": 0.3060, "rss": 0.3070},
    "dual": {"rms_p": 0.0115, "rms_q": 0.0192, "rms_r": 0.0160, "rss": 0.0275},
}
FIELDS_DEG = (8.0, 10.0, 15.0, 20.0, 30.0, 40.0)
FIELD_RATE_DEG = (
    1.0  # in a field of view of 8.5° [deg/s]: of one size, so that no window outweighs the others
)
FIELD_WINDOWS = 3  # windows of each field of view, for each of the table
STARS_PER_MAGNITUDE = 0.51  # growth of the logarithm of their number with the limiting magnitude
BAND = 0.95  # of the normalised error squared, three degrees of freedom, from 0 on
PARTS = ("table", "fields", "sensitivity", "slow_and_fast", "pointing")
SPANS = ((0.005, 0.02), (0.02, 0.1), (0.1, 2.0), (2.0, 10.0), (10.0, 20.0))  # of rates [deg/s]

Progress = Callable[[float, float], None]


@dataclass(frozen=True)
class Request:
    """What to measure."""

    runs: int  # windows of the table and of each field of view
    seed: int
    parts: tuple[str, ...]
    pointing_runs: int  # episodes of ten minutes
    pointing_s: float  # their length [s]
    jobs: int


def run_events(request: Request, progress: Progress) -> dict[str, Any]:
    """Measure, and put the figures together.

    Returns:
        JSON-ready; see `fulmar benchmark events --help`.
    """
    usual, runs = Conditions(), request.runs
    few = max(4, runs // 4)
    groups: dict[tuple[str, Any], tuple[Conditions, int]] = {}
    if "table" in request.parts:
        groups["table", ""] = usual, runs
    if "fields" in request.parts:
        for fov in FIELDS_DEG:
            groups["fields", fov] = _at_field(usual, fov), FIELD_WINDOWS * runs
    if "sensitivity" in request.parts:
        for name, value, changed in _variants(usual):
            groups["sensitivity", f"{name} {value:g}"] = changed, few
    if "slow_and_fast" in request.parts:
        for low, high in SPANS:
            window = 1.0 if high <= 0.1 else 0.2 if high <= 2.0 else 0.1
            groups["slow_and_fast", f"{low:g} to {high:g}"] = (
                replace(usual, slowest_deg=low, fastest_deg=high, window_s=window),
                few,
            )
    items = [(each, request.seed, n) for each, count in groups.values() for n in range(count)]
    pointing = _pointing_items(request)
    found = iter(
        mapped(_work, [("window", *item) for item in items] + pointing, jobs=request.jobs, progress=progress)
    )
    windows = {key: [next(found) for _ in range(count)] for key, (_, count) in groups.items()}
    document: dict[str, Any] = {"runs": runs, "seed": request.seed, "band": BAND, "thesis": THESIS}
    if "table" in request.parts:
        document |= _table(windows["table", ""], usual)
    if "fields" in request.parts:
        document["fov_ratio"] = [_ratio(fov, windows["fields", fov]) for fov in FIELDS_DEG]
    for part in ("sensitivity", "slow_and_fast"):
        if part in request.parts:
            document[part] = {name: _row(each) for (of, name), each in windows.items() if of == part}
    if pointing:
        document["pointing"] = _pointing([next(found) for _ in pointing], pointing)
    return document


def _at_field(usual: Conditions, fov_deg: float) -> Conditions:
    """One camera of another field of view that sees as many stars, at a rate at which they move over as many pixels."""
    camera = replace(usual.camera, fov_deg=fov_deg)
    faster = usual.camera.focal_px / camera.focal_px
    faintest = usual.camera.faintest - 2.0 * math.log10(faster) / STARS_PER_MAGNITUDE
    rate = FIELD_RATE_DEG * faster
    return replace(
        usual, camera=replace(camera, faintest=faintest), slowest_deg=rate, fastest_deg=rate, cameras=1
    )


def _variants(usual: Conditions) -> list[tuple[str, float, Conditions]]:
    """Conditions that differ from the usual ones in one number."""
    pixels, camera = usual.pixels, usual.camera
    return [
        *(("noise_hz", hz, replace(usual, pixels=replace(pixels, noise_hz=hz))) for hz in (0.01, 1.0, 5.0)),
        *(("threshold", c, replace(usual, pixels=replace(pixels, threshold=c))) for c in (0.15, 0.4)),
        *(("faintest", v, replace(usual, camera=replace(camera, faintest=v))) for v in (5.0, 6.0)),
        *(("fov_deg", f, replace(usual, camera=replace(camera, fov_deg=f))) for f in (15.0, 30.0)),
    ]


def _pointing_items(request: Request) -> list[tuple[Any, ...]]:
    if "pointing" not in request.parts:
        return []
    runs = [("pointing", request.seed + n, request.pointing_s, True) for n in range(request.pointing_runs)]
    return [*runs, ("pointing", request.seed, request.pointing_s, False)]


def _work(kind: str, *arguments: Any) -> Any:
    if kind == "window":
        return measure_window(*arguments)
    seed, seconds, star_tracker = arguments
    return point_without_gyroscope(seed, seconds=seconds, star_tracker=star_tracker)


def _table(windows: Sequence[dict[str, Any]], usual: Conditions) -> dict[str, Any]:
    nees = np.array([each["dual"]["nees"] for each in windows if each["dual"]])
    single = np.array([each["single"]["nees"] for each in windows if each["single"]])
    most = float(chi2.ppf(BAND, 3))
    cpu = np.array([each["cpu_s"] for each in windows])
    return {
        **{name: _rms(windows, name) for name in ("single", "dual", "flow", "fused")},
        "nees_inside": float(np.mean(np.append(nees, single) <= most)),
        "nees_mean": {"single": float(np.mean(single)), "dual": float(np.mean(nees))},
        "window_s": usual.window_s,
        "computation_s": {"p50": float(np.median(cpu)), "p99": float(np.percentile(cpu, 99))},
        "events_per_s": float(np.mean([each["events_per_s"] for each in windows])),
        "sky_s": {
            "p50": float(np.median([each["sky_s"] for each in windows])),
            "max": float(max(each["sky_s"] for each in windows)),
        },
        "errors": {
            name: [each[name]["error"] for each in windows if each.get(name)] for name in ("single", "dual")
        },
    }


def _rms(windows: Sequence[dict[str, Any]], name: str) -> dict[str, Any]:
    errors = np.array([each[name]["error"] for each in windows if each.get(name)])
    if not len(errors):
        return {"windows": 0}
    p, q, r = (float(part) for part in np.sqrt(np.mean(errors**2, axis=0)))
    return {
        "rms_p": p, "rms_q": q, "rms_r": r, "cross_axis": math.sqrt(0.5 * (p * p + q * q)), "boresight": r,
        "rss": math.sqrt(p * p + q * q + r * r), "windows": len(errors),
        "median": np.median(np.abs(errors), axis=0).tolist(), "max": np.abs(errors).max(axis=0).tolist(),
    }  # fmt: skip


def _ratio(fov_deg: float, windows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    found = _rms(windows, "single")
    expected = math.sqrt(3.0) / (math.sqrt(2.0) * math.tan(math.radians(0.5 * fov_deg)))
    ratio = found["boresight"] / found["cross_axis"]
    return {"fov_deg": fov_deg, "ratio": ratio, "expected": expected, "off": ratio / expected - 1.0}


def _row(windows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    return {
        "single": _rms(windows, "single"),
        "dual": _rms(windows, "dual"),
        "stars": float(np.median([each["stars"][0] for each in windows])),
        "windows": len(windows),
    }


def _pointing(found: Sequence[dict[str, Any]], items: Sequence[tuple[Any, ...]]) -> dict[str, Any]:
    with_tracker = [each for each, item in zip(found, items, strict=True) if item[-1]]
    without = [each for each, item in zip(found, items, strict=True) if not item[-1]]
    return {
        "episodes": with_tracker,
        "rms_deg": {"median": float(np.median([e["rms_deg"] for e in with_tracker])),
                    "max": max(e["rms_deg"] for e in with_tracker)},
        "max_deg": max(e["max_deg"] for e in with_tracker),
        "without_star_tracker": without,
        "star_tracker": "1 Hz, 5 arcseconds across, 25 about its boresight",
        "seconds": items[0][2],
    }  # fmt: skip
