"""`fulmar benchmark throughput`: the speed of the batch simulation beside MuJoCo."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

from fulmar_bringup.console import log_line, output, print_result
from fulmar_bringup.progress import step_bar
from fulmar_cli.commands.arguments import JsonOption, ScenarioOption, option
from fulmar_cli.commands.values import read_names
from fulmar_core.config.errors import ConfigError, UnknownNameError

if TYPE_CHECKING:
    from fulmar_core.robots.robot import Robot
    from fulmar_core.tasks import Task

DEVICES, LIBRARIES = ("cpu", "cuda"), ("compiled", "numpy", "torch")
ROUNDS = 5


def throughput(
    robots: Annotated[str | None, option("R,...", "Names with commas between; all by default.")] = None,
    device: Annotated[str, option("cpu|cuda", "Where the batch is computed; cuda needs torch.")] = "cpu",
    library: Annotated[
        str | None,
        option(
            "compiled|numpy|torch",
            "What computes the batch: on cpu a compiled kernel (which takes torch and g++) or else numpy, on cuda "
            "torch.",
        ),
    ] = None,
    worlds: Annotated[int, option("N", "Worlds of the batch.", min=1)] = 4096,
    task: Annotated[
        str | None,
        option(
            "T", "Task of the batch; go_to_pose by default, in space go_to_pose_3d, of aircraft fly_hold."
        ),
    ] = None,
    scenario: ScenarioOption = "randomised",
    cores: Annotated[
        int, option("N", "Processes of the batch and of JSBSim, and threads of MuJoCo's.", min=1)
    ] = 2,
    seconds: Annotated[float, option("S", "Time of each of the measurements [s].", min=0.05)] = 1.0,
    as_json: JsonOption = False,
) -> None:
    """Measure environment steps a second of the core's batch, of MuJoCo's batch rollout and of JSBSim.

    A step of the batch has all that training needs: disturbances, odometry, observation, reward and new episodes.
    MuJoCo's is physics alone, with its own drag for water. Both are measured in turns in this run, on the same cores;
    the medians are printed. MuJoCo also rolls out ("otherwise") robots on water in the water of the plant, and robots
    in space by Euler's method; the plant has Runge-Kutta's of fourth order. Aircraft fly in JSBSim instead, one in a
    process for each core, in turbulence of its own where the scenario has any.
    Before that a step of each robot is compiled, which takes 10 to 30 s.

    Try:

    fulmar benchmark throughput --robots kingfisher,turtlebot2 --json
    """
    from fulmar_cli.installation.extras import require
    from fulmar_core.config.paths import config_names
    from fulmar_core.worlds.scenario import load_scenario

    library = library or _fastest(device)
    for kind, name, known in (("device", device, DEVICES), ("library", library, LIBRARIES)):
        if name not in known:
            raise UnknownNameError(kind, name, known)
    names = read_names(robots or "all", "robot", config_names("robots"))
    pairs, the_scenario = _pairs(names, task, named=robots is not None), load_scenario(scenario)
    flown = ["jsbsim"] if any(robot.flies for robot, _ in pairs) else []
    require("mujoco", *flown, *([] if library == "numpy" else ["torch"]))
    _check_machine(device, library, worlds, cores)
    from fulmar_benchmarks.throughput import Library, measure
    from fulmar_benchmarks.throughput_table import print_table

    with step_bar("measuring", len(pairs) * ROUNDS) as progress:
        done = iter(range(1, len(pairs) * ROUNDS + 1))
        found = measure(
            pairs,
            the_scenario,
            worlds=worlds,
            library=Library(library, device),
            cores=cores,
            seconds=seconds,
            rounds=ROUNDS,
            progress=lambda: progress(next(done)),
        )
    figures: dict[str, Any] = {
        "robots": found,
        "worlds": worlds,
        "library": library,
        "device": device,
        "task": ", ".join(dict.fromkeys(each.name for _, each in pairs)),
        "scenario": scenario,
        "cores": cores,
    }
    print_result(figures, lambda figures: print_table(figures, output), as_json=as_json)


def _pairs(names: Sequence[str], task: str | None, *, named: bool) -> list[tuple[Robot, Task]]:
    """Robots, each with its task; of a given task those that it fits, unless they were `named`."""
    from fulmar_core.robots.robot_file import load_robot
    from fulmar_core.tasks import load_task

    robots = [load_robot(name) for name in names]
    if task is None:
        return [(robot, load_task(robot.kind.usual_task)) for robot in robots]
    the_task = load_task(task)
    if not named:
        robots = [robot for robot in robots if robot.state_type is the_task.state_type]
    for robot in robots:
        the_task.check(robot)
    return [(robot, the_task) for robot in robots]


def _fastest(device: str) -> str:
    """The fastest library here."""
    from importlib.util import find_spec

    if device != "cpu":
        return "torch"
    if find_spec("torch") is not None:
        from training.kernel import compiler_found

        if compiler_found():
            return "compiled"
    log_line("note: without torch and g++ nothing is compiled; NumPy computes the batch.")
    return "numpy"


def _check_machine(device: str, library: str, worlds: int, cores: int) -> None:
    """Reject counts and a device that the library or this computer does not have."""
    from fulmar_core.simulation.counts import PROCESS_BYTES, WORLD_BYTES, check_count

    check_count("--worlds", worlds, bytes_each=WORLD_BYTES)
    check_count("--cores", cores, bytes_each=PROCESS_BYTES)
    if device != "cuda":
        return
    if library != "torch":
        raise ConfigError("--device cuda needs --library torch.")
    import torch

    if not torch.cuda.is_available():
        raise ConfigError("--device cuda: torch sees no graphics card here.")
