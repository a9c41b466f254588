"""Each benchmark, interrupted in the middle: it measures what is left and gives the document of an unbroken run."""

from __future__ import annotations

from typing import Any

import pytest

from fulmar_benchmarks.campaign import run
from fulmar_benchmarks.catalogue import choice, rows
from fulmar_benchmarks.pool import figures_of

TIMES = ("computation_s", "sky_s", "wall_s", "command", "steps_per_s", "cpu_s", "update_ms")
SMALL: dict[str, dict[str, Any]] = {
    "drift": {"through": "batch", "episodes": 2, "controllers": "lqr", "rows": "ideal,torque"},
    "events": {"runs": 4, "parts": "table,sensitivity"},
    "inertia": {"satellites": "microsat", "profiles": "sine", "draws": 1},
    "rans3d": {
        "robots": "spacecraft_16", "tasks": "go_to_pose_3d,go_to_position_3d", "controllers": "lqr", "parts": "tasks",
        "episodes": 1,
    },
    "roboran": {"robots": "floating_platform,turtlebot2", "tasks": "go_to_position", "through": "batch", "episodes": 2},
}  # fmt: skip


def without_times(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: without_times(each) for key, each in value.items() if key not in TIMES}
    if isinstance(value, list):
        return [without_times(each) for each in value if not is_time(each)]
    return value


def is_time(value: Any) -> bool:
    """Whether a requirement is of a computing time."""
    return isinstance(value, dict) and str(value.get("name")).endswith("[s]")


@pytest.mark.slow
@pytest.mark.parametrize("name", SMALL)
def test_one_that_is_interrupted_measures_the_rest_and_gives_an_equal_document(name, tmp_path):
    measured: list[str] = []

    def some(cells, *, last: int | None, on_done, **_others):
        for cell in cells[:last]:
            measured.append(cell.name)
            on_done(cell, figures_of(cell, lambda done: None))
        if last is not None:
            raise KeyboardInterrupt

    def asked(folder):
        return rows()[name].load()(choice(name, **SMALL[name], out=tmp_path / folder, report=False))

    def every(cells, **how):
        some(cells, last=None, **how)

    whole = run(asked("whole"), using=every).document
    names, half = tuple(measured), len(measured) // 2
    assert half > 0
    measured.clear()
    with pytest.raises(KeyboardInterrupt):
        run(asked("broken"), using=lambda cells, **how: some(cells, last=half, **how))
    assert without_times(run(asked("broken"), using=every).document) == without_times(whole)
    assert tuple(measured) == names, "each was measured once"
