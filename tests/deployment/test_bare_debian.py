"""README's first command, and the wheel, on a bare Debian, by a user who is not root."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.debian_root import DebianRoot, make_root

# What README asks for: Python, git, a C compiler and make.
PACKAGES = ("python3", "python3-venv", "git", "gcc", "libc6-dev", "make")
UV = Path(sys.executable).with_name("uv")
INSTALL_S, DEMO_S = 900.0, 300.0

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]


@pytest.fixture(scope="module")
def debian(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DebianRoot]:
    """A bare Debian, removed at the end."""
    folder = tmp_path_factory.mktemp("debian") / "root"
    try:
        yield make_root(folder, PACKAGES)
    finally:
        assert str(folder) not in Path("/proc/mounts").read_text()
        shutil.rmtree(folder, ignore_errors=True)


def succeed(debian: DebianRoot, command: str, timeout_s: float) -> str:
    """Run a command to its end, and print how long it took."""
    begun = time.monotonic()
    done = debian.run(command, timeout_s=timeout_s)
    print(f"{time.monotonic() - begun:.0f} s: {command}")  # noqa: T201 - shown with -s, and after a failure
    assert done.returncode == 0, done.stdout[-4000:]
    return done.stdout


def check_demo(runs: Path) -> None:
    """The demo left a bag of each run, and their report."""
    (run,) = runs.iterdir()
    assert (run / "report.html").stat().st_size > 10_000
    for controller in ("policy", "lqr"):
        assert list((run / controller).glob("*.mcap"))


def test_the_first_command_of_the_readme_runs_in_a_clone(debian, repository):
    commands = [line.split("#")[0].strip() for line in (repository / "README.md").read_text().splitlines()]
    assert next(line for line in commands if line.startswith("make ")) == "make demo"
    debian.clone(repository)
    succeed(debian, "cd fulmar && make demo", INSTALL_S + DEMO_S)
    check_demo(debian.home / "fulmar" / "runs")


def test_the_wheel_installed_by_pip_runs_the_demo_in_an_empty_folder(debian, wheel):
    debian.take(wheel)
    succeed(debian, f"python3 -m venv env && env/bin/pip install './{wheel.name}[run]'", INSTALL_S)
    succeed(debian, "mkdir by_pip && cd by_pip && ../env/bin/fulmar demo", DEMO_S)
    check_demo(debian.home / "by_pip" / "runs")


def test_the_wheel_installed_by_uv_runs_the_demo_in_an_empty_folder(debian, wheel):
    debian.take(wheel)
    debian.take(UV)
    succeed(debian, f'./uv tool install "fulmar[run] @ $PWD/{wheel.name}"', INSTALL_S)
    succeed(debian, "mkdir by_uv && cd by_uv && fulmar demo", DEMO_S)
    check_demo(debian.home / "by_uv" / "runs")


def test_the_user_of_the_root_is_not_root_and_sees_nothing_of_this_machine(debian, repository):
    assert succeed(debian, "id -u; ls /home", 60.0).split() == ["4242", debian.home.name]
    assert debian.run(f"ls {repository}", timeout_s=60.0).returncode != 0


def test_a_root_without_debootstrap_is_refused_with_the_command_that_installs_it(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(RuntimeError, match="As root: apt install debootstrap"):
        make_root(tmp_path / "root")
    assert not (tmp_path / "root").exists()
