"""What `fulmar benchmark throughput` measures, on batches too small to measure well."""

from __future__ import annotations

import json

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario

mujoco = pytest.importorskip("mujoco")

from fulmar_benchmarks.catalogue import rows  # noqa: E402
from fulmar_benchmarks.jsbsim_pace import JsbsimPace  # noqa: E402
from fulmar_benchmarks.mujoco_pace import SEED, AfloatPace, MujocoPace  # noqa: E402
from fulmar_benchmarks.throughput import BatchPace, Library, SharedPace, shared_worlds  # noqa: E402
from fulmar_cli.commands.benchmark_row import command_of  # noqa: E402
from sim_nodes.mujoco_model import Scene  # noqa: E402

BOAT, TASK, RANDOMISED = load_robot("kingfisher"), load_task("go_to_pose"), load_scenario("randomised")
NUMPY = Library("numpy")
SMALL = "--robots", "turtlebot2", "--worlds", "6", "--seconds", "0.05"
LIBRARY = {"numpy": ("--library", "numpy"), "compiled": ("--library", "compiled"), None: ()}


ONE_OR_TWO_CORES = pytest.mark.parametrize("cores", ["1", pytest.param("2", marks=pytest.mark.slow)])


@pytest.fixture
def command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    app = typer.Typer()
    app.command()(command_of(rows()["throughput"]))
    return lambda *words, library="numpy": CliRunner().invoke(app, (*words, *LIBRARY[library]))


def test_paces_are_measured_again_unless_one_goes_on_with_those_that_are_kept(command):
    small = (
        "--robots",
        "jetbot,turtlebot2",
        "--worlds",
        "6",
        "--seconds",
        "0.05",
        "--cores",
        "1",
        "--json",
    )
    command(*small[2:], "--robots", "turtlebot2")
    whole, again = (json.loads(command(*small, "--resume").stdout) for _ in range(2))
    assert whole["robots"] == again["robots"]
    assert {"machine", "libraries", "git_revision", "command"} <= set(whole)
    assert json.loads(command(*small).stdout)["robots"] != whole["robots"]


@ONE_OR_TWO_CORES
def test_the_json_has_both_paces_of_each_robot_and_their_ratio(command, cores):
    done = command(
        "--robots", "kingfisher,turtlebot2", "--worlds", "16", "--seconds", "0.05", "--cores", cores, "--json"
    )
    assert done.exit_code == 0, done.output
    figures = json.loads(done.stdout)
    assert set(figures["robots"]) == {"kingfisher", "turtlebot2"}
    for found in figures["robots"].values():
        assert found["batch_steps_per_s"] > 0.0
        assert found["ratio"] == pytest.approx(found["batch_steps_per_s"] / found["mujoco_steps_per_s"])
    wet = [name for name, found in figures["robots"].items() if "mujoco_with_water_steps_per_s" in found]
    assert wet == ["kingfisher"]
    boat = figures["robots"]["kingfisher"]
    assert boat["ratio_with_water"] == pytest.approx(
        boat["batch_steps_per_s"] / boat["mujoco_with_water_steps_per_s"]
    )
    assert (figures["worlds"], figures["scenario"], figures["cores"]) == (16, "randomised", int(cores))


def test_robots_in_space_get_their_own_task_and_both_integrators_of_mujoco(command):
    small = "--worlds", "16", "--seconds", "0.05", "--cores", "1"
    done = command("--robots", "spacecraft_16,turtlebot2", *small, "--json")
    figures = json.loads(done.stdout)
    craft, wheels = figures["robots"]["spacecraft_16"], figures["robots"]["turtlebot2"]
    assert (craft["task"], wheels["task"]) == ("go_to_pose_3d", "go_to_pose")
    assert (craft["mujoco_integrator"], wheels["mujoco_integrator"]) == ("RK4", "Euler")
    assert craft["mujoco_step_s"] == load_robot("spacecraft_16").timing.physics_dt
    assert craft["ratio_with_euler"] == pytest.approx(
        craft["batch_steps_per_s"] / craft["mujoco_euler_steps_per_s"]
    )
    assert "ratio_with_euler" not in wheels
    table = command("--robots", "spacecraft_16", *small).stdout
    assert "Euler" in table
    assert "RK4, steps of 0.04 s" in table


def test_aircraft_are_timed_in_jsbsim_too(command):
    small = "--worlds", "16", "--seconds", "0.05", "--cores", "1", "--scenario", "light_turbulence"
    done = command("--robots", "airship_v7", *small, "--json")
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)["robots"]["airship_v7"]
    assert found["task"] == "fly_hold"
    assert found["ratio_with_jsbsim"] == pytest.approx(
        found["batch_steps_per_s"] / found["jsbsim_steps_per_s"]
    )


def test_jsbsim_flies_above_the_ground_and_in_gusts_while_it_is_timed():
    pace = JsbsimPace(load_robot("airship_v7"), 7.7)
    pace.steps_per_s(0.01)
    model = pace._model
    assert model["position/h-agl-ft"] > 10.0
    assert model["simulation/sim-time-sec"] == pytest.approx(2.0)
    assert abs(model["atmosphere/turb-down-fps"]) > 0.1
    still = JsbsimPace(load_robot("airship_v7"), 0.0)
    still.steps_per_s(0.01)
    assert still._model["atmosphere/turb-down-fps"] == 0.0


