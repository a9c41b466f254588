"""The whole benchmark of event-based rates: random windows, fields of view, sensitivities, and pointing on them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import chi2

from fulmar_benchmarks.events.pointing import point_without_gyroscope
from fulmar_benchmarks.events.random_windows import Conditions, measure_window
from fulmar_benchmarks.shape import Benchmark, Cell, Check, Figures, Found, Progress, known
from fulmar_core.robots.sensors.catalogue import load_stars

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
NAMES = {
    "single": "one camera",
    "dual": "two cameras",
    "flow": "local flow, one",
    "fused": "thesis §6.4.5, two",
}
SPANS = ((0.005, 0.02), (0.02, 0.1), (0.1, 2.0), (2.0, 10.0), (10.0, 20.0))  # of rates [deg/s]

PER_CELL = 10  # windows
REQUIRED_INSIDE = (0.90, 0.99)  # share of windows whose normalised error squared is inside its band
MOST_OFF = 0.15  # of the ratio of errors from what is expected of a field of view
MOST_SKY_S, MOST_POINTING_DEG = 1.0, 0.1


@dataclass(frozen=True, kw_only=True)
class WindowCell(Cell):
    """Some random windows of one group."""

    modules = (f"{__package__}.random_windows",)
    conditions: Conditions
    seed: int
    first: int  # number of the first window
    count: int

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """Every window, as in `measure_window`."""
        numbers = range(self.first, self.first + self.count)
        return {"windows": [measure_window(self.conditions, self.seed, number) for number in numbers]}


@dataclass(frozen=True, kw_only=True)
class PointingCell(Cell):
    """One episode of pointing."""

    modules = (f"{__package__}.pointing",)
    seed: int
    seconds: float
    star_tracker: bool

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """As in `point_without_gyroscope`."""
        return point_without_gyroscope(
            self.seed,
            seconds=self.seconds,
            star_tracker=self.star_tracker,
            progress=lambda s: progress(2.0 * s),
        )


class Events(Benchmark):
    """Random windows, fields of view, sensitivities, and pointing on event rates."""

    name = "events"
    title = "Turn rate from the events of stars"
    report = "fulmar_benchmarks.events.report:plots"

    def check(self) -> None:
        """Refuse to begin without a catalogue of stars."""
        load_stars()

    def cells(self) -> list[Cell]:
        """Windows of every part that is asked for, and episodes of pointing."""
        windows = [cell for group in self._groups().values() for cell in group]
        return [*windows, *self._pointing()]

    def _groups(self) -> dict[tuple[str, Any], list[WindowCell]]:
        usual, runs, parts = Conditions(), self.choice.runs, self.choice.parts
        few = max(4, runs // 4)
        groups: dict[tuple[str, Any], tuple[Conditions, int]] = {}
        if "table" in parts:
            groups["table", ""] = usual, runs
        if "fields" in parts:
            groups |= {("fields", fov): (_at_field(usual, fov), FIELD_WINDOWS * runs) for fov in FIELDS_DEG}
        if "sensitivity" in parts:
            for name, value, changed in _variants(usual):
                groups["sensitivity", f"{name} {value:g}"] = changed, few
        if "slow_and_fast" in parts:
            for low, high in SPANS:
                window = 1.0 if high <= 0.1 else 0.2 if high <= 2.0 else 0.1
                changed = replace(usual, slowest_deg=low, fastest_deg=high, window_s=window)
                groups["slow_and_fast", f"{low:g} to {high:g}"] = changed, few
        return {
            key: [
                WindowCell(
                    name="_".join((*str(key[1]).split(), key[0], str(first))),
                    cost=float(PER_CELL),
                    conditions=each,
                    seed=self.choice.seed,
                    first=first,
                    count=min(PER_CELL, count - first),
                )
                for first in range(0, count, PER_CELL)
            ]
            for key, (each, count) in groups.items()
        }

    def _pointing(self) -> list[PointingCell]:
        if "pointing" not in self.choice.parts:
            return []
        seed, seconds = self.choice.seed, self.choice.pointing_s
        every = [(seed + n, True) for n in range(self.choice.pointing_runs)] + [(seed, False)]
        return [
            PointingCell(
                name=f"pointing_{one}{'' if tracker else '_without_star_tracker'}", cost=2.0 * seconds, way="mujoco",
                seed=one, seconds=seconds, star_tracker=tracker,
            )
            for one, tracker in every
        ]  # fmt: skip

    def document(self, found: Found) -> dict[str, Any]:
        """See `fulmar benchmark events --help`."""
        windows = {
            key: [window for cell in group for window in known(found, cell.name)["windows"]]
            for key, group in self._groups().items()
        }
        choice, parts = self.choice, self.choice.parts
        document: dict[str, Any] = {"runs": choice.runs, "seed": choice.seed, "band": BAND, "thesis": THESIS}
        if "table" in parts:
            document |= _table(windows["table", ""], Conditions())
        if "fields" in parts:
            document["fov_ratio"] = [_ratio(fov, windows["fields", fov]) for fov in FIELDS_DEG]
        for part in ("sensitivity", "slow_and_fast"):
            if part in parts:
                document[part] = {name: _row(each) for (of, name), each in windows.items() if of == part}
        if episodes := self._pointing():
            document["pointing"] = _pointing(episodes, [known(found, cell.name) for cell in episodes])
        return document

    def checks(self, document: Mapping[str, Any]) -> list[Check]:
        """What is required of errors, consistency and computing time; of what was measured."""
        found = []
        if "single" in document:
            for name, row in document["thesis"].items():
                what = f"{NAMES[name]}: root of the sum of squares, thesis Table 6.2 [deg/s]"
                found.append(Check.most(what, document[name].get("rss"), row["rss"]))
            inside, what = document["nees_inside"], "windows whose normalised error is inside its band"
            found += [
                Check.least(what, inside, REQUIRED_INSIDE[0]),
                Check.most(what, inside, REQUIRED_INSIDE[1]),
            ]
            window_s, p99 = document["window_s"], document["computation_s"]["p99"]
            found.append(Check.most("computation of a window, p99 [s]", p99, window_s))
            found.append(
                Check.most("a second of one camera's sky, median [s]", document["sky_s"]["p50"], MOST_SKY_S)
            )
        found += [
            Check.most(
                f"field of view {row['fov_deg']:g} deg: ratio of errors off", abs(row["off"]), MOST_OFF
            )
            for row in document.get("fov_ratio", ())
        ]
        if "pointing" in document:
            worst = document["pointing"]["max_deg"]
            found.append(
                Check.most("pointing without a gyroscope, largest error [deg]", worst, MOST_POINTING_DEG)
            )
        return found

    def tables(self, document: Mapping[str, Any]) -> list[str]:
        """Lines for a terminal; rates in °/s."""
        return [*lines(document), *self.check_lines(document)]


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


def _pointing(cells: Sequence[PointingCell], found: Sequence[dict[str, Any]]) -> dict[str, Any]:
    with_tracker = [each for each, cell in zip(found, cells, strict=True) if cell.star_tracker]
    without = [each for each, cell in zip(found, cells, strict=True) if not cell.star_tracker]
    return {
        "episodes": with_tracker,
        "rms_deg": {"median": float(np.median([e["rms_deg"] for e in with_tracker])),
                    "max": max(e["rms_deg"] for e in with_tracker)},
        "max_deg": max(e["max_deg"] for e in with_tracker),
        "without_star_tracker": without,
        "star_tracker": "1 Hz, 5 arcseconds across, 25 about its boresight",
        "seconds": cells[0].seconds,
    }  # fmt: skip


def lines(document: Mapping[str, Any]) -> list[str]:
    """Lines for a terminal; rates in °/s."""
    found = []
    if "single" in document:
        found.append(
            f"errors of {document['runs']} windows, RMS °/s" + 11 * " " + "p        q        r        RSS"
        )
        for name, what in NAMES.items():
            found.append(f"  {what:28}" + _rates(document[name]))
        for name, row in document["thesis"].items():
            found.append(f"  {'thesis, ' + NAMES[name]:28}" + _rates(row))
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
                + _rates(row["single"])
                + ", two"
                + _rates(row["dual"])
            )
    if "pointing" in document:
        found += _pointing_lines(document["pointing"])
    return found


def _rates(row: Mapping[str, Any]) -> str:
    if not row.get("windows", 1):
        return "  nothing found"
    return "".join(f" {row[key]:8.5f}" for key in ("rms_p", "rms_q", "rms_r", "rss"))


def _pointing_lines(found: Mapping[str, Any]) -> list[str]:
    rms = found["rms_deg"]
    without = found["without_star_tracker"][0]
    return [
        f"  nadir pointing without a gyroscope, {found['seconds']:.0f} s, {len(found['episodes'])} episodes: RMS "
        f"{rms['median']:.4f}°, at most {rms['max']:.4f}°; largest error {found['max_deg']:.4f}°",
        f"  star tracker: {found['star_tracker']}",
        f"  without it after the first minute: {without['end_deg']:.3f}° off in the end",
    ]
