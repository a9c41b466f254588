"""The camera among the nodes of a plan, and what is refused before any of them is started."""

from dataclasses import replace

import pytest

from fulmar_bringup import renderer_check
from fulmar_bringup.bag_origin import effective_system, run_info
from fulmar_bringup.launched_system import list_nodes
from fulmar_bringup.lockstep_chain import chain_of
from fulmar_bringup.node_spec import ENDS, RESTARTS
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.renderer_check import check_renderer
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import System, modules_of
from fulmar_bringup.system_plan import system_plan
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_path
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.camera import CameraConfig
from fulmar_core.robots.topics import CAMERA_IMAGES, CAMERA_INFO, TRUTH
from sim_nodes.camera import opengl

PLAN = RunPlan("spacecraft_16", "go_to_pose_3d", "pd", "mujoco", 10.0, extras=("camera",))
LOCKSTEP = replace(PLAN, lockstep=True)
PUBLISHED = {wire.name for wire in (*CAMERA_IMAGES, CAMERA_INFO)}


def seeing(robot):
    """A robot with a camera in its file."""
    robot = load_robot(robot)
    return replace(robot, sensors=replace(robot.sensors, camera=CameraConfig()))


def refusal(plan, robot):
    with pytest.raises(ConfigError) as caught:
        check_renderer(plan, robot)
    words = str(caught.value)
    assert "\n" not in words
    return words


def test_by_the_clock_the_camera_only_reads_the_truth_and_its_loss_takes_nothing_away():
    row = system_rows(PLAN, record={})["camera"]
    assert row.module == "sim_nodes.camera_node"
    assert row.inputs == (TRUTH.name,) and {*row.outputs} == PUBLISHED
    assert row.loss == RESTARTS and chain_of(PLAN) == ()
    with_it, without = (system_rows(replace(PLAN, extras=extras)) for extras in (PLAN.extras, ()))
    assert with_it["plant"] == without["plant"] and with_it["controller"] == without["controller"]


def test_in_lock_step_the_camera_answers_each_period_and_its_loss_ends_the_run():
    rows = system_rows(LOCKSTEP, record={})
    assert chain_of(LOCKSTEP) == ("camera",)
    assert rows["plant"].parameters["chain"] == ["camera"] and rows["plant"].parameters["truth_in_period"]
    assert rows["camera"].parameters["lockstep"] and rows["camera"].loss == ENDS
    assert {*rows["camera"].outputs} > PUBLISHED


def test_the_camera_knows_the_things_of_the_world():
    assert system_rows(replace(PLAN, thing="gateway"))["camera"].parameters["thing"] == "gateway"
    pushing = replace(PLAN, robot="turtlebot2", task="push_block", controller="policy")
    assert system_rows(pushing)["camera"].inputs == (TRUTH.name, "block/pose")


def test_a_system_file_may_have_a_camera_and_a_launch_may_ask_for_one(tmp_path, monkeypatch):
    text = config_path("systems", "mujoco_spacecraft").read_text(encoding="utf-8")
    (tmp_path / "systems").mkdir()
    (tmp_path / "systems/seeing.yaml").write_text(f"{text}\ncamera: true\n", encoding="utf-8")
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    assert system_plan("seeing").extras == ("camera",)
    assert system_plan("mujoco_spacecraft").extras == ()
    assert effective_system(replace(system_plan("seeing"), control_hz=10.0)).camera
    assert load_config(System, tmp_path / "systems/seeing.yaml").camera
    with pytest.raises(ConfigError, match="has no camera"):
        list_nodes(system="seeing")
    assert "camera" not in {row.name for row in list_nodes(system="seeing", camera="false")}


def test_bags_of_runs_without_a_camera_say_nothing_of_one():
    assert '"camera": true' in run_info(PLAN)
    assert '"camera"' not in run_info(replace(PLAN, extras=()))


def test_a_camera_needs_mujoco_whatever_simulates():
    assert "mujoco" in modules_of("pd", "mock", camera=True)
    assert "mujoco" not in modules_of("pd", "mock")


def test_a_robot_without_a_camera_is_refused_in_one_line():
    assert "'spacecraft_16' has no camera. Add 'camera' to 'sensors'" in refusal(
        PLAN, load_robot("spacecraft_16")
    )


def test_a_real_robot_gets_no_drawn_camera():
    real = replace(PLAN, robot="floating_platform", backend="hardware")
    assert "a real robot has a camera of its own" in refusal(real, seeing("floating_platform"))


def test_without_a_renderer_nothing_starts(monkeypatch):
    def none():
        raise ConfigError("no renderer for cameras (egl: none). Run: sudo apt-get install libegl1")

    monkeypatch.setattr(renderer_check, "find_platform", none)
    assert "apt-get install libegl1" in refusal(PLAN, seeing("spacecraft_16"))
    check_renderer(replace(PLAN, extras=()), seeing("spacecraft_16"))


@pytest.mark.parametrize(
    ("value", "words"), [("elg", "Did you mean 'egl'?"), ("osmesa", "MuJoCo cannot be loaded with it (gone)")]
)
def test_a_wrong_platform_is_refused_also_where_a_simulator_alone_would_end_by_it(value, words, monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", value)
    monkeypatch.setattr(opengl, "problem_of", lambda _platform: "gone")
    plan = replace(PLAN, extras=())
    assert words in refusal(plan, load_robot("spacecraft_16"))
    with pytest.raises(ConfigError):
        checked(plan)
    check_renderer(replace(plan, backend="mock"), load_robot("spacecraft_16"))


def test_lock_step_takes_a_camera_and_no_markers():
    with pytest.raises(ConfigError, match="takes no --markers"):
        checked(replace(LOCKSTEP, extras=("camera", "markers"), robot="cubesat_8"))
