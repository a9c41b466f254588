"""`fulmar bag rerun`: the answers of a controller to a recorded run, compared with the recorded ones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from fulmar_bags.bag_reading import BagReading
from fulmar_bringup.console import print_result, warn, write_line
from fulmar_cli.commands.arguments import BagArgument, JsonOption, OdometryOption, PolicyOption, option
from fulmar_cli.commands.bag_reading import with_bag_options
from fulmar_cli.commands.damage import finish
from fulmar_cli.commands.values import read_pose

SHOWN = 12  # lines of fields that differ


@with_bag_options()
def rerun(
    bag: BagArgument,
    controller: Annotated[
        str | None, option("C", "policy, lqr, classical, ...; by default the one that was recorded.")
    ] = None,
    policy: PolicyOption = None,
    source: Annotated[
        str,
        option(
            "observations|odometry",
            "Feed the recorded observations, or make them anew from odometry and goals, gates included.",
            "--from",
        ),
    ] = "observations",
    through: Annotated[
        str, option("direct|node", "Call the controller, or run the live node in lock step.")
    ] = "direct",
    tolerance: Annotated[
        list[str] | None,
        option(
            "[FIELD=]X",
            "Largest difference that counts as the same, for all fields or for one of decision, observation, "
            "action, command; 0, the same bits, by default. May be repeated.",
        ),
    ] = None,
    goal: Annotated[
        str | None, option("x,y,deg", "The goal, for a bag that holds none; in space x,y,z,roll,pitch,yaw.")
    ] = None,
    control_hz: Annotated[
        float | None, option("HZ", "Command rate, if the bag does not say it.", min=0.01)
    ] = None,
    odometry: OdometryOption = None,
    out: Annotated[Path | None, option("FILE", "Write the answers, step by step: .csv or .npz.")] = None,
    as_json: JsonOption = False,
    *,
    reading: BagReading,
) -> None:
    """Let a controller answer a recorded run, and compare its answers with the recorded ones, field by field.

    The controller receives each step as it was recorded, whatever it answered before; goals, pauses and jumps of time
    reset it, as in the node. Bags of other recorders are fed from odometry and need --robot, --task and mostly --goal;
    without recorded actions there is nothing to compare, and --out has the answers.

    Exit code: 0 all fields are the same within the tolerance, 1 one differs, nothing could be compared or part of the
    bag could not be read, 2 the bag cannot be read.

    Try: fulmar bag rerun runs/demo_x/policy --controller policy --policy runs/bundles/mine
    """
    from fulmar_bags.comparison import read_tolerances
    from fulmar_bags.contents import open_bag
    from fulmar_bags.run_record import check_one_robot
    from fulmar_evaluation.rerun.rerun_bag import RerunRequest, rerun_bag
    from fulmar_evaluation.rerun.rerun_result import FIELDS

    pose = read_pose(goal, "--goal")
    request = RerunRequest(
        controller, policy, source, through, reading.robot, reading.task, pose, control_hz, odometry, out
    )  # fmt: skip
    tolerances = read_tolerances(tolerance or [], FIELDS)
    opened = open_bag(bag, reading)
    check_one_robot(opened)
    request = replace(request, robot=opened.reading.robot)
    request.check(foreign=opened.info is None)
    result: dict[str, Any] = {"bag": str(bag), **rerun_bag(opened, request, tolerances, warn)}
    sums = result.pop("sums")
    print_result(result, lambda result: _show(result, sums), as_json=as_json)
    raise finish(opened, good=result["same"])


def _show(result: dict[str, Any], sums: list[dict[str, Any]]) -> None:
    write_line(
        f"{result['bag']}: {result['steps']} steps of {result['robot']}, {result['task']}; "
        f"'{result['controller']}' answered {result['asked']} of them, in {result['elapsed_s']:.2f} s"
    )
    if result["sha256"] and result["recorded_sha256"]:
        same = result["sha256"] == result["recorded_sha256"]
        write_line("the same controller as recorded" if same else "another controller than recorded")
    recorded = len(result["recorded_sha256s"])
    if recorded > 1:
        write_line(f"the run used {recorded} controllers one after another; compared with the first of them")
    for each in result["not_asked"][:SHOWN]:
        write_line(f"  not asked at {each['steps']} steps, from step {each['first_step']}: {each['reason']}")
    if result["answers"]:
        write_line(f"answers written: {result['answers']}")
    if not result["compared"]:
        write_line("the bag holds no answers to compare with")
        return
    if result["trips"] is not None:
        its = result["trips"]
        same = "the same" if its["same"] else "not the same"
        write_line(f"trips and returns of the guard: {its['recorded']} recorded, {its['found']} now, {same}")
    for each in sums:
        count = "the same" if not each["differing"] else f"{each['differing']} numbers differ"
        write_line(
            f"  {each['field']:<12} {each['steps']:>7} steps  {count}, largest difference {each['largest']:.3g}"
        )
    first = result["first_difference"]
    if first is None:
        write_line("same")
        return
    write_line(
        f"first difference: step {first['first_step']}, odom of t = {first['first_stamp_s']:.3f} s, "
        f"{first['field']} {first['name']}: recorded {_number(first['recorded'])}, now {_number(first['found'])}"
    )
    _show_differences([each for each in result["fields"] if each["differing"]])


def _show_differences(fields: list[dict[str, Any]]) -> None:
    for each in fields[:SHOWN]:
        spread = each["difference"] or {"p50": 0.0, "p99": 0.0, "max": 0.0}
        write_line(
            f"  {each['field']} {each['name']}: {each['differing']} of {each['compared']} differ, from step "
            f"{each['first_step']}; median {spread['p50']:.3g}, p99 {spread['p99']:.3g}, largest {spread['max']:.3g}"
        )
    if len(fields) > SHOWN:
        write_line(f"  ... and {len(fields) - SHOWN} more; --json has them all")


def _number(value: float | None) -> str:
    return "nothing" if value is None else f"{value:.9g}"
