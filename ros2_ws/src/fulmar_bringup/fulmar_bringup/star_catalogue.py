"""Fetches the package that holds the star catalogue, and unpacks it beside this environment's own packages.

What cedar-solve asks of numpy and Pillow contradicts what the rest of this environment asks of them. Its data need
neither, so that it is unpacked where nothing imports it by accident.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

from fulmar_core.config.errors import ConfigError, FulmarError
from fulmar_core.robots.sensors.catalogue import FOLDER, catalogue_path

LOCK = Path(__file__).parent / "stars" / "requirements.lock"


def install_stars(report: Callable[[str], None]) -> bool:
    """Download and unpack the package, whose hash is in the lock.

    Args:
        report: Called with a line for each step.

    Returns:
        False if the catalogue is there already.

    Raises:
        ConfigError: This Python cannot make environments.
        FulmarError: The download failed; with what it printed.
    """
    if catalogue_path() is not None:
        return False
    if find_spec("ensurepip") is None:
        raise ConfigError(
            "this Python cannot make environments. On Debian and Ubuntu: apt install python3-venv"
        )
    with tempfile.TemporaryDirectory(prefix="fulmar_stars_") as folder:
        report("1/2 download the star catalogue (8 MB)")
        prefix = Path(folder) / "environment"
        _run([sys.executable, "-m", "venv", str(prefix)], "make an environment")
        pip = [
            str(prefix / "bin" / "python"),
            "-m",
            "pip",
            "--disable-pip-version-check",
            "--no-input",
            "--quiet",
        ]
        wanted = ["download", "--no-deps", "--require-hashes", "--requirement", str(LOCK), "--dest", folder]
        _run([*pip, *wanted], "download")
        report(f"2/2 unpack it into {FOLDER}")
        FOLDER.mkdir(parents=True, exist_ok=True)
        for wheel in Path(folder).glob("*.whl"):
            with zipfile.ZipFile(wheel) as archive:
                archive.extractall(FOLDER)
    return True


def _run(command: list[str], step: str) -> None:
    """Run a command in silence.

    Raises:
        FulmarError: It failed; with the end of what it printed.
    """
    clean = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(command, env=clean, capture_output=True, text=True, check=False)
    if done.returncode:
        said = "\n".join((done.stdout + done.stderr).strip().splitlines()[-10:])
        raise FulmarError(f"star catalogue: could not {step}:\n{said}")
