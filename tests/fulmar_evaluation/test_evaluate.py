"""`fulmar evaluate`: episodes of any length, in batches of any size."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from fulmar_cli.main import app
from fulmar_core.config.errors import ConfigError
from fulmar_evaluation.figures import FIGURES, SUCCESS, meanings

POSE = "evaluate floating_platform go_to_pose --controller lqr --through batch"
TIMING = {"wall_s", "steps_per_s"}


def evaluate(words: str) -> dict:
    result = CliRunner().invoke(app, [*words.split(), "--json"], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def test_no_figure_depends_on_how_many_worlds_run_at_once():
    few, many = (evaluate(f"{POSE} --episodes 9 --episode-s 6 --worlds {worlds}") for worlds in (3, 64))
    assert {k: v for k, v in few.items() if k not in TIMING} == {
        k: v for k, v in many.items() if k not in TIMING
    }


def test_the_length_of_an_episode_is_seconds_or_control_steps():
    seconds, steps = (evaluate(f"{POSE} --episodes 2 {length}") for length in ("--episode-s 4", "--steps 20"))
    assert seconds["episode_s"] == steps["episode_s"] == 4.0
    assert seconds["control_steps"] == steps["control_steps"] == 40
    assert evaluate(f"{POSE} --episodes 1")["episode_s"] == 60.0


@pytest.mark.parametrize(
    ("asked", "episodes"),
    [("lqr --through batch", 4096), ("lqr --through mujoco", 256), ("lqr --through batch --episodes 3", 3)],
)
def test_the_batch_is_evaluated_by_more_episodes_where_nobody_says_how_many(asked, episodes, monkeypatch):
    class AskedError(Exception):
        pass

    def trial(plan, through, episodes, *more):
        raise AskedError(episodes)

    monkeypatch.setattr("fulmar_evaluation.trial_plan.Trial", trial)
    with pytest.raises(AskedError, match=f"^{episodes}$"):
        evaluate(f"evaluate floating_platform go_to_pose --controller {asked}")


@pytest.mark.slow
def test_waypoints_are_reported_with_what_physics_allows(monkeypatch):
    monkeypatch.setattr("fulmar_evaluation.trial_plan.BOUNDED_EPISODES", 2)
    words = "evaluate turtlebot2 go_through_positions --controller classical --through batch --episodes 3"
    found = evaluate(f"{words} --episode-s 20")
    assert found["bound_episodes"] == 2
    assert found["goals_reached"]["mean"] <= found["goals_bound"]["mean"] + 1.0
    assert 0.0 < found["share_of_bound"]["mean"] <= 1.0
    assert 0.0 < found["share_of_mean_bound"] <= 1.0
    assert "rad/s" in found["bound"]


def test_an_episode_too_short_to_hold_anything_in_is_refused():
    with pytest.raises(
        ConfigError, match="an episode of 1 s is shorter than the 4 s that 'track_velocities'"
    ):
        CliRunner().invoke(
            app,
            ["evaluate", "turtlebot2", "track_velocities", "--controller", "classical", "--episode-s", "1"],
            catch_exceptions=False,
        )


def test_a_length_said_twice_and_worlds_elsewhere_are_refused():
    with pytest.raises(ConfigError, match="Give one of them"):
        CliRunner().invoke(app, f"{POSE} --steps 20 --episode-s 4".split(), catch_exceptions=False)
    with pytest.raises(ConfigError, match="belongs to --through batch"):
        CliRunner().invoke(
            app,
            ["evaluate", "floating_platform", "go_to_pose", "--controller", "lqr", "--worlds", "4"],
            catch_exceptions=False,
        )


def test_the_help_states_what_every_figure_means():
    text = CliRunner().invoke(app, ["evaluate", "--help"]).output
    assert all(name in text for name in FIGURES)
    assert " ".join(SUCCESS.split()[:9]) in " ".join(text.split())
    assert max(map(len, meanings(70).splitlines())) <= 70


@pytest.mark.parametrize(
    ("pair", "way"),
    [
        pytest.param("airship_v7 fly_hold", "jsbsim", marks=pytest.mark.slow),
        pytest.param("navion fly_attitude", "jsbsim:L17", marks=pytest.mark.slow),
    ],
)
def test_aircraft_are_evaluated_in_jsbsim_which_prints_nothing_of_its_own(pair, way, capfd):
    words = f"evaluate {pair} --controller lqi --through {way} --scenario ideal --episodes 1"
    found = evaluate(f"{words} --episode-s 10")
    assert (found["through"], found["success_rate"]) == (way, 1.0)
    assert capfd.readouterr().out == ""


def test_a_way_or_a_model_that_is_none_is_one_line_with_the_nearest():
    for way, nearest in (("jsbsm", "jsbsim"), ("jsbsim:L71", "L17")):
        words = f"evaluate navion fly_attitude --controller lqi --through {way}"
        with pytest.raises(ConfigError, match=f"Did you mean '{nearest}'"):
            evaluate(words)
