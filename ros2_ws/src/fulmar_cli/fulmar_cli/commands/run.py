"""`fulmar run`: one run over ROS, recorded, with a verdict."""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from fulmar_bringup.console import console, output, print_json
from fulmar_cli.commands.arguments import (
    Area,
    ArmOption,
    CalibrationOption,
    ControllerOption,
    JsonOption,
    NameOption,
    PolicyOption,
    RobotArgument,
    ScenarioOption,
    SeedOption,
    read_area,
    read_goal,
    read_pose,
)
from fulmar_core.errors import DONE, ConfigError


def run(
    robot: RobotArgument,
    name: NameOption = None,
    task: Annotated[
        str | None,
        typer.Option(
            metavar="T",
            help="A name from `fulmar list tasks`, or your own class: mypackage.mymodule:MyTask; by default what "
            "--goal asks for: go_to_position for x,y, go_to_pose for x,y,deg and without a goal; with --goals, the one "
            "that takes them.",
        ),
    ] = None,
    controller: ControllerOption = "policy",
    backend: Annotated[
        str, typer.Option(metavar="B", help="mujoco, mock (our own dynamics, perfect sensors) or hardware.")
    ] = "mujoco",
    hardware: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="With --backend hardware: a name from configs/hardware, or a .yaml file; the robot's own by default.",
        ),
    ] = None,
    emulate: Annotated[
        bool,
        typer.Option("--emulate", help="With --backend hardware: an emulator speaks for the device."),
    ] = False,
    arm: ArmOption = False,
    policy: PolicyOption = None,
    goal: Annotated[
        str | None,
        typer.Option(
            metavar="x,y[,deg]",
            help="Where to go, with a heading or without; drawn from the seed by default; so are many targets.",
        ),
    ] = None,
    goals: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Goals one after another, or a path to follow: a name from `fulmar list goals`, or a .yaml file.",
        ),
    ] = None,
    start: Annotated[
        str | None, typer.Option(metavar="x,y,deg", help="Where to begin; drawn from the seed by default.")
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(metavar="S", min=0.1, help="Simulated seconds; the task's episode by default."),
    ] = None,
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="As fast as it goes; one seed gives the same bytes.")
    ] = False,
    rate: Annotated[
        float, typer.Option(metavar="F", min=0.01, max=50.0, help="Simulated seconds a second of wall-clock.")
    ] = 1.0,
    control_hz: Annotated[
        float | None, typer.Option(metavar="HZ", min=0.01, help="Command rate; the system file's by default.")
    ] = None,
    scenario: ScenarioOption = "nominal",
    calibration: CalibrationOption = None,
    seed: SeedOption = 0,
    record: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of the bag; runs/<time>... by default.")
    ] = None,
    estimator: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Take odometry from poses and inertial readings: a name from configs/estimators.",
        ),
    ] = None,
    estop: Annotated[
        bool,
        typer.Option("--estop", help="Run an e-stop node; nothing moves without it. See `fulmar estop`."),
    ] = False,
    end_on_estop: Annotated[
        bool,
        typer.Option(
            "--end-on-estop",
            help="An e-stop ends the run, which then failed; by default the robot waits for a reset and a new goal.",
        ),
    ] = False,
    fallback: Annotated[
        str | None,
        typer.Option(metavar="C", help="Classical controller that takes over when the policy is refused."),
    ] = None,
    trusted_keys: Annotated[
        Path | None,
        typer.Option(metavar="FILE|DIR", help="Public keys: run no bundle that none of them has signed."),
    ] = None,
    area: Annotated[
        str | None,
        typer.Option(
            metavar="x,x,y,y",
            help="x_min, x_max, y_min, y_max that the robot must not leave [m]: --area=-2,2,-1,1.",
        ),
    ] = None,
    max_run_time: Annotated[
        float | None,
        typer.Option(
            metavar="S", min=0.1, help="Acting seconds after which the robot stops; none by default."
        ),
    ] = None,
    recording: Annotated[
        str | None,
        typer.Option(
            metavar="whole|ring",
            help="whole: every message. ring: the last 30 s stay in memory and are written only when a fault shows "
            "(an error of plant or controller, the watchdog, the e-stop), with 5 s after it; without one there is "
            "no bag and no verdict on the goal, and the exit code is 0. The system file's `recorder:` by default.",
        ),
    ] = None,
    copies: Annotated[
        int,
        typer.Option(
            metavar="N", min=1, max=3, help="Send each command so often, where a network loses some."
        ),
    ] = 1,
    controller_network: Annotated[
        str,
        typer.Option(
            "--controller-in",
            metavar="NETNS",
            help="Network namespace of Linux that the controller runs in, as on another computer.",
        ),
    ] = "",
    mocap_hz: Annotated[
        float,
        typer.Option(
            "--mocap-hz",
            metavar="HZ",
            min=0.0,
            max=1000.0,
            help="Simulate a motion capture beside the odometry, so often; 200 in the Zero-G Lab.",
        ),
    ] = 0.0,
    remap: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FROM:=TO",
            help="Another name for mocap/pose, odom, imu/data, ground_truth/odom or a command topic, for every node; "
            "the bag keeps the usual one. Give it once for each topic.",
        ),
    ] = None,
    adapter: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="With --controller external: take commands as the driver of this hardware file sends them, and pass "
            "them on to the plant. A name from configs/hardware, or a .yaml file.",
        ),
    ] = None,
    topic: Annotated[
        str | None,
        typer.Option(metavar="T", help="Topic that --adapter takes; the file's by default."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Run a robot once, over ROS, and record it.

    Starts a plant, a controller and a recorder as processes of their own, gives the goal, and stops them in order
    when the time is up. The exit code is 0 if the goal was met, 1 if not or if anything failed; `--controller excite`,
    which only moves about so that `fulmar identify` has something to learn from, needs no goal to be met.

    Try:

    fulmar run floating_platform --controller lqr --start 3,1,90 --goal 0,0,0

    fulmar run floating_platform --controller policy --lockstep --seed 7

    fulmar run turtlebot2 --task go_through_positions --controller classical

    fulmar run floating_platform --controller classical --goals circle

    fulmar run turtlebot2 --backend hardware --emulate --task go_to_position --seed 3

    fulmar run floating_platform --controller lqr --duration 3600 --recording ring

    fulmar run turtlebot2 --task go_to_position --controller external

    fulmar run floating_platform --name alpha --controller lqr
    """
    if lockstep and rate != 1.0:
        raise ConfigError("--lockstep runs as fast as it goes; it takes no --rate.")
    from fulmar_bringup.goal_plan import check_heading, default_task, task_of_goals
    from fulmar_bringup.planning import plan_run
    from fulmar_bringup.system import gains_note, modules_of
    from fulmar_cli.extras import require
    from fulmar_core.robot import use_calibration
    from fulmar_evaluation.run_outcome import run_and_evaluate
    from policy_server.controllers import controller_entry

    use_calibration(calibration, robot)
    place = read_goal(goal)
    if task is None:
        task = (
            task_of_goals(goals)
            if goals
            else default_task(robot, controller, backend, goal=place, policy=policy)
        )
    elif place is not None and (note := check_heading(task, place)):
        console.print(note, markup=False)
    request = plan_run(
        robot=robot,
        name=name,
        task=task,
        controller=controller,
        backend=backend,
        policy=policy,
        goal=(place[0], place[1], place[2] if len(place) > 2 else 0.0) if place else None,
        start=read_pose(start, "--start"),
        duration_s=duration,
        lockstep=lockstep,
        rate=rate,
        control_hz=control_hz,
        scenario=scenario,
        seed=seed,
        record=record or default_record(name or robot, controller),
        command="fulmar " + " ".join(sys.argv[1:]),
        goals=goals,
        hardware=hardware,
        emulate=emulate,
        arm=arm,
        guards=asked_guards(estimator, estop, fallback, trusted_keys)
        | asked_limits(read_area(area), max_run_time),
        recording=recording,
        copies=copies,
        controller_network=controller_network,
        mocap_hz=mocap_hz,
        remap=remap or (),
        adapter=adapter,
        topic=topic,
    )
    plan = request.plan
    for note in {gains_note(robot, name): None for name in (controller, plan.guards.fallback)}:
        if note:
            console.print(f"info: {note}", markup=False, soft_wrap=True)
    require(  # the nodes would fail for want of them one by one
        *modules_of(controller, backend, guards=plan.guards, hardware=plan.hardware, emulated=emulate)
    )
    outcome = run_and_evaluate(replace(request, end_on_estop=end_on_estop))
    if as_json:
        print_json(outcome.summary)
    else:
        output.print(verdict(outcome.summary))
    if outcome.failure:
        console.print(f"run failed: {outcome.failure}", markup=False)
    aimless = not controller_entry(controller).strives and not outcome.failure
    raise typer.Exit(DONE if aimless else outcome.exit_code)


def asked_guards(
    estimator: str | None, estop: bool, fallback: str | None, trusted_keys: Path | None
) -> dict[str, Any]:
    """The guards that were asked for, by name."""
    asked = {
        "estimator": estimator,
        "estop": estop or None,
        "fallback": fallback,
        "trusted_keys": str(trusted_keys) if trusted_keys else None,
    }
    return {key: value for key, value in asked.items() if value is not None}


def asked_limits(area: Area | None, max_run_time: float | None) -> dict[str, Any]:
    """The limits of the run that were asked for, by name of their guard."""
    asked = {"area": area, "max_run_time_s": max_run_time}
    return {key: value for key, value in asked.items() if value is not None}


def default_record(name: str, controller: str) -> Path:
    """A folder below `runs/` that says when and what, by the name of the robot."""
    return Path("runs") / f"{time.strftime('%Y%m%d_%H%M%S')}_{name}_{controller.rpartition(':')[2]}"


TOLD = {
    "final_position_error_m": "{:.3f} m off",
    "final_heading_error_deg": "{:.1f}° off",
    "goals_reached": "{:.0f} targets reached",
    "velocity_error_m_s": "velocity {:.3f} m/s off",
    "yaw_rate_error_deg_s": "turn rate {:.1f}°/s off",
    "path_error_m": "path {:.3f} m off",
    "goals_progress": "{}",
}


def told_figure(summary: dict[str, Any], name: str) -> str:
    """One figure in words, empty where there is none."""
    return "" if summary[name] is None else TOLD[name].format(summary[name])


def verdict(summary: dict[str, Any]) -> str:
    """One run in a few lines."""
    from policy_server.controllers import controller_entry

    if summary["success"] is None:
        return f"{summary['controller']}: no fault, so the ring of the recorder was not written; no verdict on the goal"
    if controller_entry(summary["controller"]).strives:
        reached = "goal met" if summary["success"] else "goal missed"
        if summary["success"] and summary["time_to_target_s"] is not None:
            reached += f" after {summary['time_to_target_s']:.1f} s"
    else:
        reached = "drove about"
    latency = summary["latency_ms"]
    told = [words for words in (told_figure(summary, name) for name in TOLD) if words]
    told += ["touched an obstacle"] if summary["collided"] else []
    length = f"; length of the run {summary['duration_s']:.0f} s"
    lines = [f"{summary['controller']}: {', '.join([reached, *told])}{length}"]
    if summary["steps"]:
        answers = latency["p50"] is not None
        spread = f", latency p50 {latency['p50']:.2f} ms, p99 {latency['p99']:.2f} ms" if answers else ""
        counts = [(summary[key], key) for key in ("overruns", "watchdog_trips")]
        known = ", ".join(f"{count} {key.replace('_', ' ')}" for count, key in counts if count is not None)
        lines.append(f"  {summary['steps']} commands{spread}" + (f"; {known}" if known else ""))
    lines += [f"  warning: {warning}" for warning in summary["warnings"]]
    if summary["believed_dead"]:
        lines.append(f"  believed dead: {', '.join(summary['believed_dead'])}")
    if summary["beliefs"]:
        lines.append(f"  at the end: {summary['beliefs']}")
    if summary["bag"] is None:
        lines.append("  nothing was recorded")
    else:
        lines.append(f"  recorded in {summary['bag']}; look at it with: fulmar report {summary['bag']}")
    return "\n".join(lines)
