"""Digests of small documents of the benchmarks, without what a machine and a moment leave in them."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from typing import Any

from tests.freeze.digest import digest

SMALL = {
    "drift": "--through batch --rows ideal --episodes 4",
    "roboran": "--through batch --robots floating_platform --tasks go_to_pose --episodes 4",
    "rans3d": "--parts tasks --robots spacecraft_16 --tasks go_to_pose_3d --scenarios nominal --episodes 2",
    "falcon": "--tasks hold --controllers lqi,policy --scenarios calm --episodes 1",
    "events": "--parts table --runs 4",
    "inertia": "--satellites cubesat_wheels --profiles sine --draws 1",
    "descent": "--through batch --heights 1 --flights 2",
}
OF_THE_MACHINE = (
    "checks", "command", "computation_s", "events_per_s", "fulmar_version", "git_revision", "libraries", "machine",
    "sky_s", "steps_per_s", "wall_s",
)  # fmt: skip
DEPTH = 3  # of the keys that a row has


def documents(name: str) -> dict[str, str]:
    """The document of a benchmark, by the first keys of its parts."""
    with tempfile.TemporaryDirectory(prefix="fulmar_freeze_") as folder:
        kept = ["--no-report", "--out", folder, "--jobs", "1", "--json"]
        asked = ["benchmark", name, *SMALL[name].split(), *kept]
        done = subprocess.run(
            [sys.executable, "-m", "fulmar_cli.main", *asked], stdout=subprocess.PIPE, text=True, check=False
        )
    # A benchmark of a few episodes may miss its requirements, and says so with its exit code.
    return {path: digest(part) for path, part in _parts(_without_moment(json.loads(done.stdout)))}


def _without_moment(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_moment(each) for key, each in value.items() if key not in OF_THE_MACHINE}
    return [_without_moment(each) for each in value] if isinstance(value, list) else value


def _parts(value: Any, path: str = "", depth: int = DEPTH) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict) and depth:
        for key, each in value.items():
            yield from _parts(each, f"{path} {key}".strip(), depth - 1)
    else:
        yield path, value
