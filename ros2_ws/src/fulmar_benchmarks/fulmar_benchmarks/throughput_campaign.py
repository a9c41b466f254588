"""The pace of every robot's batch beside other simulators', kept robot by robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

from fulmar_benchmarks.shape import ALONE, Benchmark, Cell, Choice, Figures, Found, Progress, known
from fulmar_benchmarks.tables import Entry, Row, Shown, Table
from fulmar_bringup.console import log_line
from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.counts import PROCESS_BYTES, WORLD_BYTES, check_count
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario

DEVICES, LIBRARIES = ("cpu", "cuda"), ("compiled", "numpy", "torch")


@dataclass(frozen=True, kw_only=True)
class ThroughputCell(Cell):
    """One robot."""

    modules = tuple(f"fulmar_benchmarks.{name}" for name in ("throughput", "mujoco_pace", "jsbsim_pace"))
    robot: str
    task: str
    scenario: str
    worlds: int
    library: str
    device: str
    cores: int
    seconds: float

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """As in `throughput.measure`."""
        from fulmar_benchmarks.throughput import Library, measure

        robot, task, scenario = load_robot(self.robot), load_task(self.task), load_scenario(self.scenario)
        return measure(
            robot, task, scenario, worlds=self.worlds, library=Library(self.library, self.device), cores=self.cores,
            seconds=self.seconds, progress=progress,
        )  # fmt: skip


class Throughput(Benchmark):
    """Environment steps a second of the core's batch, of MuJoCo's batch rollout and of JSBSim."""

    name = "throughput"
    title = "Steps a second"

    def __init__(self, choice: Choice) -> None:
        """Choose robots, and what computes them.

        Raises:
            ConfigError: There is no such robot, task or scenario, or this computer does not have what is asked for.
        """
        super().__init__(choice)
        load_scenario(choice.scenario)
        for kind, name, known_ones in (
            ("device", choice.device, DEVICES),
            ("library", choice.library, LIBRARIES),
        ):
            if name is not None and name not in known_ones:
                raise UnknownNameError(kind, name, known_ones)
        self._tasks = tasks_of(choice)
        self._check_machine()

    def cells(self) -> list[ThroughputCell]:
        """Every robot."""
        asked, library = self.choice, library_of(self.choice)
        return [
            ThroughputCell(
                name=f"{robot}_{library}",
                cost=5.0,
                where=ALONE,
                way="mujoco",
                robot=robot,
                task=task,
                scenario=asked.scenario,
                worlds=asked.worlds,
                library=library,
                device=asked.device,
                cores=asked.cores,
                seconds=asked.seconds,
            )
            for robot, task in self._tasks.items()
        ]

    def _check_machine(self) -> None:
        """Reject counts and a device that the library or this computer does not have."""
        check_count("--worlds", self.choice.worlds, bytes_each=WORLD_BYTES)
        check_count("--cores", self.choice.cores, bytes_each=PROCESS_BYTES)
        if self.choice.device != "cuda":
            return
        if self.choice.library not in (None, "torch"):
            raise ConfigError("--device cuda needs --library torch.")
        import torch

        if not torch.cuda.is_available():
            raise ConfigError("--device cuda: torch sees no graphics card here.")

    def document(self, found: Found) -> dict[str, Any]:
        """Paces by robot."""
        cells = self.cells()
        for cell in cells:
            if isinstance(found[cell.name], str) and str(found[cell.name]).startswith("ConfigError: "):
                raise ConfigError(str(found[cell.name]).removeprefix("ConfigError: "))
        return {
            "robots": {cell.robot: known(found, cell.name) for cell in cells},
            **{key: getattr(self.choice, key) for key in ("worlds", "device", "scenario", "cores")},
            "library": cells[0].library,
            "task": ", ".join(dict.fromkeys(cell.task for cell in cells)),
        }

    def tables(self, document: Mapping[str, Any]) -> list[Shown]:
        """A row for each robot, and how MuJoCo integrates them."""
        title = " · ".join(
            (f"steps/s · {document['worlds']:,} worlds", *(document[key] for key in ("task", "scenario")),
             f"{document['library']} on {document['device']}", f"{document['cores']} cores")
        )  # fmt: skip
        robots = document["robots"]
        rows = [
            Row(
                tuple(
                    map(
                        Entry,
                        (name, f"{one['batch_steps_per_s']:,.0f}", *_with_mujoco(one), *_otherwise(one)),
                    )
                )
            )
            for name, one in robots.items()
        ]
        by_method: dict[str, list[str]] = {}
        for name, one in robots.items():
            if "ratio" in one:
                method = f"{one['mujoco_integrator']}, steps of {one['mujoco_step_s']:g} s"
                by_method.setdefault(method, []).append(name)
        notes = [f"MuJoCo of {', '.join(names)}: {method}" for method, names in by_method.items()]
        return [Table(title, ("robot", "batch", "MuJoCo", "ratio", "otherwise", "ratio then"), rows), *notes]

    def said(self, cell: Cell, figures: Figures) -> str:
        """Its pace."""
        return f"{figures['batch_steps_per_s']:,.0f} steps/s"


def tasks_of(choice: Choice) -> dict[str, str]:
    """Task of each robot; of a given task those robots that it fits, unless they were named.

    Raises:
        ConfigError: A robot that was named cannot do the task.
    """
    robots = [load_robot(name) for name in choice.robots or config_names("robots")]
    if choice.task is None:
        return {robot.name: robot.kind.usual_task for robot in robots}
    task = load_task(choice.task)
    if choice.robots is None:
        robots = [robot for robot in robots if robot.state_type is task.state_type]
    for robot in robots:
        task.check(robot)
    return {robot.name: choice.task for robot in robots}


def needs(choice: Choice) -> list[str]:
    """Modules of extras."""
    jsbsim = ["jsbsim"] if any(load_robot(robot).flies for robot in tasks_of(choice)) else []
    return ["mujoco", *jsbsim, *([] if library_of(choice, quiet=True) == "numpy" else ["torch"])]


def library_of(choice: Choice, *, quiet: bool = False) -> str:
    """What was asked for, or the fastest library here."""
    if choice.library is not None or choice.device != "cpu":
        return str(choice.library or "torch")
    if find_spec("torch") is not None:
        from training.kernel import compiler_found

        if compiler_found():
            return "compiled"
    if not quiet:
        log_line("note: without torch and g++ nothing is compiled; NumPy computes the batch.")
    return "numpy"


def _with_mujoco(found: Mapping[str, Any]) -> tuple[str, str]:
    """Figures of MuJoCo's rollout; none of aircraft."""
    if "ratio" not in found:
        return "", ""
    return f"{found['mujoco_steps_per_s']:,.0f}", f"{found['ratio']:.1f}"


def _otherwise(found: Mapping[str, Any]) -> tuple[str, str]:
    """Figures of robots on water, in space and in the air; none for others."""
    for pace, ratio, how in (
        ("mujoco_with_water_steps_per_s", "ratio_with_water", "in water"),
        ("mujoco_euler_steps_per_s", "ratio_with_euler", "Euler"),
        ("jsbsim_steps_per_s", "ratio_with_jsbsim", "JSBSim"),
    ):
        if ratio in found:
            return f"{how} {found[pace]:,.0f}", f"{found[ratio]:.1f}"
    return "", ""
