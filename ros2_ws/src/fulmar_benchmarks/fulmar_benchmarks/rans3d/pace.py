"""How fast the batch of the spacecraft steps, with NumPy and compiled, beside MuJoCo's rollout in the same run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

from fulmar_benchmarks.rans3d.targets import RANDOMISED, ROBOTS
from fulmar_benchmarks.shape import ALONE, Cell, Figures, Progress
from fulmar_benchmarks.throughput import ROUNDS, Library, measure
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario

TASK = "go_to_pose_3d"
LIBRARIES = ("numpy", "compiled")


@dataclass(frozen=True, kw_only=True)
class PaceCell(Cell):
    """The pace of the batch with every library."""

    modules = tuple(f"fulmar_benchmarks.{name}" for name in ("throughput", "mujoco_pace"))
    worlds: int
    cores: int
    seconds: float

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """As in `measure_pace`."""
        return measure_pace(
            worlds=self.worlds,
            cores=self.cores,
            seconds=self.seconds,
            progress=lambda done, of: progress(done / of),
        )


def pace_cell(worlds: int, cores: int, seconds: float) -> PaceCell:
    """A cell with its name; alone, and last."""
    return PaceCell(name="throughput", where=ALONE, way="mujoco", worlds=worlds, cores=cores, seconds=seconds)


def measure_pace(
    *, worlds: int, cores: int, seconds: float, progress: Callable[[float, float], None]
) -> dict[str, Any]:
    """Measure the batch with every disturbance of `randomised`.

    Args:
        worlds: Of the batch.
        cores: Processes of the batch, and threads of MuJoCo's rollout.
        seconds: Of each measurement [s].
        progress: Called with how much is done, and of how much.

    Returns:
        JSON-ready: what was measured, and by library the figures of `throughput.measure`, or null with a `reason`.
    """
    robot, task, scenario = load_robot(ROBOTS[0]), load_task(TASK), load_scenario(RANDOMISED)
    found: dict[str, Any] = {
        "robot": robot.name,
        "task": task.name,
        "scenario": RANDOMISED,
        "worlds": worlds,
        "cores": cores,
    }
    for number, name in enumerate(LIBRARIES):
        reason, done = why_not(name), float(number * ROUNDS)

        def further(rounds: float, done: float = done) -> None:
            progress(done + rounds, float(len(LIBRARIES) * ROUNDS))

        found[name] = None
        if reason:
            found["reason"] = reason
            continue
        found[name] = measure(
            robot,
            task,
            scenario,
            worlds=worlds,
            library=Library(name),
            cores=cores,
            seconds=seconds,
            progress=further,
        )
    return found


def why_not(library: str) -> str:
    """Why a library cannot compute here; empty where it can."""
    if library == "numpy":
        return ""
    if find_spec("torch") is None:
        return "nothing is compiled without torch"
    from training.kernel import compiler_found

    return "" if compiler_found() else "nothing is compiled without g++ and Python's headers (python3-dev)"
