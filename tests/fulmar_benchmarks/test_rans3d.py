"""`fulmar benchmark rans3d`, on few episodes, and what it is made of."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

pytest.importorskip("mujoco")

from fulmar_benchmarks.catalogue import choice
from fulmar_benchmarks.outcomes import keys_of
from fulmar_benchmarks.rans3d import pace
from fulmar_benchmarks.rans3d.campaign import Rans3d, cell_of, pair_of
from fulmar_benchmarks.rans3d.document import document_of, figures_of
from fulmar_benchmarks.rans3d.tables import shown
from fulmar_benchmarks.rans3d.targets import DEAD, EPISODES, ROBOTS, SHIPPED, TASKS, published
from fulmar_benchmarks.rans3d.unit import HELD, SpaceExtra, longest_run, started_within
from fulmar_benchmarks.results import PairResult
from fulmar_benchmarks.tables import print_shown
from fulmar_cli.main import app
from fulmar_core.config.errors import UnknownNameError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import Episode, draw_episodes
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from fulmar_evaluation.bounds.space_tour import most_targets

FEW = "benchmark rans3d --episodes 2 --robots spacecraft_16 --tasks go_to_pose_3d --controllers lqr,policy"
CELL = {"success_rate", "position_error_m", "attitude_error_deg", "episodes", "published"}


def request_of(out, episodes=1, **more):
    return choice("rans3d", out=out, episodes=episodes, seed=1, **more)


def run(words: str, *more: str):
    return CliRunner().invoke(app, [*words.split(), *more], catch_exceptions=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("rans3d")


@pytest.fixture(scope="module")
def evaluated(folder):
    words = f"{FEW} --parts tasks,integrator --tumble-s 60"
    return run(words, "--policies", str(folder / "none"), "--out", str(folder), "--json")


def test_every_cell_has_the_keys_that_others_read(evaluated, folder):
    assert evaluated.exit_code == 0, evaluated.output
    document = json.loads(evaluated.stdout)
    assert json.loads((folder / "rans3d.json").read_text()) == document
    assert set(document["tasks"]) == {"go_to_pose_3d"}
    assert document["int_ball2"] == {}
    cell = document["tasks"]["go_to_pose_3d"]["lqr"]
    assert set(cell) >= CELL
    assert (cell["status"], cell["episodes"], cell["success_rate"]) == ("evaluated", 2, 1.0)
    assert 0.0 < cell["position_error_m"] < 0.05
    assert 0.0 < cell["attitude_error_deg"] < 5.0
    assert cell["published"]["position_tolerance_m"] == 0.01
    assert "RANS" in cell["published"]["source"]
    assert set(cell["figures"]["final_position_error_m"]) == {"mean", "median", "p95"}
    assert 0.0 < cell["duty"] < 0.5
    assert cell["randomised"]["holdable"]["episodes"] <= cell["randomised"]["episodes"] == 2


def test_a_bundle_that_is_missing_leaves_an_empty_cell_and_says_how_to_make_it(evaluated):
    cell = json.loads(evaluated.stdout)["tasks"]["go_to_pose_3d"]["policy"]
    assert set(cell) >= CELL
    assert (cell["success_rate"], cell["position_error_m"], cell["attitude_error_deg"]) == (None, None, None)
    assert (cell["status"], cell["episodes"]) == ("missing", 0)
    assert "`fulmar policies spacecraft_16_go_to_pose_3d`" in cell["reason"]


def test_the_integrator_is_named_with_its_order_steps_and_drifts_in_both_precisions(evaluated):
    found = json.loads(evaluated.stdout)["integrator"]
    assert found["order"] > 3.7
    craft = found["robots"]["spacecraft_16"]
    assert craft["step_s"] == load_robot("spacecraft_16").timing.physics_dt
    assert craft["float64"]["energy"] < 1e-9 < craft["float32"]["energy"]
    assert set(craft["float64"]) == {"energy", "momentum", "from_jacobi"}


def test_mujoco_keeps_the_tumble_by_runge_kutta_as_we_do_and_not_by_euler(evaluated):
    found = json.loads(evaluated.stdout)["integrator"]
    ours, theirs = found["robots"]["spacecraft_16"], found["mujoco"]
    assert theirs["step_s"] == ours["step_s"]
    assert theirs["RK4"]["from_jacobi"] == pytest.approx(ours["float64"]["from_jacobi"], rel=0.1)
    assert theirs["Euler"]["energy"] > 1e-3


def test_requirements_count_what_was_measured(evaluated):
    document = json.loads(evaluated.stdout)
    lines = {line["name"]: line for line in document["requirements"]}
    assert lines["spacecraft_16, go_to_pose_3d, lqr, nominal: success"]["met"] is True
    assert document["asked"] == len(lines) == 6  # LQR; the policy, twice; three of the integrator
    assert (document["met"], document["open"]) == (4, 2)


def test_every_key_is_written_down(evaluated):
    text = (Path(__file__).parents[2] / "docs" / "evaluation.md").read_text()
    document = json.loads(evaluated.stdout)
    cell = document["tasks"]["go_to_pose_3d"]["lqr"]
    keys = {*document, *cell, *document["integrator"], *document["requirements"][0], "holdable"}
    assert [key for key in sorted(keys) if f"`{key}`" not in text] == []


def test_what_was_evaluated_before_is_taken_from_the_folder_and_drawn(evaluated, folder):
    again = run(f"{FEW} --parts tasks", "--policies", str(folder / "none"), "--out", str(folder))
    assert again.exit_code == 0, again.output
    assert again.stderr.count("evaluated before") == 2
    assert "Go to pose 3-D" in again.stdout
    assert "there is no bundle spacecraft_16_go_to_pose_3d" in again.stdout
    assert (folder / "index.html").is_file()
    assert (folder / "pictures" / "spacecraft_16_over_time.png").is_file()  # word: folder of reports


def test_a_check_with_a_missing_bundle_ends_with_one(evaluated, folder):
    few = f"{FEW} --parts tasks --no-report --check"
    assert run(few, "--policies", str(folder / "none"), "--out", str(folder)).exit_code == 1


@pytest.mark.parametrize("option", ["--robots", "--tasks", "--controllers", "--scenarios", "--parts"])
def test_unknown_names_are_refused_before_anything_is_evaluated(option, tmp_path):
    with pytest.raises(UnknownNameError, match="kite"):
        run("benchmark rans3d", option, "kite", "--out", str(tmp_path / "out"))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("task", "file", "settings"),
    [
        ("go_to_position_3d", "MFP3D_GoToXYZ.yaml", {
            "position_tolerance_m": 0.01, "start_distance_m": [0.25, 6.0], "kill_distance_m": 8.0, "episode_steps": 450,
        }),
        ("go_to_pose_3d", "MFP3D_GoToPose.yaml", {
            "position_tolerance_m": 0.01, "attitude_tolerance_rad": 0.025, "start_distance_m": [0.25, 6.0],
            "kill_distance_m": 8.0, "episode_steps": 450,
        }),
        ("track_velocities_3d", "MFP3D_Track6DoFVelocity.yaml", {
            "velocity_tolerance_m_s": 0.01, "rate_tolerance_rad_s": 0.025, "most_speed_m_s": 0.75,
            "most_rate_rad_s": 0.75, "episode_steps": 250,
        }),
    ],
)  # fmt: skip
def test_the_spacecraft_has_all_that_rans_sets(task, file, settings):
    shared = {"consecutive_steps": 50, "control_hz": 5.0, "physics_dt_s": 0.02}
    source = f"elharirymatteo/RANS at 6f2720b, {file}"
    assert published("spacecraft_16", task) == settings | shared | {"source": source}


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("task", TASKS)
def test_every_pair_has_published_settings_and_laws(robot, task, tmp_path):
    assert published(robot, task)["source"]
    request = request_of(tmp_path, policies=tmp_path)
    for name in ("lqr", "pd"):
        assert not pair_of(request, robot, task, name).missing
    reason = pair_of(request, robot, task, "policy").reason
    assert ("fulmar policies" if task in SHIPPED[robot] else "fulmar train") in reason


@pytest.mark.parametrize("task", TASKS)
def test_int_ball2_starts_within_two_metres_and_has_a_minute(task, tmp_path):
    request = request_of(tmp_path, 64)
    trial = cell_of(request, pair_of(request, "int_ball2", task, "lqr"), "nominal").trial
    farthest, seconds = EPISODES["int_ball2"]
    assert trial.task.episode_s == seconds
    drawn = trial.drawn(np.arange(64))
    if trial.task.goal_topic != "goal_velocity":
        assert np.max(drawn.start.distance_to(np.asarray(drawn.goal.targets)[:, 0])) <= farthest


def test_the_start_decides_on_what_is_kept(tmp_path):
    """Outcomes of other starts are not taken for these."""
    request = request_of(tmp_path)
    pair = pair_of(request, "spacecraft_16", "go_to_pose_3d", "lqr")
    units = [cell_of(request, each, "nominal") for each in (pair, replace(pair, robot="int_ball2"))]
    assert len(set(keys_of(units).values())) == 2
    task = load_task("go_to_pose_3d")
    assert started_within(task, 0.1).start.distance == (0.1, 0.1)


def test_a_run_of_steps_is_counted_in_one_piece():
    truths = np.array([[1, 1, 0, 1, 1, 1], [0, 0, 0, 0, 0, 0], [1, 1, 1, 1, 1, 1]], dtype=bool)
    assert longest_run(truths).tolist() == [3, 0, 6]


@pytest.mark.parametrize(("scenario", "count"), DEAD.items())
def test_so_many_thrusters_are_dead_in_every_episode(scenario, count):
    drawn = draw_episodes(
        load_robot("spacecraft_16"),
        load_task("go_to_pose_3d"),
        load_scenario(scenario),
        seed=1,
        numbers=np.arange(20),
    )
    assert np.sum(drawn.world.alive == 0.0, axis=0).tolist() == [count] * 20


def test_only_disturbed_episodes_are_asked_whether_they_can_be_held(tmp_path):
    request = request_of(tmp_path, 3)
    pair = pair_of(request, "spacecraft_16", "go_to_pose_3d", "lqr")
    calm, disturbed = (
        SpaceExtra(cell_of(request, pair, name).trial).arrays() for name in ("nominal", "randomised")
    )
    assert calm == {}
    assert disturbed[HELD].shape == (3,)


def result_of(succeeded, held=None):
    """An outcome with these successes."""
    nothing = np.zeros((len(succeeded), 1))
    about = {
        "scenario": "randomised", "control_hz": 5.0, "episode_s": 90.0, "control_steps": 1, "wall_s": 1.0,
    }  # fmt: skip
    figures = {"final_position_error_m": np.arange(len(succeeded), dtype=float), "effort": nothing[:, 0]}
    more = {} if held is None else {HELD: np.array(held)}
    return PairResult(about, np.array(succeeded), figures, *([nothing] * 7), more=more)


def test_success_among_those_that_can_be_held_leaves_the_others_out():
    found = figures_of(result_of([True, False, True, False], [True, False, True, True]))
    assert found["success_rate"] == 0.5
    assert (found["holdable"]["episodes"], found["holdable"]["success_rate"]) == (3, pytest.approx(2 / 3))
    assert found["holdable"]["position_error_m"] == pytest.approx(5 / 3)
    assert found["attitude_error_deg"] is None


def test_nothing_that_can_be_held_is_no_success():
    found = figures_of(result_of([False], [False]))
    assert (found["holdable"]["episodes"], found["holdable"]["success_rate"]) == (0, None)


def to_and_fro(distance):
    """One episode that starts at the second of two waypoints, which lie along the world's z."""
    robot, task = load_robot("spacecraft_16"), load_task("go_through_poses_3d")
    drawn = draw_episodes(robot, task, load_scenario("nominal"), seed=1, numbers=np.arange(1))
    targets = np.zeros((1, 2, 7))
    targets[..., 6], targets[0, 1, 2] = 1.0, distance
    start = SpatialState.resting(targets[:, 1])
    return robot, task, Episode(start, replace(drawn.goal, targets=targets), drawn.world)


