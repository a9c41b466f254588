"""`fulmar evaluate`: evaluate a controller over many episodes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from fulmar_bringup.console import output, print_result
from fulmar_cli.commands.arguments import (
    TASK_HELP,
    CalibrationOption,
    ControlHzOption,
    ControllerOption,
    JsonOption,
    PolicyOption,
    ScenarioOption,
    SeedOption,
    argument,
    flag,
    option,
)
from fulmar_cli.commands.fleet import OptionalRobot
from fulmar_cli.commands.fleet_evaluation import FLEET_HELP, RESULTS_HELP, FleetSeeds, both_given
from fulmar_cli.commands.inspection import PathOption, ThingOption
from fulmar_cli.commands.run_help import NO_GUARD_HELP
from fulmar_core.config.seeds import EVALUATION_SEED
from fulmar_evaluation.figures import meanings

EPILOG = f"""\b
What the figures mean. Of all but the first: mean, median and 95th percentile over the episodes.
{meanings()}
"""


def evaluate(
    robot: OptionalRobot = None,
    task: Annotated[str | None, argument("[TASK]", TASK_HELP)] = None,
    system: Annotated[str | None, option("FLEET", FLEET_HELP)] = None,
    controller: ControllerOption = "policy",
    policy: PolicyOption = None,
    through: Annotated[
        str,
        option(
            "WAY",
            "batch: the core's own dynamics. mujoco: an independent simulator. ros: the deployed nodes over DDS. "
            "jsbsim[:MODEL]: an aircraft in JSBSim, from its own file or a model that comes with JSBSim. "
            "basilisk: a spacecraft or satellite in Basilisk (`make peers`).",
        ),
    ] = "mujoco",
    episodes: Annotated[
        int | None,
        option("N", "Number of episodes; 4,096 in the batch, 256 through simulators or ROS.", min=1),
    ] = None,
    seed: SeedOption = EVALUATION_SEED,
    scenario: ScenarioOption = "nominal",
    calibration: CalibrationOption = None,
    control_hz: ControlHzOption = None,
    jobs: Annotated[
        int | None, option("N", "Processes at once, through ros; one for each core.", min=1)
    ] = None,
    episode_s: Annotated[
        float | None,
        option("S", "Length of an episode or of a fleet's run [s]; the task's own by default.", min=0.01),
    ] = None,
    steps: Annotated[int | None, option("N", "The same, as a number of control steps.", min=1)] = None,
    worlds: Annotated[
        int | None, option("N", "Episodes at once in the batch; no figure depends on it.", min=1)
    ] = None,
    bounds: Annotated[
        int | None,
        option("N", "Episodes, from the first on, whose bound on waypoints is computed; 256.", min=1),
    ] = None,
    thing: ThingOption = None,
    path: PathOption = None,
    real_time: Annotated[bool, flag("--real-time", "A fleet by the clock; in lock step by default.")] = False,
    no_guard: Annotated[bool, flag("--no-keep-apart", NO_GUARD_HELP)] = False,
    results: Annotated[Path | None, option("DIR", RESULTS_HELP)] = None,
    as_json: JsonOption = False,
) -> None:
    """Evaluate a controller over many episodes and print every figure.

    Episode i of a seed is the same in every way of running it. Success means staying inside the task's tolerance
    for its whole closing window. With --system, a fleet is run once for each seed, from --seed on, and the exit code
    is 1 if a robot did not arrive, hulls touched, or a run failed.

    Try:

    fulmar evaluate floating_platform go_to_pose --controller lqr --through ros

    fulmar evaluate cubesat_8 inspect --controller pd --thing iss --path spiral --episodes 20

    fulmar evaluate turtlebot2 go_through_positions --through batch --steps 1000

    fulmar evaluate --system swap_places --through ros --episodes 20 --seed 0
    """
    from fulmar_cli.installation.extras import check_plan
    from fulmar_core.robots.robot_file import use_calibration
    from fulmar_evaluation.trial_plan import plan_trial, print_figures, trial_figures

    if system is not None:
        seeds = FleetSeeds(system, through, episodes or 20, seed, real_time, not no_guard, results, episode_s)
        seeds.evaluate(robot, as_json=as_json)
        return
    robot, task = both_given(robot, task)
    use_calibration(calibration, robot)
    trial = plan_trial(
        robot=robot, task=task, controller=controller, policy=policy, through=through, episodes=episodes,
        seed=seed, scenario=scenario, control_hz=control_hz, jobs=jobs, episode_s=episode_s, steps=steps,
        worlds=worlds, bounds=bounds, thing=thing or "", along=path or "",
    )  # fmt: skip
    check_plan(trial.plan, through=through)
    print_result(trial_figures(trial), lambda figures: print_figures(figures, output), as_json=as_json)