def test_a_task_of_the_other_space_is_refused_for_robots_that_were_named(command):
    assert "space" in str(command("--robots", "spacecraft_16", "--task", "go_to_pose").exception)


def test_eulers_method_takes_the_same_robot_elsewhere():
    robot = load_robot("spacecraft_16")
    own, other = MujocoPace(robot, threads=1), MujocoPace(robot, threads=1, integrator="Euler")
    assert (own.integrator, other.integrator) == ("RK4", "Euler")
    assert own.step_s == other.step_s


def test_boats_are_rolled_out_in_the_very_water_of_the_plant():
    rolled_out = AfloatPace(BOAT, TASK, RANDOMISED, worlds=3, threads=1)
    plant, full = Scene(BOAT), np.array([1.0, -1.0])
    plant.begin(draw_episode(BOAT, TASK, RANDOMISED, seed=SEED, number=0))
    thrusts = np.tile(np.asarray(BOAT.actuators.thrust(full)), (3, 1))
    for _ in range(200):
        rolled_out.step(thrusts)
        plant.robot_model.drive(plant.model, plant.data, full, np.ones(2), (0.0, 0.0, 0.0))
        mujoco.mj_step(plant.model, plant.data)
    moved = np.concatenate(([plant.data.time], plant.data.qpos, plant.data.qvel))
    assert np.abs(plant.data.qvel[5]) > 0.1  # it turns
    np.testing.assert_allclose(rolled_out.states, np.tile(moved, (3, 1)), rtol=1e-9, atol=1e-12)


def test_without_json_a_table_is_printed(command):
    long = "modular_freeflyer"
    done = command("--robots", f"kingfisher,{long}", "--worlds", "8", "--seconds", "0.05", "--cores", "1")
    assert long in done.stdout
    assert "ratio then ┃" in done.stdout  # nothing is cut off in 80 columns


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (("--device", "tpu"), UnknownNameError),
        (("--library", "jax"), UnknownNameError),
        (("--device", "cuda", "--library", "numpy"), ConfigError),
        (("--robots", "kingfischer"), ConfigError),
    ],
)
def test_what_does_not_exist_is_refused(command, words, error):
    assert isinstance(command(*words, library=None).exception, error)


def test_without_a_graphics_card_cuda_is_refused_in_words(command):
    torch = pytest.importorskip("torch")
    if torch.cuda.is_available():
        pytest.skip("there is a graphics card")
    assert "graphics card" in str(command("--device", "cuda", library=None).exception)


def test_without_a_compiler_numpy_computes_the_batch_and_says_so(command, monkeypatch):
    pytest.importorskip("torch")
    monkeypatch.setenv("CXX", "no-such-compiler")
    done = command(*SMALL, "--cores", "1", "--json", library=None)
    assert json.loads(done.stdout)["library"] == "numpy"
    assert "nothing is compiled" in done.stderr


@ONE_OR_TWO_CORES
def test_whoever_asks_for_compiled_steps_reads_that_a_compiler_is_missing(command, monkeypatch, cores):
    pytest.importorskip("torch")
    monkeypatch.setenv("CXX", "no-such-compiler")
    assert "python3-dev" in str(command(*SMALL, "--cores", cores, library="compiled").exception)


@pytest.mark.slow
def test_steps_are_compiled_where_nobody_says_otherwise(command):
    pytest.importorskip("torch")
    from training.kernel import compiler_found

    if not compiler_found():
        pytest.skip("there is no C++ compiler; that NumPy takes over then is tested above")
    done = command("--robots", "turtlebot2", "--worlds", "64", "--seconds", "0.05", "--json", library=None)
    figures = json.loads(done.stdout)
    assert figures["library"] == "compiled"
    assert figures["robots"]["turtlebot2"]["batch_steps_per_s"] > 0.0


def test_a_step_of_the_batch_observes_rewards_and_begins_new_episodes():
    pace = BatchPace(BOAT, TASK, RANDOMISED, worlds=300, library=NUMPY)
    begun = pace._simulation._repeats.sum()
    pace.steps_per_s(0.2)
    assert np.isfinite(pace.reward).all()
    assert np.isfinite(pace.observation).all()
    assert pace._simulation._repeats.sum() > begun


def test_torch_steps_the_same_worlds_as_numpy():
    pytest.importorskip("torch")
    numpy, torch = (
        BatchPace(BOAT, TASK, RANDOMISED, worlds=50, library=library) for library in (NUMPY, Library("torch"))
    )
    for _ in range(5):
        numpy._step()
        torch._step()
        np.testing.assert_allclose(torch.observation.numpy(), numpy.observation, atol=1e-4)
        np.testing.assert_allclose(torch.reward.numpy(), numpy.reward, atol=1e-4)


def test_shared_worlds_are_shared_out_and_give_one_pace():
    shared = SharedPace(2)
    try:
        shared.take(shared_worlds(BOAT, TASK, RANDOMISED, worlds=9, library=NUMPY, processes=2))
        assert shared.steps_per_s(0.05) > 0.0
    finally:
        shared.close()


@pytest.mark.parametrize("name", ["floating_platform", "kingfisher", "leatherback"])
def test_mujoco_rolls_out_robots_that_move(name):
    pace = MujocoPace(load_robot(name), threads=1)
    assert pace.steps_per_s(0.01) > 0.0
    assert np.ptp(pace._controls, axis=(0, 1)).max() > 0.0