def test_the_bound_counts_what_a_point_mass_passes_along_a_line():
    robot, task, drawn = to_and_fro(4.0)
    found = most_targets(robot, task, drawn)
    # From rest to rest and back, full thrust to the middle; it need not stop inside of the spheres.
    way = 4.0 - 2.0 * task.tolerance.position
    leg_s = 2.0 * np.sqrt(way * robot.body.mass / robot.performance.force)
    assert task.episode_s / leg_s - 1.0 <= found[0] <= 1.5 * task.episode_s / leg_s + 1.0


def test_targets_are_printed_beside_their_bound(tmp_path, capsys):
    request = request_of(
        tmp_path, 2, robots=("spacecraft_16",), tasks=("go_through_poses_3d",), controllers=("lqr",),
        scenarios=("nominal",), parts=("tasks",),
    )  # fmt: skip
    place = ("spacecraft_16", "go_through_poses_3d", "lqr")
    result = result_of([True, True])
    result.figures["goals_reached"] = np.array([5.0, 10.0])
    document = document_of(
        request, pairs={place: pair_of(request, *place)}, keys=[(*place, "nominal")],
        found={(*place, "nominal"): result}, bounds={place[:2]: np.array([10, 20])}, integrator=None,
        throughput=None,
    )  # fmt: skip
    cell = document["tasks"]["go_through_poses_3d"]["lqr"]
    assert (cell["goals_reached"], cell["goals_bound"], cell["share_of_bound"]) == (7.5, 15.0, 0.5)
    print_shown(shown(document), Console(), 180)
    assert "7.5 of 15.0" in capsys.readouterr().out


