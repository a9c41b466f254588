"""`fulmar bag rerun`: what would this controller have done in that run, and is it what was done?"""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fulmar_bringup.console import console, output, print_json
from fulmar_cli.commands.arguments import BagArgument, JsonOption, PolicyOption, read_pose
from fulmar_cli.commands.damage import finish, warn
from fulmar_core.errors import ConfigError, UnknownNameError

if TYPE_CHECKING:
    from fulmar_bags.contents import Bag
    from fulmar_bags.control_steps import ControlSteps

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
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the answers, step by step: .csv or .npz.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show a recorded run to a controller, and compare its answers with the recorded ones, field by field.

    Each step is shown as it was recorded, whatever the controller answered before; at goals, pauses and jumps of time
    it forgets, as in the node. Bags of others are fed from odometry and need --robot, --task and mostly --goal; without
    recorded actions there is nothing to compare, and --out has the answers.

    Exit code: 0 all fields are the same within the tolerance, 1 one differs, nothing could be compared or part of the
    bag could not be read, 2 the bag cannot be read.

    Try: fulmar bag rerun runs/demo_x/policy --controller policy --policy runs/bundles/mine
    """
    from fulmar_bags.comparison import as_json as lines
    from fulmar_bags.comparison import first_difference, read_tolerances
    from fulmar_bags.contents import open_bag
    from fulmar_bags.control_steps import control_steps_of
    from fulmar_bags.figures import controllers_of
    from fulmar_evaluation.rerun.answers_file import check_answers_file, write_answers
    from fulmar_evaluation.rerun.calibration import calibrated_as
    from fulmar_evaluation.rerun.embedded_configs import knowing_what_it_carries
    from fulmar_evaluation.rerun.replay_controllers import answers_of
    from fulmar_evaluation.rerun.rerun import FROM
    from fulmar_evaluation.rerun.rerun_result import FIELDS, judge_answers, pauses, sums

    began = time.monotonic()
    for what, given, known in (("--from", source, FROM), ("--through", through, WAYS)):
        if given not in known:
            raise UnknownNameError(what, given, known)
    if out is not None:
        check_answers_file(out)
    tolerances = read_tolerances(tolerance or [], FIELDS)
    opened = open_bag(bag)
    foreign = opened.info is None
    _check_effect(source, through, foreign=foreign, options={"--goal": goal, "--odometry": odometry})
    with knowing_what_it_carries(opened), calibrated_as(opened):
        course = control_steps_of(
            opened,
            robot=robot,
            task=task,
            goal=read_pose(goal, "--goal"),
            control_hz=control_hz,
            odometry=odometry,
        )
        warn(course.warnings)
        name, folder = _chosen(opened, course, controller, policy)
        if through == "node":
            from fulmar_evaluation.rerun.live_node import rerun_through_node, without_repeats

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
    recorded = [each.get("sha256") for each in controllers_of(opened)]
    if out is not None:
        write_answers(course, answers, out)
    result: dict[str, Any] = {
        "bag": str(bag),
        "robot": course.robot.name,
        "task": course.task.name,
        "controller": name,
        "policy": folder or None,
        "sha256": sha256,
        "recorded_sha256": recorded[0] if recorded else None,
        "recorded_sha256s": recorded,
        "from": "odometry" if foreign else source,
        "through": through,
        "steps": len(course),
        "asked": int(answers.acted.sum()),
        "not_asked": [vars(each) for each in pauses(answers)],
        "answers": None if out is None else str(out),
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
    raise finish(opened, good=result["same"])


def _check_effect(source: str, through: str, *, foreign: bool, options: dict[str, str | None]) -> None:
    """Refuse options that would change nothing.

    Raises:
        ConfigError: On the first one.
    """
    given = [name for name, value in options.items() if value is not None]
    if given and source == "observations" and through == "direct" and not foreign:
        raise ConfigError(f"{given[0]} changes nothing where observations are fed. Add --from odometry.")


def _chosen(bag: Bag, course: ControlSteps, controller: str | None, policy: Path | None) -> tuple[str, str]:
    """Name of the controller and folder of its bundle, empty where it has none."""
    from fulmar_bags.control_steps import policy_folder
    from fulmar_core.own_class import is_own
    from policy_server.controllers import controller_entry
    from policy_server.shipped import shipped_policy

    name = controller or ("policy" if policy else (bag.info or {}).get("controller"))
    if not isinstance(name, str):
        raise ConfigError(f"{bag.path}: the bag does not say which controller drove. Give --controller.")
    if is_own(name) and controller is None:  # a bag from elsewhere must not have its code run
        raise ConfigError(
            f"{bag.path}: '{name}' drove, a class that only this bag names. To run it: --controller {name}."
        )
    if controller_entry(name).is_external:
        raise ConfigError(
            f"{bag.path}: an external controller drove, which is no part of Fulmar and cannot be run again here. "
            "To compare another one: --controller classical --from odometry."
        )
    if not controller_entry(name).runs_bundle:
        if policy is not None:
            raise ConfigError(
                f"--policy is for --controller policy, not for '{name}'. Leave one of them out."
            )
        return name, ""
    recorded = policy_folder(bag)
    folder = policy or recorded or shipped_policy(course.robot.name, course.task.name)
    named = (bag.info or {}).get("policy")
    if named and folder is not None and not policy and not recorded:
        warn(
            [
                f"the bundle that drove, {named}, is gone; {folder} is asked instead. Give another one: --policy DIR."
            ]
        )
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
    turns = len(result["recorded_sha256s"])
    if turns > 1:
        _say(f"{turns} controllers had their turn in the record; compared with the first of them")
    for each in result["not_asked"][:SHOWN]:
        _say(f"  not asked at {each['steps']} steps, from step {each['first_step']}: {each['reason']}")
    if result["answers"]:
        _say(f"its answers are in {result['answers']}")
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
