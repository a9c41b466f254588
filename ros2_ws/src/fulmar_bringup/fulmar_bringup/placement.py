"""Where a run begins and where it goes: as given, as its goal file says, or as the seed draws it inside the area."""

from __future__ import annotations

from dataclasses import replace

from fulmar_bringup.goal_plan import first_targets, start_of
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.geofence import check_places, farthest_goal, unreachable
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.goal import PLACES, Goal, PoseTuple
from fulmar_core.tasks.goal_files import GoalFile
from fulmar_core.worlds.scenario import load_scenario

DRAWS = 1000  # of a start and a goal, before an area counts as too small for them


def placed(plan: RunPlan, file: GoalFile | None) -> tuple[Goal, PoseTuple]:
    """The goal and the start of a plan, both inside the area; what was not given is drawn until it is.

    The first draw is the seed's episode. It stays where the task has obstacles or things: the plant draws the
    same ones.

    Args:
        plan: What was given. A standing system gets its goals later, and a real robot starts where it stands.
        file: Goals from a file, which were checked.

    Raises:
        ConfigError: What was given is outside, or no draw is inside.
    """
    robot, task, scenario = load_robot(plan.robot), load_task(plan.task), load_scenario(plan.scenario)
    area, farthest = plan.guards.area, farthest_goal(robot)
    if plan.goal is not None:  # numbers of a pose, of which a place is at the front
        check_places("the goal", [plan.goal], area, farthest)
    if plan.start and not plan.is_real:
        check_places("the start", [plan.start], area, farthest)
    fixed = start_of(file) if file is not None else None
    if fixed is not None and not plan.start and not plan.is_real:
        check_places("the start of these goals", [fixed], area, farthest)
    for number in range(DRAWS):
        episode = draw_episode(robot, task, scenario, seed=plan.seed, number=number)
        mission, drawn = episode.goal, task.state_type.written(episode.start.pose)
        if file is not None:
            mission, drawn = _from_file(file, mission, drawn)
        elif plan.goal is not None:
            mission, drawn = _moved(task, mission, drawn, plan.goal)
        goes = not plan.standing and task.goal_topic != "goal_velocity"
        targets = mission.targets.tolist() if goes else []
        starts = [] if plan.is_real else [plan.start or drawn]
        problem = unreachable("the drawn goal", targets, area, farthest) or unreachable(
            "the drawn start", starts, area, farthest
        )
        if not problem:
            return mission, drawn
        if mission.obstacles.size or task.things:
            break
    raise ConfigError(f"{problem} Give --start and --goal, another --seed, or a larger area.")


def _from_file(file: GoalFile, drawn: Goal, start: PoseTuple) -> tuple[Goal, PoseTuple]:
    """The first goal of a file, and a start that suits it."""
    mission = replace(drawn, targets=first_targets(file))
    fixed = start_of(file)
    if fixed is not None:
        return mission, fixed
    axes = file.form.AXES
    way = (mission.current[:axes] - drawn.current[:axes]).tolist()
    return mission, (*(s + w for s, w in zip(start, way, strict=False)), *start[axes:])


def _moved(task: Task, mission: Goal, start: PoseTuple, goal: PoseTuple) -> tuple[Goal, PoseTuple]:
    """Put another target into a drawn mission, and move the start along where there are no obstacles or things.

    Raises:
        ConfigError: The task has no single target in space.
    """
    if task.goal_topic not in PLACES:
        raise ConfigError(
            f"the targets of task '{task.name}' do not fit into one --goal. Leave it out: --seed draws them. "
            "Or publish your own while a system runs."
        )
    form, old = task.state_type, mission.current.tolist()
    if not (mission.obstacles.size or task.things):
        place = (g + s - o for g, s, o in zip(goal[: form.AXES], start, old, strict=False))
        start = (*place, *start[form.AXES :])
    return replace(mission, targets=form.target_at(goal)[None]), start
