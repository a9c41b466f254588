"""Where a run begins and where it goes: as given, as its goal file says, or as the seed draws it inside the area."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fulmar_bringup.goal_plan import first_targets, start_of
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.geofence import check_places, farthest_goal, unreachable
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import PLACES, Goal, PoseTuple
from fulmar_core.tasks.goal_files import GoalFile
from fulmar_core.worlds.scenario import Scenario

DRAWS = 1000  # of a start and a goal, before an area counts as too small for them


def placed(
    robot: Robot,
    task: Task,
    scenario: Scenario,
    seed: int,
    *,
    file: GoalFile | None,
    goal: PoseTuple | None,
    start: PoseTuple | None,
    area: Sequence[float],
    checks_goal: bool,
    checks_start: bool,
) -> tuple[Goal, PoseTuple]:
    """The goal and the start of a run, both inside the area; what was not given is drawn until it is.

    The first draw is the seed's episode. It stays where the task has obstacles or things: the plant draws the
    same ones.

    Args:
        robot: The robot.
        task: The task.
        scenario: Scenario of the draws.
        seed: Seed of the draws.
        file: Goals from a file, which were checked.
        goal: The goal that was given.
        start: The start that was given.
        area: Area of the robot.
        checks_goal: Whether the robot goes to the goal by itself; otherwise goals come later.
        checks_start: Whether the start is known; a real robot starts where it stands.

    Raises:
        ConfigError: What was given is outside, or no draw is inside.
    """
    farthest = farthest_goal(robot)
    if goal is not None:
        check_places(
            "the goal", [goal], area, farthest
        )  # numbers of a pose, of which a place is at the front
    if start is not None and checks_start:
        check_places("the start", [start], area, farthest)
    fixed = start_of(file) if file is not None else None
    if fixed is not None and start is None and checks_start:
        check_places("the start of these goals", [fixed], area, farthest)
    for number in range(DRAWS):
        episode = draw_episode(robot, task, scenario, seed=seed, number=number)
        mission, drawn = episode.goal, task.state_type.written(episode.start.pose)
        if file is not None:
            mission, drawn = _from_file(file, mission, drawn)
        elif goal is not None:
            mission, drawn = _moved(task, mission, drawn, goal)
        targets = mission.targets.tolist() if checks_goal and task.goal_topic != "goal_velocity" else []
        starts = [start or drawn] if checks_start else []
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
