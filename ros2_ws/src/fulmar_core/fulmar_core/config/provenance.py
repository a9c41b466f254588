"""Which code made a run: version, git revision, what was changed since, and the packages around it."""

from __future__ import annotations

import functools
import json
import platform
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

MADE_BY, PATCH = "provenance.json", "uncommitted.patch"  # attachments of a bag
LARGEST_PATCH = 1_000_000  # bytes


def fulmar_version() -> str:
    """Installed version, or `unknown`."""
    try:
        return version("fulmar")
    except PackageNotFoundError:
        return "unknown"


@functools.cache
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
            ["git", *words],
            cwd=folder,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=5.0,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def made_by() -> dict[str, Any]:
    """Code, interpreter, platform and the version of every installed package, ready for JSON."""
    return {
        "fulmar_version": fulmar_version(),
        "git_revision": git_revision(),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "packages": _packages(),
    }


def _packages() -> dict[str, str]:
    """Version by name, of everything on the import path; from names of folders, since reading files takes seconds."""
    found: dict[str, str] = {}
    for folder in reversed(sys.path):  # the first on the path is the one that is imported
        for info in ("*.dist-info", "*.egg-info"):
            for path in Path(folder or ".").glob(info):
                name, _, rest = path.stem.partition("-")
                found[name] = rest.partition("-py")[0]
    return dict(sorted(found.items(), key=lambda item: item[0].lower()))


def uncommitted_changes() -> bytes:
    """What the checkout has that its commit has not, as a patch, up to 1 MB; empty outside of one."""
    if not git_revision():
        return b""
    here = Path(__file__).resolve().parent
    root = _git(here, "rev-parse", "--show-toplevel")
    patch = _git(Path(root), "diff", "HEAD") if root else None
    return (patch or "").encode()[:LARGEST_PATCH]


def attachments() -> dict[str, bytes]:
    """Files with the code and the packages, for a reader of a bag; the patch only where there is one."""
    patch = uncommitted_changes()
    return {
        MADE_BY: json.dumps(made_by(), indent=1).encode(),
        **({PATCH: patch} if patch else {}),
    }
