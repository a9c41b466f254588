"""`fulmar import`: make a policy bundle from a policy of another stack."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from fulmar_bringup.console import log_line, write_line
from fulmar_cli.commands.arguments import argument, invoked_command, option


def import_policy(
    file: Annotated[Path, argument("FILE", "Checkpoint of skrl (.pt) or rl_games (.pth), or .onnx.")],
    robot: Annotated[str, option("R", "The robot that it was trained for.")],
    task: Annotated[str, option("T", "The task that it was trained for.")],
    out: Annotated[Path, option("DIR", "Folder of the bundle.")],
    format: Annotated[
        str | None, option("F", "skrl, rl_games or onnx; by default what the file holds.")
    ] = None,
    hz: Annotated[float | None, option("HZ", "Command rate; the robot's own by default.", min=0.01)] = None,
    activation: Annotated[
        str | None,
        option(
            "A",
            "Between the layers of a checkpoint, such as elu; by default from params/agent.yaml of its run.",
        ),
    ] = None,
    output_activation: Annotated[
        str | None, option("A", "After the last layer, none or tanh; by default likewise.")
    ] = None,
) -> None:
    """Import a policy with RoboRAN's observation: network, golden vectors of the original, and passport.

    Only weights are read; a file with other Python objects is refused and nothing in it runs. Actions go to the
    robot's actuators in their order: a policy of RoboRAN's FloatingPlatform needs a robot with its nozzles.

    Try:

    fulmar import best_agent.pt --robot turtlebot2 --task go_to_position --out policies/imported

    fulmar run turtlebot2 --task go_to_position --policy policies/imported
    """
    from fulmar_core.config.errors import BundleError
    from fulmar_core.loop.policy_bundle import remove_bundle
    from fulmar_core.robots.robot_file import load_robot
    from fulmar_core.tasks import load_task
    from policy_server.policy import Policy
    from training.import_policy import as_format
    from training.import_policy import import_policy as write

    passport = write(
        file,
        out,
        robot_name=robot,
        task_name=task,
        wanted=as_format(format),
        control_hz=hz,
        activation=activation,
        output_activation=output_activation,
        command=invoked_command(),
    )
    try:
        Policy(out, load_robot(passport.robot), load_task(passport.task), control_hz=passport.control_hz)
    except BundleError:
        remove_bundle(out)  # what cannot be loaded would only be in the way of the next try
        raise
    write_line(
        f"{out}: {passport.robot} · {passport.task} · {passport.control_hz:g} Hz · "
        f"{passport.training['imported_from']} · {passport.sha256[:12]}"
    )
    if passport.action == "on_off":
        log_line(
            f"its actions open {', '.join(passport.actuator_names)}, in this order. RoboRAN's FloatingPlatform numbers "
            "other nozzles than RANS's platform: give the robot whose nozzles it was trained with."
        )
