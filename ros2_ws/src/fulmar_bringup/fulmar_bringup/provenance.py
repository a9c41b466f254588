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
    """Commit of the checkout this file belongs to, with `-dirty` where it was changed; empty outside of one.

    A repository that merely has an installed Fulmar below it, in a virtual environment, does not count.
    """
    here = Path(__file__).resolve()
    if _git(here.parent, "ls-files", "--error-unmatch", here.name) is None:
        return ""
    return _git(here.parent, "describe", "--always", "--dirty", "--abbrev=12", "--exclude=*") or ""


def _git(folder: Path, *words: str) -> str | None:
    """What git says in a folder; None if it fails or is not there."""
    try:
        done = subprocess.run(
            ["git", *words], cwd=folder, capture_output=True, text=True, timeout=5.0, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() if done.returncode == 0 else None
