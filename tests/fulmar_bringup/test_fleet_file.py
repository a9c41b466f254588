"""Fleet files: what is refused in one line, what is started, and that nothing of one robot reaches another."""

from __future__ import annotations

import json

import numpy as np
import pytest

from fulmar_bringup.fleet_file import load_fleet, system_names
from fulmar_bringup.fleet_plan import FleetChoices, fleet_plan, fleet_rows
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names

ROW = "{{name: {}, robot: floating_platform, task: go_to_pose, controller: lqr, start: [{}, 0.0, 0.0]{}}}"


@pytest.fixture
def written(tmp_path, monkeypatch):
    """Writes a fleet file of rows and loads it; `more` are further lines."""
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    folder = tmp_path / "systems"
    folder.mkdir()

    def write(*rows, more=""):
        lines = "\n".join(f"  - {row}" for row in rows)
        (folder / "mine.yaml").write_text(f"title: mine\ncontrol_hz: 10.0\n{more}robots:\n{lines}\n")
        return load_fleet("mine")

    return write


def row(name, x, more=""):
    return ROW.format(name, x, more)


def test_the_shipped_fleets_are_known_apart_from_systems_of_one_robot():
    assert set(system_names(fleets=True)) == {"fleet", "formation", "swap_places"}
    assert set(system_names(fleets=True)) | set(system_names(fleets=False)) == set(config_names("systems"))
    assert [each.called for each in load_fleet("fleet").robots] == ["alpha", "beta", "boat"]


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ((row("a", 0.0), row("a", 3.0)), "two robots are called 'a'"),
        ((row("a", 0.0), row("b", 0.6)), "'a' and 'b' start 0.60 m apart, and their hulls reach 0.62 m"),
        ((row("a", 0.0),), "at least two robots"),
        ((row("fleet", 0.0), row("b", 3.0)), "no robot of a fleet may be called 'fleet'"),
        ((row("a", 0.0, ", backend: mock"), row("b", 3.0)), "share a world in mujoco"),
        ((row("a", 0.0, ", goal: [1.0, 1.0], goals: square"), row("b", 3.0)), "two goals"),
        ((row("a", 0.0, ", strat: 1"), row("b", 3.0)), "unknown key 'strat'"),
        ((row("a", 0.0).replace("lqr", "lqrr"), row("b", 3.0)), "lqrr"),
    ],
)
def test_a_mistake_is_one_line(written, rows, words):
    with pytest.raises(ConfigError) as refused:
        written(*rows)
    assert words in str(refused.value) and "\n" not in str(refused.value)


def test_a_task_of_all_draws_starts_and_goals_by_the_seed(written):
    plans = [fleet_plan("swap_places", FleetChoices(seed=seed, record="x")) for seed in (3, 3, 4)]
    starts = [[one.start for one in plan.robots] for plan in plans]
    assert starts[0] == starts[1] != starts[2]
    with pytest.raises(ConfigError, match="draws them"):
        written(row("a", 0.0), row("b", 3.0), more="task: swap_places\n")


LEADER = "{name: a, robot: floating_platform, task: go_to_pose, controller: lqr}"
FOLLOWER = LEADER.replace("name: a", "name: b").replace("}", ", place: [-1.0, 0.0, 0.0], keep_apart: true}")


@pytest.mark.parametrize(
    ("rows", "more", "words"),
    [
        ((LEADER, FOLLOWER), "", "robot 'b' has a 'place', and only 'task: formation'"),
        ((FOLLOWER, LEADER), "task: formation\n", "'b' is the first robot and leads; it has no 'place'"),
        ((LEADER, row("b", 3.0)), "task: formation\n", "robot 'b' needs a 'place': x, y from 'a'"),
        (
            (LEADER, FOLLOWER.replace("place", "goal: [0.0, 0.0, 0.0], place")),
            "task: formation\n",
            "'b' has a start or goal",
        ),
        (
            (LEADER, FOLLOWER.replace("keep_apart: true", "keep_apart: false")),
            "task: formation\n",
            "'b' needs 'keep_apart: true'",
        ),
        ((LEADER, FOLLOWER.replace("0.0, 0.0]", "0.0]")), "task: formation\n", "'place' needs three numbers"),
        (
            (LEADER, FOLLOWER.replace("go_to_pose", "go_through_poses")),
            "task: formation\n",
            "Give go_to_pose",
        ),
        ((LEADER, FOLLOWER), "task: formatoin\n", "must be one of"),
    ],
)
def test_a_mistake_in_a_formation_is_one_line(written, rows, more, words):
    with pytest.raises(ConfigError) as refused:
        written(*rows, more=more)
    assert words in str(refused.value) and "\n" not in str(refused.value)


