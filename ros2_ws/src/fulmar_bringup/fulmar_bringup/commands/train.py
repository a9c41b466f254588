"""`fulmar train`: learn a policy in the core's batch."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Annotated

import typer

from fulmar_bringup.commands.arguments import RobotArgument, SeedOption, TaskArgument
from fulmar_bringup.console import console, output
from fulmar_core.errors import ConfigError


def train(
    robot: RobotArgument,
    task: TaskArgument,
    seed: SeedOption = 1,
    time_limit: Annotated[
        float | None,
        typer.Option(metavar="S", min=1.0, help="Wall-clock seconds of learning; the settings' by default."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Run folder; runs/train/<time>... by default.")
    ] = None,
    episodes: Annotated[
        int, typer.Option(metavar="N", min=1, help="Episodes of the closing judgement in MuJoCo.")
    ] = 256,
) -> None:
    """Learn a policy, then judge it in MuJoCo, where it was not trained.

    Settings come from configs/training/<robot>_<task>.yaml. The run folder holds the best weights, the learning
    curve and TensorBoard logs; `fulmar export` makes a policy bundle of it.

    Try:

    fulmar train floating_platform go_to_pose --seed 3 --out runs/train/mine
    """
    from fulmar_bringup.provenance import git_revision
    from fulmar_core.robot import load_robot
    from fulmar_core.tasks import load_task
    from training.judge import judge_in_mujoco
    from training.settings import load_training_settings
    from training.train import train as learn

    the_robot, the_task = load_robot(robot), load_task(task)
    settings = load_training_settings(the_robot, the_task)
    out = out or Path("runs") / "train" / f"{time.strftime('%Y%m%d_%H%M%S')}_{robot}_{task}_{seed}"
    if out.is_dir() and any(out.iterdir()):
        raise ConfigError(f"{out} is not empty; nothing recorded is overwritten. Give --out another folder.")
    record = learn(
        the_robot,
        the_task,
        settings,
        seed=seed,
        out=out,
        time_limit_s=time_limit,
        command="fulmar " + " ".join(sys.argv[1:]),
        git_revision=git_revision(),
    )
    console.print(f"learned from {record['steps']:,} steps in {record['wall_s']:.0f} s; judging in MuJoCo")
    figures = judge_in_mujoco(out, episodes=episodes)
    output.print(
        f"success {figures['success_rate']:.3f} of {episodes} episodes in MuJoCo; run folder {out}\n"
        f"next: fulmar export {out} --out DIR",
        markup=False,
    )
