"""The command line: exit codes, one line for each mistake, JSON and nothing else."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from fulmar_bringup import cli, conductor
from fulmar_core import policy_bundle
from fulmar_core.paths import config_directory
from fulmar_ros import provenance
from policy_server.shipped import shipped_policy

SHIPPED = str(shipped_policy("floating_platform", "go_to_pose"))
EVALUATE = ["evaluate", "floating_platform", "go_to_pose", "--controller", "lqr", "--through", "batch"]


@pytest.fixture
def fulmar(monkeypatch, capsys):
    """Run a command line in this process: exit code, standard output, standard error."""

    def call(*words: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["fulmar", *words])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        captured = capsys.readouterr()
        return int(ended.value.code or 0), captured.out, captured.err

    return call


@pytest.fixture
def broken_configs(tmp_path, monkeypatch):
    """A copy of the configuration, to be broken."""
    folder = shutil.copytree(config_directory(), tmp_path / "configs")
    monkeypatch.setenv("FULMAR_CONFIGS", str(folder))
    return folder


def complaint(result: tuple[int, str, str]) -> str:
    """The one line that a mistake gets; exit code 2, no result, no traceback."""
    code, out, err = result
    assert code == 2
    assert out == ""
    lines = err.splitlines()
    assert len(lines) == 1, err
    assert lines[0].startswith("fulmar: ")
    return lines[0]


RUN = ["run", "floating_platform"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["lst"], "No such command 'lst'. Did you mean 'list'?"),
        (["bundle", "shov", "x"], "No such command 'shov'. Did you mean 'show'?"),
        (["list", "--jsno"], "--jsno"),
        (["run"], "Missing argument 'ROBOT'"),
        (["list", "robot"], "unknown family 'robot'. Did you mean 'robots'?"),
        (["run", "floating_platfrom"], "unknown robot 'floating_platfrom'. Did you mean 'floating_platform'?"),
        ([*RUN, "--task", "go_to"], "unknown task 'go_to'"),
        (
            ["run", "turtlebot2", "--task", "race_gates", "--controller", "classical", "--goal", "1,2,0"],
            "no classical law does 'race_gates'",
        ),
        (
            ["run", "turtlebot2", "--task", "race_waypoints", "--controller", "classical", "--goal", "1,2,0"],
            "the targets of task 'race_waypoints' cannot be said in one --goal",
        ),
        (["run", "leatherback", "--controller", "lqr"], "controller 'lqr' is for robots with thrusters"),
        (
            [*RUN, "--controller", "pid"],
            "unknown controller 'pid'. Known: classical, excite, lqr, lqr_drift, mpc, policy.",
        ),
        ([*RUN, "--backend", "gazebo"], "unknown backend 'gazebo'. Known: hardware, mock, mujoco."),
        (["run", "jetbot", "--backend", "hardware"], "there is no hardware driver for 'jetbot'"),
        ([*RUN, "--backend", "hardware"], "a real robot goes nowhere by chance: say where with --goal"),
        ([*RUN, "--backend", "hardware", "--emulate", "--lockstep"], "a device neither waits nor hurries"),
        ([*RUN, "--emulate"], "--hardware and --emulate go with --backend hardware, not with mujoco."),
        (
            [*RUN, "--backend", "hardware", "--hardware", "zero_g_lap"],
            "unknown hardware 'zero_g_lap'. Did you mean 'zero_g_lab'?",
        ),
        ([*RUN, "--backend", "hardware", "--hardware", "turtlebot2"], "is the hardware of 'turtlebot2'"),
        (
            [*RUN, "--backend", "hardware", "--hardware", "zero_g_lab_valve_node", "--emulate"],
            "there is no emulator for driver 'valve_topic'",
        ),
        ([*RUN, "--goal", "nan,0,0"], "--goal = 'nan,0,0' must be three finite numbers"),
        ([*RUN, "--goal", "1,2"], "--goal = '1,2' must be three finite numbers"),
        ([*RUN, "--start", "a,b,c"], "--start = 'a,b,c' must be three finite numbers"),
        ([*RUN, "--area=2,-2,0,1"], "--area = '2,-2,0,1' must be x_min,x_max,y_min,y_max"),
        ([*RUN, "--area=1,2,3"], "--area = '1,2,3' must be x_min,x_max,y_min,y_max"),
        ([*RUN, "--max-run-time", "0"], "--max-run-time"),
        ([*RUN, "--duration", "nan"], "duration"),
        ([*RUN, "--rate", "nan"], "rate"),
        ([*RUN, "--seed", "-1"], "--seed"),
        ([*RUN, "--lockstep", "--rate", "2"], "--lockstep runs as fast as it goes; it takes no --rate"),
        ([*RUN, "--goal", "0,0,0", "--start", "99,0,0"], "99.0 m apart, the geofence"),
        ([*RUN, "--policy", "/nowhere"], "policy '/nowhere' has no passport.json"),
        ([*RUN, "--control-hz", "7"], "control_hz = 7 must divide"),
        ([*RUN, "--controller", "lqr", "--control-hz", "1"], "the watchdog closes the actuators after 500 ms"),
        ([*RUN, "--controller", "lqr", "--policy", SHIPPED], "controller 'lqr' runs no policy bundle"),
        ([*EVALUATE, "--policy", SHIPPED], "controller 'lqr' runs no policy bundle"),
        ([*RUN, "--record", "/tmp"], "/tmp exists already; nothing recorded is overwritten"),
        ([*EVALUATE, "--through", "gazebo"], "unknown way 'gazebo'. Known: batch, mujoco, ros."),
        ([*EVALUATE, "--scenario", "storm"], "unknown scenario 'storm'"),
        ([*EVALUATE, "--episodes", "0"], "--episodes"),
        ([*EVALUATE, "--episodes", "many"], "--episodes"),
        ([*EVALUATE, "--seed", "99999999999999999999999"], "--seed"),
        ([*EVALUATE, "--control-hz", "nan"], "control"),
        (["evaluate", "floating_platform", "go_to_pose", "--control-hz", "50"], "would run at 50 Hz"),
        (["bundle", "show", "/nowhere"], "policy '/nowhere' has no passport.json"),
        (["bundle", "check", "/nowhere"], "policy '/nowhere' has no passport.json"),
        (["report", "/nowhere"], "/nowhere"),
        (["report", __file__], "test_cli.py"),
        (["export", "/nowhere", "--out", "x"], "/nowhere: no finished training run"),
        (["train", "floating_platform", "go_to"], "unknown task 'go_to'"),
        (["train", "floating_platform", "go_to_pose", "--seed", "1000003"], "kept for judging"),
    ],
    ids=lambda value: " ".join(value)[-45:] if isinstance(value, list) else "",
)  # fmt: skip
def test_a_mistake_gets_one_line_and_exit_code_2(fulmar, words, told, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if words[0] in ("train", "export"):
        pytest.importorskip("stable_baselines3")
    assert told in complaint(fulmar(*words))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("file", "text", "told"),
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
def test_a_broken_file_is_told_with_its_line(fulmar, broken_configs, file, text, told):
    (broken_configs / file).write_text(text)
    assert told in complaint(fulmar(*EVALUATE, "--episodes", "1"))


def test_a_configuration_folder_that_is_none_is_told(fulmar, tmp_path, monkeypatch):
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    assert "Set FULMAR_CONFIGS" in complaint(fulmar("list"))


@pytest.mark.parametrize("name", ["policy.onnx", "golden.npz", "passport.json"])
def test_a_damaged_bundle_is_told(fulmar, tmp_path, name):
    folder = shutil.copytree(SHIPPED, tmp_path / "bundle")
    (folder / name).write_bytes(b"broken")
    line = complaint(fulmar("evaluate", "floating_platform", "go_to_pose", "--policy", str(folder)))
    assert name in line
    assert name in complaint(fulmar("bundle", "check", str(folder)))


def test_a_bundle_for_a_rate_that_the_robot_cannot_keep_is_not_accepted(fulmar, monkeypatch):
    slow = replace(policy_bundle.read_passport(Path(SHIPPED)), control_hz=7.0)
    monkeypatch.setattr(policy_bundle, "read_passport", lambda _folder: slow)
    assert "control_hz = 7 must divide the physics rate" in complaint(fulmar("bundle", "check", SHIPPED))


@pytest.mark.parametrize(
    ("module", "extra", "words"),
    [
        ("mujoco", "sim", [*RUN, "--controller", "lqr"]),
        ("mujoco", "sim", ["evaluate", "floating_platform", "go_to_pose", "--controller", "lqr"]),
        ("onnxruntime", "policy", RUN),
        ("onnxruntime", "policy", ["evaluate", "floating_platform", "go_to_pose"]),
        ("rclpy", "ros", RUN),
        ("mcap", "bags", ["report", "bag"]),
        ("matplotlib", "view", ["report", "bag"]),
        ("torch", "train", ["train", "floating_platform", "go_to_pose"]),
    ],
)
def test_a_part_that_is_not_installed_is_named_with_its_extra(module, extra, words, tmp_path):
    program = (
        f"import sys; sys.modules[{module!r}] = None; sys.argv = {['fulmar', *words]!r}\n"
        "from fulmar_bringup import cli\n"
        "cli.main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True, text=True, timeout=60, check=False, cwd=tmp_path,
    )  # fmt: skip
    told = complaint((done.returncode, done.stdout, done.stderr))
    assert f"needs '{module}', which the extra '{extra}' brings" in told
    assert list(tmp_path.iterdir()) == []


def test_the_doctor_names_the_extra_of_a_part_that_is_not_installed(fulmar, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    code, out, _ = fulmar("doctor", "--json")
    assert code == 1
    (finding,) = (each for each in json.loads(out)["findings"] if each["what"] == "matplotlib")
    assert "'view'" in finding["advice"]


def test_a_run_folder_is_never_trained_into(fulmar, tmp_path):
    pytest.importorskip("stable_baselines3")
    (tmp_path / "run.json").write_text("{}")
    words = ("train", "floating_platform", "go_to_pose", "--out", str(tmp_path))
    assert "nothing recorded is overwritten" in complaint(fulmar(*words))


@pytest.mark.parametrize(
    ("number", "told"), [(signal.SIGTERM, "stopped by SIGTERM"), (signal.SIGINT, "stopped by the user")]
)
def test_a_command_that_is_told_to_stop_says_so_and_ends_with_1(fulmar, monkeypatch, number, told):
    monkeypatch.setattr("fulmar_bringup.evaluation.batches", lambda *_a, **_k: signal.raise_signal(number))
    before = signal.getsignal(signal.SIGTERM)
    try:
        code, out, err = fulmar(*EVALUATE)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert (code, out, err) == (1, "", f"fulmar: {told}\n")


def test_a_revision_is_only_given_for_a_file_that_the_repository_holds(monkeypatch, tmp_path):
    copy = tmp_path / "provenance.py"
    shutil.copy(provenance.__file__, copy)
    for words in (
        ["init"],
        ["-c", "user.name=x", "-c", "user.email=x@x", "commit", "--allow-empty", "-m", "x"],
    ):
        subprocess.run(["git", *words], cwd=tmp_path, check=True, capture_output=True)
    monkeypatch.setattr(provenance, "__file__", str(copy))
    revision = provenance.git_revision.__wrapped__  # without the memory of the checkout that the tests run in
    assert revision() == ""
    subprocess.run(["git", "add", copy.name], cwd=tmp_path, check=True, capture_output=True)
    assert revision().endswith("-dirty")


def test_without_a_command_the_help_is_shown_as_bad_usage(fulmar):
    code, out, err = fulmar()
    assert (code, out) == (2, "")
    assert err.lstrip().startswith("Usage: fulmar")


@pytest.mark.parametrize("words", [["--help"], ["run", "--help"], ["bundle", "show", "--help"]])
def test_help_is_no_mistake(fulmar, words):
    code, out, err = fulmar(*words)
    assert (code, err) == (0, "")
    assert "Usage: fulmar" in out


def test_a_place_that_cannot_be_written_is_a_failure_in_one_line(fulmar, tmp_path):
    pytest.importorskip("stable_baselines3")
    blocked = tmp_path / "file"
    blocked.write_text("")
    code, out, err = fulmar("train", "floating_platform", "go_to_pose", "--out", str(blocked))
    assert (code, out) == (1, "")
    assert err == f"fulmar: {blocked}: File exists.\n"


def test_the_list_shows_every_family_for_people(fulmar):
    code, out, err = fulmar("list")
    assert (code, err) == (0, "")
    for word in (
        "robots",
        "floating_platform",
        "go_to_position",
        "lqr",
        "mujoco_policy",
        "floating_platform_go_to_pose",
    ):
        assert word in out


def test_the_list_is_one_json_object(fulmar):
    code, out, err = fulmar("list", "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert list(found) == ["robots", "tasks", "controllers", "systems", "policies", "goals", "hardware"]
    assert found["controllers"] == ["policy", "lqr", "mpc", "lqr_drift", "classical", "excite"]
    tasks = json.loads(fulmar("list", "tasks", "--json")[1])["tasks"]
    assert {"go_to_pose", "go_to_position", "go_through_positions", "track_velocities"} <= set(tasks)


@pytest.mark.parametrize("controller", ["lqr", "policy"])
def test_an_evaluation_is_one_json_object_with_every_figure(fulmar, controller):
    words = ["evaluate", "floating_platform", "go_to_pose", "--controller", controller, "--through", "batch"]
    code, out, _ = fulmar(*words, "--episodes", "4", "--seed", "5", "--json")
    assert code == 0
    found = json.loads(out)
    assert (found["episodes"], found["seed"], found["control_hz"]) == (4, 5, 5.0)
    assert 0.0 <= found["success_rate"] <= 1.0
    for name in ("PT5_percent", "OT5_percent", "ALV_m_s", "AAV_rad_s", "AAS", "final_position_error_m"):
        assert set(found[name]) == {"mean", "median", "p95"}
    assert found["wall_s"] > 0.0
    assert found["steps_per_s"] > 0.0


def test_the_same_evaluation_twice_gives_the_same_figures(fulmar):
    first, second = (json.loads(fulmar(*EVALUATE, "--episodes", "2", "--json")[1]) for _ in range(2))
    timing = {"wall_s", "steps_per_s"}
    assert {k: v for k, v in first.items() if k not in timing} == {
        k: v for k, v in second.items() if k not in timing
    }


def test_an_evaluation_for_people_is_a_table_with_a_verdict(fulmar):
    code, out, _ = fulmar(*EVALUATE, "--episodes", "2")
    assert code == 0
    assert "success 1.000 of 2 episodes" in out
    assert "PT5_percent" in out


def test_a_passport_is_shown_as_it_is(fulmar):
    code, out, err = fulmar("bundle", "show", SHIPPED, "--json")
    assert (code, err) == (0, "")
    assert json.loads(out) == json.loads((Path(SHIPPED) / "passport.json").read_text())
    assert "control_hz" in fulmar("bundle", "show", SHIPPED)[1]


def test_the_shipped_bundle_is_accepted(fulmar):
    code, out, err = fulmar("bundle", "check", SHIPPED, "--json")
    assert (code, err) == (0, "")
    assert json.loads(out)["accepted"] is True


def test_the_installed_command_does_the_same_in_a_process_of_its_own():
    command = [sys.executable, "-m", "fulmar_bringup.cli"]
    done = subprocess.run(
        [*command, "list", "--json"], capture_output=True, text=True, timeout=30, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "floating_platform" in json.loads(done.stdout)["robots"]
    done = subprocess.run([*command, "run", "boat"], capture_output=True, text=True, timeout=30, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("words", [f"bundle show {SHIPPED} --json", "list"], ids=["a lot", "a little"])
def test_a_reader_that_has_had_enough_gets_no_traceback(words):
    piped = f"{sys.executable} -m fulmar_bringup.cli {words} | true; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", piped], capture_output=True, text=True, timeout=30, check=False)
    assert done.stderr == ""
    assert done.returncode in (0, 1)  # 0 where all was written before the reader went


def test_looking_around_loads_neither_ros_nor_torch_nor_a_simulator():
    program = (
        "import sys; sys.argv = ['fulmar', 'list', '--json']\n"
        "from fulmar_bringup import cli\n"
        "try: cli.main()\n"
        "except SystemExit: pass\n"
        "heavy = {'rclpy', 'torch', 'mujoco', 'onnxruntime', 'matplotlib'} & set(sys.modules)\n"
        "sys.exit(f'loaded {heavy}' if heavy else 0)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=30, check=False
    )
    assert done.returncode == 0, done.stderr


def test_limits_of_a_run_reach_its_plan(fulmar, monkeypatch, tmp_path):
    class PlannedError(Exception):
        """Nothing is started."""

    def conduct(request):
        guards.append(request.plan.guards)
        raise PlannedError

    guards = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(conductor, "conduct", conduct)
    with pytest.raises(PlannedError):
        fulmar(*RUN, "--area=-2,2,-1,1", "--max-run-time", "60")
    assert (guards[0].area, guards[0].max_run_time_s) == ((-2.0, 2.0, -1.0, 1.0), 60.0)


CATCHES_AN_INTERRUPT_OF_TEXT_THAT_RUNS_AS_CODE = """
import os, signal
from fulmar_bringup import cli

def app(**_):
    try:
        exec("os.kill(os.getpid(), signal.SIGINT)\\nwhile True: pass")
    except KeyboardInterrupt:
        return 1

cli.app = app
cli.main()
"""


def test_a_ctrl_c_that_was_answered_does_not_end_the_process_by_a_signal_afterwards(tmp_path):
    (tmp_path / "interrupted.py").write_text(CATCHES_AN_INTERRUPT_OF_TEXT_THAT_RUNS_AS_CODE)
    ended = subprocess.run([sys.executable, "-m", "interrupted"], cwd=tmp_path, timeout=30.0, check=False)
    assert ended.returncode == 1
