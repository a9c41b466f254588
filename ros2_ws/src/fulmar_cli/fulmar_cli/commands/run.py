"""`fulmar run`: one recorded run over ROS, and its result."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fulmar_bringup.console import log_line, print_result, write_line
from fulmar_cli.commands import arguments as cli
from fulmar_cli.commands import run_help as text
from fulmar_cli.commands.arguments import flag, option
from fulmar_cli.commands.console_options import with_console
from fulmar_cli.commands.envelope import RequireEnvelopeOption, warn_outside
from fulmar_cli.commands.fleet import OptionalRobot, robot_or_fleet
from fulmar_cli.commands.folders import recorded
from fulmar_cli.commands.inspection import PathOption, ThingOption
from fulmar_cli.commands.origin import OriginOption, read_origin
from fulmar_cli.commands.values import read_area, read_goal, read_guards, read_numbers, read_pose


@with_console
@cli.with_node_options(standing=False)
def run(
    robot: OptionalRobot = None,
    system: Annotated[str | None, option("FLEET", text.SYSTEM_HELP)] = None,
    name: cli.NameOption = None,
    task: Annotated[str | None, option("T", text.RUN_TASK_HELP)] = None,
    controller: Annotated[str | None, option("C", text.CONTROLLER_HELP)] = None,
    backend: Annotated[str, option("B", text.BACKEND_HELP)] = "mujoco",
    hardware: cli.HardwareOption = None,
    emulate: cli.EmulateOption = False,
    arm: cli.ArmOption = False,
    policy: cli.PolicyOption = None,
    goal: Annotated[str | None, option("x,y[,deg]", text.GOAL_HELP)] = None,
    goals: Annotated[str | None, option("NAME", text.GOALS_HELP)] = None,
    velocity: Annotated[str | None, option("V,V,DEG", text.VELOCITY_HELP)] = None,
    height: Annotated[float | None, option("M", text.HEIGHT_HELP, min=0.01)] = None,
    thing: ThingOption = None,
    path: PathOption = None,
    start: Annotated[str | None, option("x,y,deg", text.START_HELP)] = None,
    origin: OriginOption = None,
    duration: Annotated[float | None, option("S", text.DURATION_HELP, min=0.1)] = None,
    lockstep: Annotated[bool, flag("--lockstep", "As fast as possible; one seed, the same bytes.")] = False,
    rate: cli.RateOption = 1.0,
    control_hz: Annotated[
        float | None, option("HZ", "Command rate; the system file's by default.", min=0.01)
    ] = None,
    scenario: cli.ScenarioOption = "nominal",
    calibration: cli.CalibrationOption = None,
    seed: cli.SeedOption = 0,
    record: cli.RecordOption = None,
    estimator: Annotated[str | None, option("NAME", text.ESTIMATOR_HELP)] = None,
    estop: cli.EstopOption = False,
    end_on_estop: Annotated[bool, flag("--end-on-estop", text.END_HELP)] = False,
    fallback: Annotated[str | None, option("C", "Classical controller if the policy is rejected.")] = None,
    trusted_keys: Annotated[
        Path | None, option("FILE|DIR", "Public keys: reject bundles that none of them has signed.")
    ] = None,
    area: Annotated[str | None, option("x,x,y,y", text.AREA_HELP)] = None,
    require_envelope: RequireEnvelopeOption = False,
    guard: Annotated[str | None, option("envelope", text.GUARD_HELP)] = None,
    max_run_time: Annotated[
        float | None, option("S", "Longest acting time [s]; no limit by default.", min=0.1)
    ] = None,
    recording: Annotated[str | None, option("whole|ring", text.RECORDING_HELP)] = None,
    copies: Annotated[
        int, option("N", "Times each command is sent, for networks that lose some.", min=1, max=3)
    ] = 1,
    controller_network: Annotated[
        str, option("NETNS", "Linux network namespace of the controller.", "--controller-in")
    ] = "",
    mocap_hz: Annotated[
        float, option("HZ", "Rate of a simulated motion capture; 200 in the Zero-G Lab.", min=0.0, max=1000.0)
    ] = 0.0,
    remap: Annotated[list[str] | None, option("FROM:=TO", text.REMAP_HELP)] = None,
    adapter: Annotated[str | None, option("NAME", text.ADAPTER_HELP)] = None,
    topic: Annotated[str | None, option("T", "Topic that --adapter takes; the file's by default.")] = None,
    no_guard: Annotated[bool, flag("--no-keep-apart", text.NO_GUARD_HELP)] = False,
    record_each: cli.RecordEachOption = False,
    as_json: cli.JsonOption = False,
    extras: tuple[str, ...] = (),
) -> None:
    """Run a robot once, over ROS, and record it.

    Starts a plant, a controller and a recorder as separate processes, gives the goal, and stops them in order when the
    time is up. The exit code is 0 if the goal was met, 1 if not or if anything failed; `--controller excite`, which
    moves the robot so that `fulmar identify` can estimate its parameters, has no goal to meet.

    Try:

    fulmar run floating_platform --controller lqr --start 3,1,90 --goal 0,0,0

    fulmar run floating_platform --controller policy --lockstep --seed 7

    fulmar run turtlebot2 --task go_through_positions --controller classical

    fulmar run floating_platform --controller classical --goals circle

    fulmar run spacecraft_16 --goal 1,0,-0.5,0,30,90 --lockstep

    fulmar run cubesat_8 --task inspect --thing iss --path spiral --controller pd --lockstep

    fulmar run turtlebot2 --backend hardware --emulate --task go_to_position --seed 3

    fulmar run cubesat_wheels --goal 0,0,90 --lockstep

    fulmar run --system fleet --lockstep
    """
    from fulmar_bringup.completion import completed
    from fulmar_bringup.plan_checks import checked, read_remappings
    from fulmar_bringup.run_plan import RunPlan
    from fulmar_bringup.task_choice import goal_note
    from fulmar_cli.installation.extras import check_plan
    from fulmar_core.robots.robot_file import use_calibration

    asked_of_all = seed, lockstep, rate, duration, record, estop, not no_guard, record_each
    robot = robot_or_fleet(robot, system, asked_of_all, as_json=as_json, require_envelope=require_envelope)
    use_calibration(calibration, robot)
    asked = RunPlan(
        robot, task or "", controller or "", backend, control_hz or 0.0, name=name or "", policy=str(policy or ""),
        hardware=hardware or "", emulated=emulate, arm=arm, goal=read_goal(goal, robot=robot), goals=goals or "",
        velocity=read_numbers(velocity, "--velocity", text.VELOCITY) or (), height=height or 0.0,
        thing=thing or "", along=path or "",
        start=read_pose(start, "--start", robot) or (), duration_s=duration or 0.0,
        origin=read_origin(origin) or (), lockstep=lockstep, rate=rate,
        scenario=scenario, seed=seed, command=cli.invoked_command(), copies=copies, mocap_hz=mocap_hz,
        record=str(record or ""), recording_mode=recording or "",
        guards=read_guards(
            estimator=estimator, estop=estop, fallback=fallback, max_run_time_s=max_run_time,
            trusted_keys=str(trusted_keys) if trusted_keys else None, area=read_area(area), guard=guard,
        ),
        controller_network=controller_network, remappings=tuple(read_remappings(remap or ()).items()),
        adapter=adapter or "", adapter_topic=topic or "", extras=extras, end_on_estop=end_on_estop,
    )  # fmt: skip
    if note := goal_note(asked):
        log_line(note)
    plan = checked(recorded(completed(asked)))
    check_plan(plan)
    warn_outside(plan, required=require_envelope)
    from fulmar_evaluation.run_outcome import run_and_evaluate
    from fulmar_evaluation.run_summary import summary_text

    log_line(plan.line)
    outcome = run_and_evaluate(plan)
    print_result(outcome.summary, lambda summary: write_line(summary_text(summary)), as_json=as_json)
    if outcome.failure:
        log_line(f"run failed: {outcome.failure}")
    raise typer.Exit(outcome.exit_code)
