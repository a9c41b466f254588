"""The environment of the outside programs that tests compare with, made by `make peers`."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

PEERS = ".venv-peers"


def run_peer(repository: Path, script: Path, *arguments: object, home: Path) -> str:
    """Run a script with the Python of the peers; a test fails where they are missing or the script does.

    Args:
        repository: Root of the checkout.
        script: What to run; it cannot import anything of ours.
        arguments: Its arguments.
        home: Folder for whatever a peer keeps between two runs.

    Returns:
        What the script wrote to standard output.
    """
    python = repository / PEERS / "bin" / "python"
    if not python.is_file():
        pytest.fail(
            f"{PEERS}/bin/python is missing, and nothing can be compared. Run: make peers", pytrace=False
        )
    environment = {**os.environ, "HOME": str(home), "HF_HOME": str(home), "HF_HUB_OFFLINE": "1"}
    environment.pop("PYTHONPATH", None)
    done = subprocess.run(
        [python, script, *map(str, arguments)],
        env=environment,
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    if done.returncode:
        pytest.fail(
            f"{script.name} failed with {PEERS}. Is it up to date? Run: make peers\n{done.stderr}", False
        )
    return done.stdout
