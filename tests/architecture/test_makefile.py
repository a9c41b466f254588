"""The Makefile: help, one installation per lock, rejection of an old interpreter."""

from __future__ import annotations

import os
import re
import shutil
import subprocess

import pytest

TARGETS = {
    "help",
    "setup",
    "with",
    "tf",
    "dev",
    "peers",
    "dreamer",
    "demo",
    "freeze",
    "freeze-check",
    "rooms",
    "train-demo",
    "profile-step",
    "test",
    "test-all",
    "mutants",
    "check",
    "format",
    "images",
    "policies",
    "envelopes",
    "replay-bags",
    "ros-build",
    "lock",
    "clean",
    "console-vendor",
    "setup-browser",
    "site",
    "site-serve",
}

MESSAGES_LOCK = "ros2_ws/src/fulmar_bringup/fulmar_bringup/tf2_msgs/requirements.lock"
# Replaces Python: logs its arguments, and makes a .venv with a copy of itself.
INTERPRETER = """#!/usr/bin/env bash
echo "$*" >> calls.log
case "$*" in
    *version_info*) exit {too_old} ;;
    --version) echo "Python {version}" ;;
    "-m venv .venv"*) mkdir -p "$3/bin" && cp "$0" "$3/bin/python" && cp "$0" "$3/bin/fulmar" ;;
    *"-m pip"*"-r "*) echo "Collecting numpy==2.0.0" ;;
esac
"""


@pytest.fixture
def make(repository, tmp_path):
    """Function that runs make in a folder with the set-up files only, without a real Python."""
    locks = (
        "requirements.lock",
        "requirements-dev.lock",
        "requirements-peers.lock",
        "requirements-dreamer.lock",
    )
    for name in ("Makefile", "pyproject.toml", *locks):
        shutil.copy(repository / name, tmp_path)
    (tmp_path / MESSAGES_LOCK).parent.mkdir(parents=True)
    shutil.copy(repository / MESSAGES_LOCK, tmp_path / MESSAGES_LOCK)
    environment = {key: value for key, value in os.environ.items() if not key.startswith("MAKE")}
    environment.pop("PYTHON", None)

    def run(*arguments, too_old=False):
        interpreter = tmp_path / "interpreter"
        version = "3.9.2" if too_old else "3.12.1"
        interpreter.write_text(INTERPRETER.format(too_old=int(too_old), version=version))
        interpreter.chmod(0o755)
        return subprocess.run(
            ["make", "PYTHON=./interpreter", *arguments],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )

    return run


def installs(tmp_path):
    """Lock files that pip was called to install."""
    return re.findall(r"-r (\S+)", (tmp_path / "calls.log").read_text())


def test_help_lists_every_target(repository, make):
    written = set(re.findall(r"^([a-z][a-z-]*):", (repository / "Makefile").read_text(), re.MULTILINE))
    assert written == TARGETS
    shown = re.findall(r"^  make ([a-z-]+) +\S", make("help").stdout, re.MULTILINE)
    assert sorted(shown) == sorted(TARGETS)


def test_make_alone_shows_the_help(make):
    assert make().stdout == make("help").stdout


def test_setup_installs_the_run_time_lock_once(make, tmp_path):
    first, second = make("setup"), make("setup")
    assert (first.returncode, second.returncode) == (0, 0), first.stderr + second.stderr
    assert installs(tmp_path) == ["requirements.lock"]
    assert "--require-hashes" in (tmp_path / "calls.log").read_text()


def test_setup_installs_again_after_the_lock_changed(make, tmp_path):
    make("setup")
    with (tmp_path / "requirements.lock").open("a") as lock:
        lock.write("# another version\n")
    assert make("setup").returncode == 0
    assert installs(tmp_path) == ["requirements.lock", "requirements.lock"]


def test_a_development_setup_includes_the_run_time_setup(make, tmp_path):
    assert make("dev").returncode == 0
    assert make("setup").returncode == 0
    assert installs(tmp_path) == ["requirements-dev.lock"]


