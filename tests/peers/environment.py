"""Environments of outside programs that tests compare with, made by `make peers` and `make dreamer`."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

PEERS, DREAMER = ".venv-peers", ".venv-dreamer"


def run_peer(repository: Path, script: Path, *arguments: object, home: Path, environment: str = PEERS) -> str:
    """Run a script with the Python of the peers; a test fails where they are missing or the script does.

    Args:
        repository: Root of the checkout.
        script: What to run; it cannot import anything of ours.
        arguments: Its arguments.
        home: Folder for whatever a peer keeps between two runs.
        environment: Folder of its Python; `make` has a target of that name.

    Returns:
        What the script wrote to standard output.
    """
    python, target = repository / environment / "bin" / "python", environment.removeprefix(".venv-")
    if not python.is_file():
        pytest.fail(
            f"{environment}/bin/python is missing, and nothing can be compared. Run: make {target}",
            pytrace=False,
        )
    variables = {**os.environ, "HOME": str(home), "HF_HOME": str(home), "HF_HUB_OFFLINE": "1"}
    variables.pop("PYTHONPATH", None)
    done = subprocess.run(
        [python, script, *map(str, arguments)],
        env=variables,
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    if done.returncode:
        pytest.fail(
            f"{script.name} failed with {environment}. Is it up to date? Run: make {target}\n{done.stderr}",
            False,
        )
    return done.stdout
