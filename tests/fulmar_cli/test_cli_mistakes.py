"""Every mistake at the command line gets one line that says what to do, exit code 2 and no traceback."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from fulmar_core.config.paths import config_directory
from fulmar_core.loop import policy_bundle
from tests.fulmar_cli.command_line import EVALUATE, RUN, SHIPPED, complaint

CRAFT = ["run", "spacecraft_16"]
IN_SPACE = "'spacecraft_16' moves in space: 3 (x,y,z) or 6 (x,y,z,roll,pitch,yaw)"


@pytest.fixture
def broken_configs(tmp_path, monkeypatch):
    """A copy of the configuration, to be broken."""
    folder = shutil.copytree(config_directory(), tmp_path / "configs")
    monkeypatch.setenv("FULMAR_CONFIGS", str(folder))
    return folder


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        (["lst"], "No such command 'lst'. Did you mean 'list'?"),
        (["bundle", "shov", "x"], "No such command 'shov'. Did you mean 'show'?"),
        (["list", "--jsno"], "--jsno"),
        (["run"], "say which robot: fulmar run ROBOT"),
        (["list", "robot"], "unknown family 'robot'. Did you mean 'robots'?"),
        (["run", "floating_platfrom"], "unknown robot 'floating_platfrom'. Did you mean 'floating_platform'?"),
        ([*RUN, "--task", "go_to"], "unknown task 'go_to'"),
        (
            ["run", "turtlebot2", "--task", "race_gates", "--controller", "classical", "--goal", "1,2,0"],
            "no classical law does 'race_gates'",
        ),
        (
            ["run", "turtlebot2", "--task", "race_waypoints", "--controller", "classical", "--goal", "1,2,0"],
            "the targets of task 'race_waypoints' do not fit into one --goal",
        ),
        (
            ["run", "leatherback", "--controller", "lqr"],
            "controller 'lqr' is for robots that are pushed over a floor or water",
        ),
        (
            [*RUN, "--controller", "fuzzy"],
            "unknown controller 'fuzzy'. Known: adaptive, classical, excite, external, lqi, lqr, lqr_drift, mpc, "
            "mppi, pd, pid, policy.",
        ),
        (
            ["evaluate", "floating_platform", "go_to_pose", "--controller", "pd"],
            "'pd' is for bodies that are pushed in space with thrusters or fans, satellites that only turn with "
            "reaction_wheels; 'floating_platform' is one of the robots that are pushed over a floor or water",
        ),
        (
            ["evaluate", "spacecraft_16", "go_to_pose", "--controller", "pd"],
            "'go_to_pose' is for robots that are pushed over a floor or water and robots on wheels; 'spacecraft_16' is "
            "one of the bodies that are pushed in space. Did you mean 'go_to_pose_3d'?",
        ),
        (
            ["evaluate", "spacecraft_16", "track_velocities_3d", "--controller", "excite"],
            "'track_velocities_3d' has none. Use --task with one of: go_to_position_3d, go_to_pose_3d.",
        ),
        ([*RUN, "--backend", "basilisk"], "Basilisk simulates spacecraft and satellites only, and "),
        ([*RUN, "--backend", "gazebo"], "unknown backend 'gazebo'. Known: basilisk, hardware, jsbsim, mock, mujoco."),
        (["run", "jetbot", "--backend", "hardware"], "there is no hardware driver for 'jetbot'"),
        ([*RUN, "--backend", "hardware"], "a real robot goes nowhere by chance: say where with --goal"),
        ([*RUN, "--backend", "hardware", "--emulate", "--lockstep"], "a device runs in real time"),
        (["commission", "turtlebot3"], "Did you mean 'turtlebot2'?"),
        (["commission", "turtlebot2"], "no valves to click: each pulse moves it. Give --yes"),
        (["commission", "zero_g_lab", "--write"], "--write and --out need --yes"),
        (["commission", "zero_g_lab", "--wiring", "dead"], "--wiring goes with --emulate"),
        (["commission", "zero_g_lab", "--emulate", "--wiring", "deadly"], "Did you mean 'dead'?"),
        (["commission", "kingfisher_ardupilot", "--yes"], "not armed: arm: true or --arm"),
        (["doctor", "--for", "hardwear"], "Did you mean 'hardware'?"),
        (["doctor", "zero_g_lab"], "say `fulmar doctor --for hardware zero_g_lab`"),
        ([*RUN, "--name", "Alpha"], "the name 'Alpha' of a robot must begin with a small letter"),
        ([*RUN, "--name", ""], "the name '' of a robot must begin with a small letter"),
        (["up", "mock_lqr", "--name", "a/b"], "the name 'a/b' of a robot must"),
        (["goals", "lab_pose", "--robot", "floating_platform", "--name", "a b"], "the name 'a b' of a robot must"),
        (["teleop", "floating_platform", "--name", "2a"], "the name '2a' of a robot must"),
        (["swap", "a-b", "somewhere"], "the name 'a-b' of a robot must"),
        ([*RUN, "--origin", "1,2"], "--origin 1,2: an origin has three, four or six finite numbers"),
        (["up", "mock_lqr", "--origin", "1e9,0,0"], "an origin lies at most 1,000,000 m away"),
        ([*RUN, "--arm"], "--arm is for autopilots"),
        (
            ["run", "kingfisher", "--backend", "hardware", "--hardware", "kingfisher_ardupilot", "--emulate"],
            "not armed: arm: true or --arm",
        ),
        ([*RUN, "--emulate"], "--hardware and --emulate go with --backend hardware, not with mujoco."),
        (
            [*RUN, "--backend", "hardware", "--hardware", "zero_g_lap"],
            "unknown hardware 'zero_g_lap'. Did you mean 'zero_g_lab'?",
        ),
        ([*RUN, "--backend", "hardware", "--hardware", "turtlebot2"], "is the hardware of 'turtlebot2'"),
        ([*RUN, "--goal", "nan,0,0"], "--goal = 'nan,0,0': 'nan' is no finite number. Give x,y or x,y,deg [m, deg]"),
        ([*RUN, "--goal", "1"], "--goal = '1' has 1 number; 'floating_platform' moves in two dimensions: 2 (x,y) or"),
        (["run", "jetbot", "--goal", "1,2,90", "--controller", "policy"], "Say --task go_to_position or --goal x,y"),
        ([*RUN, "--start", "a,b,c"], "--start = 'a,b,c': 'a' is no finite number"),
        ([*RUN, "--area=2,-2,0,1"], "--area = '2,-2,0,1' must be x_min,x_max,y_min,y_max"),
        ([*CRAFT, "--goal", "1,0,-0.5,0,30"], f"--goal = '1,0,-0.5,0,30' has 5 numbers; {IN_SPACE} are needed"),
        ([*CRAFT, "--goal", "nan,0,0"], "--goal = 'nan,0,0': 'nan' is no finite number. Give x,y,z or x,y,z,roll"),
        ([*CRAFT, "--goal", "a,0,0"], "--goal = 'a,0,0': 'a' is no finite number. Give x,y,z or x,y,z,roll,pitch,yaw"),
        ([*CRAFT, "--start", "0,0,0,0,0"], f"--start = '0,0,0,0,0' has 5 numbers; {IN_SPACE} are needed"),
        (["goals", "--robot", "spacecraft_16", "--pose", "1,2,3,4,5"], f"has 5 numbers; {IN_SPACE} are needed"),
        (["run", "spacecraft", "--goal", "1,2,3,4,5"], "unknown robot 'spacecraft'"),
        ([*CRAFT, "--area=-2,2,-2,2,1,-1"], "In space z_min,z_max follow, with z_min < z_max."),
        ([*RUN, "--area=1,2,3"], "--area = '1,2,3' must be x_min,x_max,y_min,y_max"),
        ([*RUN, "--goal", "3,0,0", "--area=-2,2,-1,1"], "the goal x = 3 m, y = 0 m lies outside the area of x -2 to"),
        (["goals", "--robot", "kingfisher", "--pose", "0,1001"], "x = 0 m, y = 1001 m lies 1,001 m from the origin"),
        (["up", "mujoco_lab", "--start", "9,0,0"], "the start x = 9 m, y = 0 m lies outside the area of x -8 to 8 m"),
        ([*RUN, "--max-run-time", "0"], "--max-run-time"),
        ([*RUN, "--duration", "nan"], "duration"),
        ([*RUN, "--rate", "nan"], "rate"),
        ([*RUN, "--seed", "-1"], "--seed"),
        ([*RUN, "--lockstep", "--rate", "2"], "--lockstep runs as fast as it goes; it takes no --rate"),
        ([*RUN, "--goal", "0,0,0", "--start", "99,0,0"], "99.0 m apart, the geofence"),
        ([*RUN, "--policy", "/nowhere"], "policy '/nowhere': the folder does not exist"),
        ([*RUN, "--policy", "floating_platform_go_to_pos"], f"does not exist. Nearest bundles: {SHIPPED}"),
        ([*RUN, "--policy", f"{SHIPPED}/policy.onnx"], "is a file; a policy is the folder around it"),
        ([*RUN, "--control-hz", "7"], "control_hz = 7 must divide"),
        ([*RUN, "--controller", "lqr", "--control-hz", "1"], "the watchdog closes the actuators after 500 ms"),
        ([*RUN, "--controller", "lqr", "--policy", SHIPPED], "controller 'lqr' runs no policy bundle"),
        ([*EVALUATE, "--policy", SHIPPED], "controller 'lqr' runs no policy bundle"),
        ([*RUN, "--record", "/tmp"], "/tmp exists already; nothing recorded is overwritten"),
        ([*EVALUATE, "--through", "gazebo"], "unknown way 'gazebo'. Known: basilisk, batch, jsbsim, mujoco, ros."),
        ([*EVALUATE, "--scenario", "storm"], "unknown scenario 'storm'"),
        ([*EVALUATE, "--episodes", "0"], "--episodes"),
        ([*EVALUATE, "--episodes", "many"], "--episodes"),
        ([*EVALUATE, "--episodes", "10000001"], "--episodes = 10,000,001 is too many: at most 10,000,000."),
        ([*EVALUATE, "--episodes", "9999999", "--worlds", "9999999"], "--worlds = 9,999,999 needs about"),
        ([*EVALUATE, "--through", "mujoco", "--episodes", "9999999", "--steps", "9999"], "are free: at most"),
        ([*EVALUATE, "--steps", "10000001"], "--steps = 10,000,001 is too many"),
        (["benchmark", "roboran", "--episodes", "9999999"], "--episodes = 9,999,999 needs about"),
        (["benchmark", "drift", "--episodes", "9999999"], "--episodes = 9,999,999 needs about"),
        (["benchmark", "drift", "--jobs", "999999"], "--jobs = 999,999 needs about"),
        (["benchmark", "throughput", "--worlds", "9999999"], "--worlds = 9,999,999 needs about"),
        (["benchmark", "throughput", "--cores", "999999"], "--cores = 999,999 needs about"),
        (["benchmark", "training", "--at-once", "999999"], "--at-once = 999,999 needs about"),
        ([*EVALUATE, "--seed", "99999999999999999999999"], "--seed"),
        ([*EVALUATE, "--control-hz", "nan"], "control"),
        (["evaluate", "floating_platform", "go_to_pose", "--control-hz", "50"], "would run at 50 Hz"),
        (["bundle", "show", "/nowhere"], "policy '/nowhere': the folder does not exist"),
        (["bundle", "check", "/nowhere"], "policy '/nowhere': the folder does not exist"),
        (["report", "/nowhere"], "/nowhere"),
        (["report", __file__], Path(__file__).name),
        (["export", "/nowhere", "--out", "x"], "/nowhere: no finished training run"),
        (["train", "floating_platform", "go_to"], "unknown task 'go_to'"),
        (["benchmark", "roboran", "--tasks", ","], "names no task"),
        (["benchmark", "drift", "--controllers", ","], "names no controller"),
        (["train", "floating_platform", "go_to_pose", "--seed", "1000003"], "reserved for evaluation"),
        (["train", "floating_platform", "go_to_pose", "--seeds", "10000001"], "--seeds = 10,000,001 is too many"),
        (["train", "floating_platform", "go_to_pose", "--episodes", "9999999"], "--episodes = 9,999,999 needs"),
    ],
    ids=lambda value: " ".join(value)[-45:] if isinstance(value, list) else "",
)  # fmt: skip
def test_a_mistake_gets_one_line_and_exit_code_2(fulmar, words, reported, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if words[0] in ("train", "export"):
        pytest.importorskip("stable_baselines3")
    assert reported in complaint(fulmar(*words))
    assert list(tmp_path.iterdir()) == []


def test_export_overwrites_no_bundle_without_force(fulmar, tmp_path):
    pytest.importorskip("stable_baselines3")
    folder = shutil.copytree(SHIPPED, tmp_path / "bundle")
    words = ("export", "/nowhere", "--out", folder)
    assert f"{folder} exists already and is not empty" in complaint(fulmar(*words))
    assert "/nowhere: no finished training run" in complaint(fulmar(*words, "--force"))
    (tmp_path / "empty").mkdir()
    assert "/nowhere: no finished" in complaint(fulmar("export", "/nowhere", "--out", tmp_path / "empty"))


@pytest.mark.parametrize(
    ("file", "text", "reported"),
    [
        ("robots/floating_platform.yaml", "name: [", "robots/floating_platform.yaml:1: not valid YAML"),
        ("robots/floating_platform.yaml", "", "robots/floating_platform.yaml:1: the file is empty"),
        (
            "robots/floating_platform.yaml",
            "\n" * 99 + "bodyy: x\n",
            "floating_platform.yaml:100: unknown key 'bodyy'",
        ),
        (
            "tasks/go_to_pose.yaml",
            "kind: go_to_pos\n",
            "go_to_pose.yaml:1: 'kind' = 'go_to_pos' is not known",
        ),
        (
            "controllers/floating_platform_lqr.yaml",
            "position: .nan\n",
            "'position' = nan must be a finite number",
        ),
        ("scenarios/nominal.yaml", "title: 3\n", "scenarios/nominal.yaml:1: 'title' = 3 must be text"),
    ],
)
def test_a_broken_file_is_reported_with_its_line(fulmar, broken_configs, file, text, reported):
    (broken_configs / file).write_text(text)
    assert reported in complaint(fulmar(*EVALUATE, "--episodes", "1"))


def test_the_list_shows_the_good_files_and_a_line_for_each_broken_one(fulmar, broken_configs):
    (broken_configs / "robots" / "jetbot.yaml").write_text("name: [")
    text = (broken_configs / "robots" / "turtlebot2.yaml").read_text()
    (broken_configs / "robots" / "turtlebot2.yaml").write_text(text.replace("radius: 0.177", "radius: 177"))
    code, out, err = fulmar("list", "robots")
    assert code == 1
    assert "floating_platform          air-bearing platform" in out
    broken, wrong = err.splitlines()
    assert "robots/jetbot.yaml:1: not valid YAML" in broken
    assert "'body.radius' = 177 m is not plausible" in wrong
    code, out, _ = fulmar("list", "robots", "--json")
    found = json.loads(out)
    assert code == 1
    assert "leatherback" in found["robots"]
    assert {error["name"] for error in found["errors"]} == {"jetbot", "turtlebot2"} - set(found["robots"])


def test_an_unusual_value_is_one_warning_and_no_error(fulmar, broken_configs):
    file = broken_configs / "robots" / "floating_platform.yaml"
    file.write_text(file.read_text().replace("thrust: 1.0", "thrust: 40.0"))
    code, out, err = fulmar("list", "--json")
    assert code == 0
    assert "floating_platform" in json.loads(out)["robots"]
    (line,) = err.splitlines()
    assert line.startswith("warning: ")
    assert "'actuators.thrust' = 40 N is unusual" in line


def test_a_geofence_smaller_than_the_starts_is_refused_before_anything_runs(fulmar, broken_configs):
    file = broken_configs / "robots" / "floating_platform.yaml"
    file.write_text(file.read_text().replace("geofence: 8.0", "geofence: 2.0"))
    for words in (EVALUATE, [*RUN, "--controller", "lqr"], [*RUN, "--controller", "lqr", "--goal", "1,0,0"]):
        assert "'limits.geofence' = 2 m of robot 'floating_platform' is smaller" in complaint(fulmar(*words))


def test_a_robot_of_one_s_own_is_one_file_beside_those_that_come_with_fulmar(fulmar, tmp_path, monkeypatch):
    """It runs at once with default gains, and then with those of a file."""
    monkeypatch.chdir(tmp_path)
    shipped = config_directory()
    (tmp_path / "mine" / "robots").mkdir(parents=True)
    text = (shipped / "robots" / "turtlebot2.yaml").read_text().replace("name: turtlebot2", "name: mybot")
    (tmp_path / "mine" / "robots" / "mybot.yaml").write_text(text)
    assert "set FULMAR_CONFIGS=FOLDER, and say 'mybot'" in complaint(
        fulmar("evaluate", "mine/robots/mybot.yaml", "go_to_position")
    )
    monkeypatch.setenv("FULMAR_CONFIGS", "mine")
    assert {"mybot", "turtlebot2"} <= set(json.loads(fulmar("list", "robots", "--json")[1])["robots"])
    words = ("evaluate", "mybot", "go_to_position", "--through", "batch", "--episodes", "4")
    code, out, err = fulmar(*words, "--controller", "classical", "--json")
    assert (code, json.loads(out)["success_rate"]) == (0, 1.0)
    assert "info: no gains file: default gains of 'polar'" in err
    (tmp_path / "mine" / "controllers").mkdir()
    shutil.copy(shipped / "controllers" / "turtlebot2_polar.yaml", "mine/controllers/mybot_polar.yaml")
    code, out, err = fulmar(*words, "--controller", "classical", "--json")
    assert (code, json.loads(out)["success_rate"], "gains" in err) == (0, 1.0, False)
    assert "or use --controller classical." in complaint(fulmar(*words))


def test_a_configuration_folder_that_is_none_is_reported(fulmar, tmp_path, monkeypatch):
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    assert "Set FULMAR_CONFIGS" in complaint(fulmar("list"))


@pytest.mark.parametrize("name", ["policy.onnx", "golden.npz", "passport.json"])
def test_a_damaged_bundle_is_reported(fulmar, tmp_path, name):
    folder = shutil.copytree(SHIPPED, tmp_path / "bundle")
    (folder / name).write_bytes(b"broken")
    line = complaint(fulmar("evaluate", "floating_platform", "go_to_pose", "--policy", str(folder)))
    assert name in line
    assert name in complaint(fulmar("bundle", "check", str(folder)))


def test_a_bundle_for_a_rate_that_the_robot_cannot_keep_is_not_accepted(fulmar, monkeypatch):
    slow = replace(policy_bundle.read_passport(Path(SHIPPED)), control_hz=7.0)
    monkeypatch.setattr(policy_bundle, "read_passport", lambda _folder: slow)
    assert "control_hz = 7 must divide the physics rate" in complaint(fulmar("bundle", "check", SHIPPED))


def test_a_run_folder_is_never_trained_into(fulmar, tmp_path):
    pytest.importorskip("stable_baselines3")
    (tmp_path / "run.json").write_text("{}")
    words = ("train", "floating_platform", "go_to_pose", "--out", str(tmp_path))
    assert "nothing recorded is overwritten" in complaint(fulmar(*words))


@pytest.mark.parametrize(
    ("words", "advice"),
    [([*CRAFT, "--controller", "mpc"], "Use --controller classical."),
     (["run", "leatherback", "--controller", "lqr"], "Use --controller classical.")],
)  # fmt: skip
def test_a_controller_of_another_kind_of_robot_gets_one_advice(fulmar, words, advice):
    line = complaint(fulmar(*words))
    assert line.endswith(advice)
    assert line.count("--controller") == 1
