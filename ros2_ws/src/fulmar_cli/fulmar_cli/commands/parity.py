"""`fulmar parity`: one robot in every simulator."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from fulmar_bringup.console import log_line, print_result, write_line
from fulmar_cli.commands.arguments import (
    TASK_HELP,
    JsonOption,
    PolicyOption,
    RobotArgument,
    ScenarioOption,
    SeedOption,
    option,
)
from fulmar_cli.installation.extras import require


def parity(
    robot: RobotArgument,
    task: Annotated[str | None, option("T", f"{TASK_HELP} The robot's usual one by default.")] = None,
    controller: Annotated[
        str | None, option("C", "What gives the commands; the usual one of robot and task by default.")
    ] = None,
    policy: PolicyOption = None,
    scenario: ScenarioOption = "nominal",
    runs: Annotated[int, option("N", "Runs that every simulator repeats.", min=1, max=256)] = 8,
    duration: Annotated[
        float | None, option("S", "Length of these runs [s]; that of an episode by default.")
    ] = None,
    episodes: Annotated[
        int, option("N", "Episodes of the controller in each simulator; 0: none.", min=0)
    ] = 64,
    seed: SeedOption = 0,
    out: Annotated[
        Path | None, option("DIR", "Write the page parity.md and parity.json into this folder.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compare a robot in the core's dynamics, the mock, MuJoCo, JSBSim (aircraft) and Basilisk (spacecraft).

    The controller drives the core; the others repeat its commands from the same starts in the same worlds, and their
    true states are compared over time, beside the noise of one reading of the robot's odometry. Then the controller
    runs in each simulator by itself, over the same episodes.

    Try:

    fulmar parity floating_platform

    fulmar parity airship_v7 --task fly_hold --controller policy --out runs/parity

    fulmar parity spacecraft_16 --scenario ideal --duration 60 --episodes 0
    """
    require("mujoco", "onnxruntime")
    from fulmar_evaluation.parity.page import lines_of, page_of
    from fulmar_evaluation.parity.parity import ParityRequest, check_request, write_parity
    from fulmar_evaluation.parity.parity import parity as compare

    request = ParityRequest(robot, task, controller, policy, scenario, runs, duration, episodes, seed)
    check_request(request)
    document = compare(request, log_line)
    if out is not None:
        write_parity(document, page_of(document), out)

    def show(document: dict[str, Any]) -> None:
        for line in lines_of(document):
            write_line(line)
        if out is not None:
            write_line(f"page: {out}/parity.md")

    print_result(document, show, as_json=as_json)