def test_an_evaluation_that_fails_is_named_and_open(tmp_path):
    request = request_of(
        tmp_path, 1, robots=("spacecraft_16",), tasks=("go_to_pose_3d",), controllers=("lqr",),
        scenarios=("nominal",), parts=("tasks",),
    )  # fmt: skip
    place = ("spacecraft_16", "go_to_pose_3d", "lqr")
    key = (*place, "nominal")
    document = document_of(
        request, pairs={place: pair_of(request, *place)}, keys=[key], found={key: "RunFailed: it fell"},
        bounds={}, integrator=None, throughput=None,
    )  # fmt: skip
    cell = document["tasks"]["go_to_pose_3d"]["lqr"]
    assert (cell["status"], cell["reason"]) == ("failed", "nominal: RunFailed: it fell")
    assert [check.met for check in Rans3d(request).checks(document)] == [None]


def test_the_pace_has_both_integrators_of_mujoco_and_says_why_nothing_is_compiled(monkeypatch):
    pytest.importorskip("torch")
    monkeypatch.setenv("CXX", "no-such-compiler")
    steps = []
    found = pace.measure_pace(
        worlds=8, cores=1, seconds=0.02, progress=lambda done, total: steps.append(done)
    )
    assert found["numpy"]["mujoco_integrator"] == "RK4"
    assert found["numpy"]["ratio_with_euler"] > 0.0
    assert found["compiled"] is None
    assert "compiled" in found["reason"]
    assert steps == [1.0, 2.0, 3.0, 4.0, 5.0]