def test_robots_of_a_formation_start_at_their_places_and_know_them_and_never_go_without_their_guards():
    plan = fleet_plan("formation", FleetChoices(record="x"))
    np.testing.assert_allclose([one.start[:2] for one in plan.robots], [(1.2, 0.0), (0.2, 0.8), (0.2, -0.8)])
    _, robots = fleet_rows(plan)
    assert [rows[0].parameters.get("formation") for rows in robots.values()] == [
        None,
        "leader -1 0.8 0",
        "leader -1 -0.8 0",
    ]
    with pytest.raises(ConfigError, match="Leave --no-keep-apart out"):
        fleet_plan("formation", FleetChoices(record="x", keep_apart=False))


def test_robots_of_two_rates_are_refused_in_lock_step_alone(written):
    written(
        row("a", 0.0, ", control_hz: 5.0, goal: [1.0, 0.0, 0.0]"), row("b", 3.0, ", goal: [4.0, 0.0, 0.0]")
    )
    assert fleet_plan("mine", FleetChoices(record="x"))
    with pytest.raises(ConfigError, match="'a' at 5 Hz and 'b' at 10 Hz"):
        fleet_plan("mine", FleetChoices(record="x", lockstep=True))


def test_a_guard_of_a_robot_that_cannot_brake_is_refused(written):
    boat = (
        row("b", 5.0, ", keep_apart: true")
        .replace("floating_platform", "kingfisher")
        .replace("lqr", "classical")
    )
    written(row("a", 0.0), boat.replace("go_to_pose", "go_to_position"))
    with pytest.raises(ConfigError, match="'kingfisher' does not"):
        fleet_plan("mine", FleetChoices(record="x"))


def test_a_fleet_has_one_world_one_recorder_and_one_owner_of_the_clock():
    plan = fleet_plan("fleet", FleetChoices(lockstep=True, record="x"))
    shared, robots = fleet_rows(plan)
    assert [spec.name for spec in shared] == ["recorder", "fleet"]
    assert (
        sum("/clock" in spec.outputs for spec in [*shared, *(s for rows in robots.values() for s in rows)])
        == 1
    )
    assert {name: [spec.name for spec in rows] for name, rows in robots.items()} == {
        name: ["controller", "goals"] for name in ("alpha", "beta", "boat")
    }
    assert shared[0].parameters["robots"] == ["alpha", "beta", "boat"]
    plants = json.loads(str(shared[1].parameters["plants"]))
    for name, words in plants.items():
        assert f"__ns:=/{name}" in words and "clock:=false" in words


def test_every_node_of_a_robot_lives_under_its_name_and_no_topic_is_renamed():
    _, robots = fleet_rows(fleet_plan("fleet", FleetChoices(record="x", standing=True)))
    for name, rows in robots.items():
        assert {spec.namespace for spec in rows} == {f"/{name}"}
        assert not any(spec.remappings for spec in rows)


def test_each_robot_has_a_recorder_and_a_bag_of_its_own_where_that_is_asked_for():
    plan = fleet_plan("fleet", FleetChoices(record="x", record_each=True))
    shared, robots = fleet_rows(plan)
    assert [spec.name for spec in shared] == ["fleet"]
    recorders = {
        name: next(spec for spec in rows if spec.name == "recorder") for name, rows in robots.items()
    }
    assert {name: spec.parameters["directory"] for name, spec in recorders.items()} == {
        name: f"x/{name}" for name in ("alpha", "beta", "boat")
    }
    info = json.loads(str(recorders["alpha"].parameters["run_info"]))
    assert info["name"] == "alpha" and info["neighbours"] and "robots" not in info
    assert "robots" not in recorders["alpha"].parameters


def test_a_robot_is_kept_apart_from_every_other_one():
    _, robots = fleet_rows(fleet_plan("fleet", FleetChoices(record="x")))
    of = {name: rows[0].parameters.get("neighbours") for name, rows in robots.items()}
    assert of == {
        "alpha": ["beta floating_platform guarded", "boat kingfisher"],
        "beta": ["alpha floating_platform guarded", "boat kingfisher"],
        "boat": None,
    }
    _, robots = fleet_rows(fleet_plan("fleet", FleetChoices(record="x", keep_apart=False)))
    assert not any("neighbours" in rows[0].parameters for rows in robots.values())
