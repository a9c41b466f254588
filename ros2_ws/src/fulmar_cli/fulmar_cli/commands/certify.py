"""`fulmar certify`: the conditions under which a controller is certified to succeed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any

import typer

from fulmar_bringup.console import log_line, output, print_result
from fulmar_cli.commands.arguments import (
    TASK_HELP,
    CalibrationOption,
    JsonOption,
    SeedOption,
    argument,
    flag,
    option,
)
from fulmar_cli.commands.certify_replay import only_target, replay_bags
from fulmar_core.config.errors import FAILED, ConfigError
from fulmar_core.config.seeds import EVALUATION_SEED


def certify(
    targets: Annotated[
        list[str],
        argument(
            "BUNDLE|LAW", "A policy bundle, `policy` for the shipped one, or a law such as lqr; or BAG..."
        ),
    ],
    robot: Annotated[
        str | None, option("ROBOT", "A name from `fulmar list robots`; that of a bundle's passport.")
    ] = None,
    task: Annotated[str | None, option("TASK", f"{TASK_HELP} That of a bundle's passport.")] = None,
    mujoco: Annotated[
        int, option("N", "Episodes in MuJoCo, an independent simulator; 0: none.", min=0, max=100_000)
    ] = 500,
    episodes: Annotated[
        int,
        option("N", "Fresh episodes of each test; fewer give wider bounds.", min=100, max=100_000),
    ] = 2000,
    dead: Annotated[
        int, option("N", "Actuators that do nothing: a set of its own for each number.", min=0)
    ] = 0,
    backup: Annotated[
        Path | None, option("FILE", "The certified set of the law that takes over; its hash is kept.")
    ] = None,
    write: Annotated[
        bool, flag("--write", "Put the set into the bundle's passport, which has to be signed again.")
    ] = False,
    again: Annotated[
        bool, flag("--again", "Test the set of the passport, or of --out, in place of searching for one.")
    ] = False,
    out: Annotated[Path | None, option("FILE", "Write the set of a law into a file, envelope.json.")] = None,
    plot: Annotated[
        Path | None, option("FILE", "Draw pairs of axes into a .png, .svg or .pdf.", "--plot")
    ] = None,
    replay: Annotated[
        bool, flag("--replay", "Count what the envelope guard would have done in recorded runs, BAG...")
    ] = False,
    area: Annotated[str | None, option("x,x,y,y", "With --replay: what it keeps the robot in [m].")] = None,
    seed: SeedOption = EVALUATION_SEED,
    jobs: Annotated[int | None, option("N", "Processes of MuJoCo; one for each core.", min=1)] = None,
    calibration: CalibrationOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find the starts, disturbances and bodies for which a controller succeeds in 95 of 100 episodes, and prove it.

    Four rounds of episodes in the core's batch explore the axes of the robot's kind. A monotone score and a box are
    fitted, shrunk on fresh episodes, and tested on others: the lower bound on success is 0.95 at 95 % confidence.

    With --replay the envelope guard watches recorded runs, and what it would have done is counted.

    Try:

    fulmar certify policy --robot floating_platform --task go_to_pose --plot envelope.png

    fulmar certify lqr --robot floating_platform --task go_to_pose --out envelope.json

    fulmar certify bundles/mine --write

    fulmar certify --replay runs/first runs/second --area=-2,2,-2,2

    Exit code: 0 certified, 1 no set met its bounds, 2 bad input.
    """
    if replay:
        replay_bags(targets, area, robot=robot, task=task, as_json=as_json)
        return
    controller = only_target(targets, area)
    from fulmar_core.config.pool import ONE_THREAD

    # Before the linear algebra is loaded: on matrices this small its threads burn time waiting for one another.
    os.environ.update(ONE_THREAD)
    from fulmar_cli.installation.extras import check_plan
    from fulmar_core.robots.robot_file import use_calibration
    from fulmar_evaluation.certify.certification import (
        is_certified,
        plan_certification,
        print_certificate,
        run_certification,
    )
    from fulmar_evaluation.certify.procedure import Sizes

    if calibration is not None and robot is not None:
        use_calibration(calibration, robot)
    if plot is not None:
        _check_plot(plot)
    sizes = Sizes.of(episodes, mujoco=mujoco)
    asked = plan_certification(
        controller, robot=robot, task=task, seed=seed, jobs=jobs, sizes=sizes, dead=dead, backup=backup,
        again=again, file=out,
    )  # fmt: skip
    if write and asked.bundle is None:
        raise ConfigError(f"--write belongs to a policy bundle; '{controller}' is a law. Use --out FILE.")
    check_plan(asked.trial.plan, through="mujoco" if mujoco else "batch")
    found, result = run_certification(asked)
    print_result(found, lambda document: print_certificate(document, output), as_json=as_json)
    if plot is not None:
        from fulmar_evaluation.certify.plot import write_plot

        log_line(f"wrote {write_plot(found, result, plot)}")
    if not is_certified(found):
        raise typer.Exit(FAILED)
    _keep(found, asked.bundle if write else None, out)


def _keep(found: dict[str, Any], bundle: Path | None, out: Path | None) -> None:
    """Put a certified set into a bundle's passport, and write it into a file, where that is asked for."""
    from fulmar_evaluation.certify.document import write_file, write_into_passport

    if bundle is not None:
        log_line(f"{bundle}: passport written. {write_into_passport(bundle, found)}")
    if out is not None:
        write_file(out, found)
        log_line(f"wrote {out}")


def _check_plot(path: Path) -> None:
    """Refuse a figure that could not be written, before anything runs."""
    from fulmar_cli.installation.extras import require

    require("matplotlib")
    from fulmar_evaluation.report.writer import check_image

    check_image(path)