@pytest.mark.parametrize("target", ["peers", "dreamer"])
def test_what_contradicts_our_lock_gets_an_environment_and_a_pip_of_its_own_once(make, tmp_path, target):
    assert make(target).returncode == make(target).returncode == 0
    asked = (tmp_path / "calls.log").read_text()
    assert asked.count(f"-m venv .venv-{target}") == 1
    assert "--require-hashes" in asked
    first, second = installs(tmp_path)
    assert first.startswith("/dev/fd/"), "the pip of the lock comes first"
    assert second == f"requirements-{target}.lock"
    assert not (tmp_path / ".venv").exists()
    with (tmp_path / second).open("a") as lock:
        lock.write("# another version\n")
    assert make(target).returncode == 0
    assert installs(tmp_path)[2:] == [first, second]


@pytest.mark.parametrize("lock", ["requirements-peers.lock", "requirements-dreamer.lock"])
def test_every_test_needs_the_peers_and_dreamer_and_the_quick_ones_do_not(make, lock):
    assert lock in make("--dry-run", "test-all").stdout
    assert lock not in make("--dry-run", "test").stdout


def test_a_failed_installation_is_repeated(make, tmp_path):
    make("setup")
    (tmp_path / "requirements.lock").write_text("# changed\n")
    (tmp_path / ".venv/bin/python").write_text("#!/usr/bin/env bash\nexit 1\n")
    assert make("setup").returncode != 0
    assert make("-q", "setup").returncode != 0


@pytest.mark.parametrize(
    ("target", "size"), [("setup", 884), ("dev", 8217), ("peers", 8838), ("dreamer", 6209)]
)
@pytest.mark.parametrize("free", [100, 90_000])
def test_size_and_free_disk_are_printed_before_an_installation(make, tmp_path, target, size, free):
    disk = tmp_path / "bin" / "df"
    disk.parent.mkdir()
    disk.write_text(f"#!/usr/bin/env bash\necho Avail; echo ' {free}M'\n")
    disk.chmod(0o755)
    result = make(target, f"PATH={disk.parent}:{os.environ['PATH']}")
    assert result.returncode == 0
    folder = f".venv-{target}" if target in ("peers", "dreamer") else ".venv"
    line = f"{folder} takes {size} MiB; {free} MiB are free on this disk."
    assert result.stdout.index(line) < result.stdout.index("Ready")
    assert ("make room" in result.stderr) == (free < size)


def test_the_readme_and_the_first_hour_state_the_sizes_of_the_makefile(repository):
    makefile = (repository / "Makefile").read_text()
    for page in ("README.md", "docs/first_hour.md"):
        text = (repository / page).read_text()
        for name in ("RUN_SIZE", "DEV_SIZE"):
            size = int(re.search(rf"^{name} := (\d+)$", makefile, re.MULTILINE)[1])
            assert f"{size / 1024:.1f} GiB" in text, (page, name)


def test_the_demo_needs_no_learning_library(make):
    plan = make("--dry-run", "demo").stdout
    assert "requirements.lock" in plan
    assert "requirements-dev.lock" not in plan
    assert ".venv/bin/fulmar demo" in plan


def test_an_old_interpreter_gets_one_clear_line(make, tmp_path):
    result = make("setup", too_old=True)
    assert result.returncode != 0
    assert "is Python 3.9.2, but Fulmar needs Python 3.11, 3.12, 3.13 or 3.14." in result.stderr
    assert "make setup PYTHON=python3.12" in result.stderr
    assert not (tmp_path / ".venv").exists()


def test_the_makefile_has_no_absolute_path(repository):
    text = (repository / "Makefile").read_text()
    assert re.search(r"(?<![\w.)}/])/(home|usr|opt|root|tmp|work|var)\b", text) is None


def test_an_extra_is_added_to_the_run_time_setup_alone(make, tmp_path):
    assert make("with", "EXTRA=jsbsim gym").returncode == 0
    assert installs(tmp_path) == ["requirements.lock"]
    assert "-m fulmar_cli.installation.add_extra jsbsim gym" in (tmp_path / "calls.log").read_text()
