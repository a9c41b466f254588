"""Which code made a run: version and git revision."""

from __future__ import annotations

import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path


def fulmar_version() -> str:
    """Installed version, or `unknown`."""
    try:
        return version("fulmar")
    except PackageNotFoundError:
        return "unknown"


def git_revision() -> str:
    """Commit of the checkout this file lies in, with `-dirty` where it was changed; empty outside of one."""
    here = Path(__file__).resolve().parent
    try:
        done = subprocess.run(
            ["git", "describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"],
            cwd=here,
            capture_output=True,
            text=True,
            timeout=5.0,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""
