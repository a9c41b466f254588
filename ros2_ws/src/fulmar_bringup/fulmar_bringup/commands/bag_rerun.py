"""`fulmar bag rerun`: what would this controller have done in that run, and is it what was done?"""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fulmar_bringup.commands.arguments import BagArgument, JsonOption, PolicyOption, read_pose
from fulmar_bringup.console import console, output, print_json
from fulmar_core.errors import ConfigError, UnknownNameError
from fulmar_core.exit_codes import DONE, FAILED

if TYPE_CHECKING:
    from fulmar_bringup.bags.contents import Bag
    from fulmar_bringup.bags.course import Course

WAYS = ("direct", "node")
SHOWN = 12  # lines of fields that differ


def rerun(
    bag: BagArgument,
    controller: Annotated[
        str | None,
        typer.Option(metavar="C", help="policy, lqr, classical, ...; by default the one that was recorded."),
    ] = None,
    policy: PolicyOption = None,
    source: Annotated[
        str,
        typer.Option(
            "--from",
            metavar="observations|odometry",
            help="Feed the recorded observations, or make them anew from odometry and goals, gates included.",
        ),
    ] = "observations",
    through: Annotated[
        str,
        typer.Option(metavar="direct|node", help="Call the controller, or run the live node in lock step."),
    ] = "direct",
    tolerance: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[FIELD=]X",
            help="Largest difference that counts as the same, for all fields or for one of decision, observation, "
            "action, command; 0, the same bits, by default. May be repeated.",
        ),
    ] = None,
    robot: Annotated[
        str | None, typer.Option(metavar="R", help="Whose bag it is, if it does not say.")
    ] = None,
    task: Annotated[
        str | None, typer.Option(metavar="T", help="What was to be done, if it does not say.")
    ] = None,
    goal: Annotated[
        str | None, typer.Option(metavar="x,y,deg", help="The goal, for a bag that holds none.")
    ] = None,
    control_hz: Annotated[
        float | None, typer.Option(metavar="HZ", min=0.01, help="Command rate, if the bag does not say it.")
    ] = None,
    odometry: Annotated[
        str | None, typer.Option(metavar="TOPIC", help="Which odometry, where a bag has several.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show a recorded run to a controller, and compare its answers with the recorded ones, field by field.

    Each step is shown as it was recorded, whatever the controller answered before; at goals, pauses and jumps of time
    it forgets, as in the node. Bags of others are fed from odometry and need --robot, --task and mostly --goal; without
    recorded actions there is nothing to compare.

    Exit code: 0 all fields are the same within the tolerance, 1 one differs or nothing could be compared, 2 the bag
    cannot be read.

    Try: fulmar bag rerun runs/demo_x/policy --controller policy --policy runs/bundles/mine
    """
    from fulmar_bringup.bags.calibration import calibrated_as
    from fulmar_bringup.bags.cast import answers_of
    from fulmar_bringup.bags.comparison import as_json as lines
    from fulmar_bringup.bags.comparison import first_difference, read_tolerances
    from fulmar_bringup.bags.contents import open_bag
    from fulmar_bringup.bags.course import course_of
    from fulmar_bringup.bags.figures import controller_of
    from fulmar_bringup.bags.rerun import FROM
    from fulmar_bringup.bags.verdict import FIELDS, judge_answers, sums

    began = time.monotonic()
    for what, given, known in (("--from", source, FROM), ("--through", through, WAYS)):
        if given not in known:
            raise UnknownNameError(what, given, known)
    tolerances = read_tolerances(tolerance or [], FIELDS)
    opened = open_bag(bag)
    foreign = opened.info is None
    with calibrated_as(opened):
        course = course_of(
            opened,
            robot=robot,
            task=task,
            goal=read_pose(goal, "--goal"),
            control_hz=control_hz,
            odometry=odometry,
        )
        for warning in course.warnings:
            console.print(f"warning: {warning}", markup=False, soft_wrap=True)
        name, folder = _chosen(opened, course, controller, policy)
        if through == "node":
            from fulmar_bringup.bags.live_node import rerun_through_node, without_repeats

            course = without_repeats(course)
            answers, sha256 = rerun_through_node(opened, course, name, folder, odometry)
        else:
            follow = policy is None and name == (opened.info or {}).get("controller")
            if course.changes and not follow:
                console.print(
                    "warning: the record changed its policy on the way; here one goes through all of it",
                    markup=False,
                )
            answers, sha256 = answers_of(
                course, name, folder, "odometry" if foreign else source, follow=follow
            )
    fields = judge_answers(course, answers, tolerances)
    first = first_difference(fields)
    recorded = controller_of(opened)
    result: dict[str, Any] = {
        "bag": str(bag),
        "robot": course.robot.name,
        "task": course.task.name,
        "controller": name,
        "policy": folder or None,
        "sha256": sha256,
        "recorded_sha256": recorded.get("sha256"),
        "from": "odometry" if foreign else source,
        "through": through,
        "steps": len(course),
        "asked": int(answers.acted.sum()),
        "compared": bool(fields) and course.answered,
        "same": bool(fields) and course.answered and first is None,
        "first_difference": None if first is None else lines([first])[0],
        "fields": lines(fields),
        "warnings": list(course.warnings),
        "elapsed_s": time.monotonic() - began,
    }
    if as_json:
        print_json(result)
    else:
        _show(result, [vars(each) for each in sums(fields)])
    raise typer.Exit(DONE if result["same"] or (foreign and not result["compared"]) else FAILED)


def _chosen(bag: Bag, course: Course, controller: str | None, policy: Path | None) -> tuple[str, str]:
    """Name of the controller and folder of its bundle, empty where it has none."""
    from fulmar_bringup.bags.course import policy_folder
    from fulmar_bringup.system import CONTROLLERS
    from policy_server.shipped import shipped_policy

    name = controller or ("policy" if policy else (bag.info or {}).get("controller"))
    if not isinstance(name, str):
        raise ConfigError(f"{bag.path}: the bag does not say which controller drove. Give --controller.")
    if name not in CONTROLLERS:
        raise UnknownNameError("controller", name, CONTROLLERS)
    if name != "policy":
        if policy is not None:
            raise ConfigError(
                f"--policy is for --controller policy, not for '{name}'. Leave one of them out."
            )
        return name, ""
    folder = policy or policy_folder(bag) or shipped_policy(course.robot.name, course.task.name)
    if folder is None:
        raise ConfigError(
            f"no policy is shipped for '{course.robot.name}' and '{course.task.name}'. Give one: --policy DIR."
        )
    return name, str(folder)


def _show(result: dict[str, Any], sums: list[dict[str, Any]]) -> None:
    _say(
        f"{result['bag']}: {result['steps']} steps of {result['robot']}, {result['task']}; "
        f"'{result['controller']}' was asked {result['asked']} times, in {result['elapsed_s']:.2f} s"
    )
    if result["sha256"] and result["recorded_sha256"]:
        same = result["sha256"] == result["recorded_sha256"]
        _say("the same controller as recorded" if same else "another controller than recorded")
    if not result["compared"]:
        _say("nothing was recorded that its answers could be compared with")
        return
    for each in sums:
        verdict = "the same" if not each["differing"] else f"{each['differing']} numbers differ"
        _say(
            f"  {each['field']:<12} {each['steps']:>7} steps  {verdict}, largest difference {each['largest']:.3g}"
        )
    first = result["first_difference"]
    if first is None:
        _say("same")
        return
    _say(
        f"first difference: step {first['first_step']}, odom of t = {first['first_stamp_s']:.3f} s, "
        f"{first['field']} {first['name']}: recorded {_number(first['recorded'])}, now {_number(first['found'])}"
    )
    differing = [each for each in result["fields"] if each["differing"]]
    for each in differing[:SHOWN]:
        spread = each["difference"] or {"p50": 0.0, "p99": 0.0, "max": 0.0}
        _say(
            f"  {each['field']} {each['name']}: {each['differing']} of {each['compared']} differ, from step "
            f"{each['first_step']}; median {spread['p50']:.3g}, p99 {spread['p99']:.3g}, largest {spread['max']:.3g}"
        )
    if len(differing) > SHOWN:
        _say(f"  ... and {len(differing) - SHOWN} more; --json has them all")


def _number(value: float | None) -> str:
    return "nothing" if value is None else f"{value:.9g}"


def _say(text: str) -> None:
    output.print(text, markup=False, soft_wrap=True)
