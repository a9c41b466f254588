"""Lock step with a node between plant and controller: the same bytes again, an own node, and who is silent."""

from __future__ import annotations

import re
import signal
import time
from pathlib import Path

import psutil
import pytest

from fulmar_core.config.paths import OWN_FOLDERS
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of, start_fulmar
from tests.ros.wires import wires_of

pytestmark = pytest.mark.real_time  # five processes at full speed leave other tests no processor
PAGE = Path(__file__).resolve().parents[2] / "docs" / "estimation.md"
ESTIMATED = ("floating_platform", "--estimator", "mocap_imu", "--lockstep")


@pytest.mark.slow
def test_two_runs_of_one_seed_have_the_same_bytes_and_a_rerun_the_same_actions(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    asked = ("run", *ESTIMATED, "--mocap-hz", "75", "--seed", "3", "--duration", "20", "--json")
    for bag in ("one", "two"):
        done = fulmar(*asked, "--record", bag, env=ros_domain.env, cwd=tmp_path)
        summary = json_of(done.stdout)
        assert summary["failure"] is None, done.stderr
    one, two = wires_of(tmp_path / "one"), wires_of(tmp_path / "two")
    assert one.keys() == two.keys()
    assert {topic for topic in one if one[topic] != two[topic]} == set()
    counts = {topic.removeprefix("/floating_platform/"): len(data) for topic, data in one.items()}
    assert counts["lockstep/period"] == 100
    assert counts["imu/data"] == 1000  # at every physics step but the last, with the first sample
    assert counts["mocap/pose"] == 1499  # captures within 19.98 s
    assert counts["odom"] == counts["controller/action"] == 99  # one pose alone gives no velocity
    assert summary["success"], summary
    done = fulmar("bag", "rerun", "one", "--json", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stdout
    assert json_of(done.stdout)["same"] is True


def own_system(folder: Path, **changes: str) -> None:
    """The system and the node of the page."""
    text = PAGE.read_text(encoding="utf-8")
    (system,) = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
    (code,) = (
        found for found in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "Differences" in found
    )
    for old, new in changes.items():
        assert old in code
        code = code.replace(old, new)
    (folder / "systems").mkdir()
    (folder / "systems" / "mujoco_lqr.yaml").write_text(system)
    (folder / "differences.py").write_text(code)


@pytest.mark.slow
def test_the_node_of_the_page_runs_in_lock_step_and_gives_the_same_bytes_again(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    own_system(tmp_path)
    env = {**ros_domain.env, OWN_FOLDERS: str(tmp_path)}
    asked = (
        "run",
        "floating_platform",
        "--controller",
        "lqr",
        "--lockstep",
        "--seed",
        "4",
        "--duration",
        "20",
    )
    for bag in ("one", "two"):
        done = fulmar(*asked, "--record", bag, "--json", env=env, cwd=tmp_path)
        summary = json_of(done.stdout)
        assert summary["failure"] is None, done.stderr
        assert summary["steps"] == 199
    one, two = wires_of(tmp_path / "one"), wires_of(tmp_path / "two")
    for topic in (
        "actuators/command",
        "actuators/state",
        "mocap/pose",
        "controller/action",
        "ground_truth/odom",
    ):
        assert one[f"/floating_platform/{topic}"] == two[f"/floating_platform/{topic}"], topic
    assert summary["final_position_error_m"] < 0.1


@pytest.mark.slow
def test_an_own_node_that_answers_nothing_ends_the_run_by_its_name(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    own_system(tmp_path, **{"self.sent.append((self.answers, answer))": "pass"})
    env = {**ros_domain.env, OWN_FOLDERS: str(tmp_path)}
    asked = ("run", "floating_platform", "--controller", "lqr", "--lockstep", "--duration", "20")
    failure = json_of(fulmar(*asked, "--json", env=env, cwd=tmp_path).stdout)["failure"]
    assert re.search(
        r"no answer to the readings up to t = 1.00 s for 5.\d s .*: differences is silent", failure
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", ["estimator", "controller"])
def test_a_link_that_hangs_ends_the_run_by_its_name(name: str, ros_domain: RosDomain, tmp_path: Path) -> None:
    run = start_fulmar("run", *ESTIMATED, "--duration", "9999", "--json", env=ros_domain.env, cwd=tmp_path)
    hung: list[psutil.Process] = []
    try:
        began = time.monotonic()
        while not hung and time.monotonic() - began < 60.0:
            time.sleep(0.5)
            files = list(tmp_path.glob("runs/*/*.mcap"))
            if files and files[0].stat().st_size > 300_000:  # it runs
                hung = [
                    one
                    for one in psutil.Process(run.pid).children(recursive=True)
                    if f"{name}_node" in " ".join(one.cmdline())
                ]
                for one in hung:
                    one.send_signal(signal.SIGSTOP)
        assert len(hung) == 1
        output, errors = run.communicate(timeout=60.0)
    finally:
        for one in hung:
            if one.is_running():
                one.kill()
        if run.poll() is None:
            run.kill()
    assert f"{name} was stopped (SIGSTOP) for 3 s" in json_of(output)["failure"], errors
