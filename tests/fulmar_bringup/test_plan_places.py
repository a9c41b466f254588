"""Where goals and starts of a run may lie: inside the area, and within a kilometre of the origin."""

from __future__ import annotations

import pytest

from fulmar_bringup import completion
from fulmar_bringup.system import Guards
from fulmar_core.config.errors import ConfigError

NARROW = {"area": (0.0, 2.0, -1.0, 1.0)}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"goal": (2.5, 0.0, 0.0), "start": (1.0, 0.0, 0.0)},
            "the goal x = 2.5 m, y = 0 m lies outside the area of",
        ),
        (
            {"goal": (1.0, 0.0, 0.0), "start": (1.0, 1.5, 0.0)},
            "the start x = 1 m, y = 1.5 m lies outside the area",
        ),
        (
            {"start": (1.0, 1.5, 0.0), "standing": True},
            "the start x = 1 m, y = 1.5 m lies outside the area",
        ),
    ],
)
def test_a_goal_or_a_start_outside_the_area_is_refused(plan, change, words):
    assert plan(**change)  # without an area
    with pytest.raises(ConfigError) as caught:
        plan(**change, guards=NARROW)
    assert words in str(caught.value)


def test_a_goal_outside_the_area_of_the_system_file_is_refused(plan, monkeypatch):
    monkeypatch.setattr(completion, "default_guards", lambda *_: Guards(**NARROW))
    with pytest.raises(ConfigError, match="outside the area of x 0 to 2 m"):
        plan(goal=(2.5, 0.0, 0.0), start=(1.0, 0.0, 0.0))


def test_a_goal_farther_than_a_kilometre_is_refused_though_the_start_is_near_it(plan):
    with pytest.raises(ConfigError, match="1,005 m from the origin, farther than 1,000 m"):
        plan(goal=(1005.0, 0.0, 0.0), start=(1004.0, 0.0, 0.0))


@pytest.mark.parametrize("goal", [None, (1.0, 0.5, 0.0)])
@pytest.mark.parametrize("seed", range(10))
def test_what_is_drawn_lies_inside_the_area_and_is_the_same_for_one_seed(plan, goal, seed):
    x_min, x_max, y_min, y_max = area = (-2.5, 2.5, -1.0, 1.5)
    first, again = (plan(goal=goal, seed=seed, guards={"area": area}) for _ in range(2))
    assert first == again
    for x, y, _ in (first.goal, first.start):
        assert x_min <= x <= x_max
        assert y_min <= y <= y_max


def test_an_area_that_holds_the_seed_s_episode_leaves_it_as_it_is(plan):
    wide = {"area": (-50.0, 50.0, -50.0, 50.0)}
    assert [plan(seed=seed, guards=wide).goal for seed in range(3)] == [
        plan(seed=seed).goal for seed in range(3)
    ]


def test_an_area_too_small_for_any_draw_is_refused_with_what_to_give(plan):
    with pytest.raises(ConfigError, match="Give --start and --goal, another --seed, or a larger area"):
        plan(guards={"area": (-0.01, 0.01, -0.01, 0.01)})


def test_among_obstacles_a_start_outside_the_area_is_refused_since_the_plant_draws_the_same_ones(plan):
    change = {"robot": "kingfisher", "task": "go_to_position_with_obstacles", "controller": "policy"}
    x, _, _ = plan(**change).start
    with pytest.raises(ConfigError, match="the drawn start"):
        plan(
            **change,
            guards={"area": (-99.0, x - 0.01, -99.0, 99.0) if x > 0 else (x + 0.01, 99.0, -99.0, 99.0)},
        )


@pytest.mark.parametrize("file", ["positions: [[1.0, 0.0], [3.0, 0.0]]", "poses: [[3.0, 0.0, 90.0]]"])
def test_goals_of_a_file_that_lie_outside_the_area_are_refused(plan, tmp_path, file):
    path = tmp_path / "mine.yaml"
    path.write_text(f"kind: {file.partition(':')[0]}\ntitle: mine\n{file}\n")
    task = "go_to_position" if file.startswith("positions") else "go_to_pose"
    assert plan(goals=str(path), task=task)
    with pytest.raises(ConfigError, match=r"mine\.yaml' x = 3 m, y = 0 m lies outside the area"):
        plan(goals=str(path), task=task, guards={"area": (-2.0, 2.0, -2.0, 2.0)})


def test_a_path_that_leaves_the_area_is_refused(plan):
    with pytest.raises(ConfigError, match=r"the goal of 'circle' x = .* lies outside the area"):
        plan(goals="circle", task="track_velocities", guards={"area": (-0.5, 0.5, -0.5, 0.5)})


def test_where_a_real_robot_starts_is_not_known_and_not_refused(plan):
    change = {
        "robot": "turtlebot2",
        "task": "go_to_position",
        "controller": "classical",
        "backend": "hardware",
    }
    far = {"area": (3.0, 9.0, 3.0, 9.0)}
    assert plan(**change, goal=(4.0, 4.0, 0.0), guards=far).guards.area == far["area"]
    x, y, _ = plan(**change, goal=(4.0, 4.0, 0.0), guards=far, emulated=True).start
    assert 3.0 <= x <= 9.0
    assert 3.0 <= y <= 9.0


def test_an_area_without_the_start_of_a_velocity_file_is_refused_with_that_start(plan):
    change = {"robot": "turtlebot2", "task": "track_velocities", "controller": "classical"}
    far = {"area": (3.0, 9.0, 3.0, 9.0)}
    with pytest.raises(ConfigError, match="the start of these goals x = 0 m, y = 0 m lies outside the area"):
        plan(**change, goals="velocity_steps", guards=far)
    assert plan(**change, goals="velocity_steps", guards=far, start=(4.0, 4.0, 0.0))
