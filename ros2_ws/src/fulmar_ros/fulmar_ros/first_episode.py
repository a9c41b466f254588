"""Where a plant begins, as its parameters say."""

from __future__ import annotations

import numpy as np

from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.episode import Episode, draw_episode
from fulmar_core.planar import at_rest
from fulmar_core.robot import Robot
from fulmar_core.tasks import load_task
from fulmar_ros.plant_settings import PlantSettings


def first_episode(robot: Robot, settings: PlantSettings) -> Episode:
    """The seed's episode, begun at rest where the parameters say.

    Raises:
        ConfigError: A name is unknown, or a file is wrong.
    """
    x, y, heading = (np.asarray(float(value)) for value in settings.start)
    task, scenario = load_task(settings.task), load_scenario(settings.scenario)
    episode = draw_episode(robot, task, scenario, seed=settings.seed, number=0)
    return Episode(at_rest(x, y, np.deg2rad(heading)), episode.goal, episode.world)
