"""The command that adds an extra fits the way in which Fulmar was installed."""

from __future__ import annotations

import json
import sys
from importlib.metadata import PackageNotFoundError
from pathlib import Path
from types import SimpleNamespace

import pytest

from fulmar_cli.installation import installed_as
from fulmar_cli.installation.installed_as import install_command, repair_command

WHEEL = "file:///srv/fulmar-0.1.0-py3-none-any.whl"


@pytest.fixture
def installed(monkeypatch, tmp_path):
    """Function that makes this an installation from an address, in an environment below a folder; None: in none."""

    def install(origin: dict | None, prefix: Path = tmp_path) -> None:
        def found(name):
            if origin is None:
                raise PackageNotFoundError(name)
            return SimpleNamespace(
                version="0.1.0", read_text=lambda _: json.dumps(origin) if origin else None
            )

        monkeypatch.setattr(installed_as, "distribution", found)
        monkeypatch.setattr(sys, "prefix", str(prefix))
        monkeypatch.setattr(sys, "executable", str(prefix / "bin/python"))

    return install


@pytest.fixture
def checkout(tmp_path, installed, monkeypatch):
    """Folder of a checkout with the environment of `make setup`."""
    installed({"url": tmp_path.as_uri(), "dir_info": {"editable": True}}, tmp_path / ".venv")
    monkeypatch.chdir("/")
    return tmp_path


@pytest.mark.parametrize(
    ("extra", "target"),
    [("sim", "setup"), ("view", "setup"), ("train", "dev"), ("jsbsim", "with EXTRA=jsbsim")],
)
def test_in_a_checkout_make_adds_an_extra(extra, target, checkout, monkeypatch):
    assert install_command([extra], []) == f"make -C {checkout} {target}"
    monkeypatch.chdir(checkout)
    assert install_command([extra], []) == f"make {target}"


def test_in_a_checkout_one_target_adds_all_extras(checkout):
    assert install_command(["ros", "bags", "sim", "policy"], []).endswith(" setup")
    assert install_command(["sim", "train"], []).endswith(" dev")
    assert install_command(["sim", "events", "gym"], []).endswith(" with EXTRA='events gym'")


def test_in_another_environment_of_a_checkout_pip_adds_an_extra(tmp_path, installed):
    folder = tmp_path / "my checkout"
    installed({"url": folder.as_uri(), "dir_info": {"editable": True}})
    assert install_command(["sim"], []) == f"{tmp_path}/bin/python -m pip install -e '{folder}[sim]'"


def test_in_a_virtual_environment_pip_takes_the_same_wheel(tmp_path, installed):
    installed({"url": WHEEL})
    command = f"{tmp_path}/bin/python -m pip install 'fulmar[{{}}] @ {WHEEL}'"
    assert install_command(["sim"], []) == command.format("sim")
    assert install_command(["sim", "train"], []) == command.format("sim,train")
    assert install_command(["ros", "bags", "sim", "policy", "train"], []) == command.format("run,train")


def test_in_an_environment_without_pip_uv_takes_the_same_wheel(tmp_path, installed, monkeypatch):
    installed({"url": WHEEL})
    monkeypatch.setattr(installed_as, "find_spec", lambda _: None)
    assert install_command(["sim"], []) == f"uv pip install --python {tmp_path} 'fulmar[sim] @ {WHEEL}'"


def test_without_an_address_the_version_is_named(tmp_path, installed):
    installed({})
    assert install_command(["sim"], []).endswith(" -m pip install 'fulmar[sim]==0.1.0'")


def test_a_tool_of_uv_keeps_the_extras_that_it_has(tmp_path, installed):
    installed({"url": WHEEL})
    (tmp_path / "uv-receipt.toml").write_text(
        '[tool]\nrequirements = [{ name = "fulmar", extras = ["sim", "ros"], path = "/srv/fulmar.whl" }]\n'
    )
    assert install_command(["policy", "sim"], []) == f"uv tool install 'fulmar[sim,ros,policy] @ {WHEEL}'"


def test_in_a_colcon_workspace_ros_is_sourced_and_pip_brings_the_modules(installed):
    installed(None)
    sourced = "source /opt/ros/jazzy/setup.bash"
    pip = "pip install --break-system-packages"
    assert install_command(["ros"], ["rclpy", "nav_msgs"]) == sourced
    assert install_command(["sim"], ["mujoco"]) == f"{pip} mujoco"
    assert install_command(["hardware"], ["serial"]) == f"{pip} pyserial"
    assert install_command(["ros", "bags"], ["rclpy", "mcap", "mcap_ros2"]) == (
        f"{sourced} && {pip} mcap mcap-ros2-support"
    )


def test_damaged_files_are_restored_by_git_in_a_checkout(checkout):
    assert repair_command("policy_server") == f"git -C {checkout} restore policy_server"


def test_damaged_files_of_a_wheel_are_installed_again(tmp_path, installed):
    installed({"url": WHEEL})
    assert repair_command("configs") == (
        f"{tmp_path}/bin/python -m pip install --force-reinstall --no-deps 'fulmar @ {WHEEL}'"
    )
    (tmp_path / "uv-receipt.toml").write_text(
        '[tool]\nrequirements = [{ name = "fulmar", extras = ["run"] }]\n'
    )
    assert repair_command("configs") == f"uv tool install --reinstall-package fulmar 'fulmar[run] @ {WHEEL}'"


def test_damaged_files_of_a_workspace_are_built_again(installed):
    installed(None)
    assert repair_command("configs") == "colcon build   # in the workspace"
