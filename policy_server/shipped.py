"""The policies that come with Fulmar."""

from __future__ import annotations

from pathlib import Path

from fulmar_core.policy_bundle import PASSPORT


def policies_directory() -> Path:
    """Folder of the shipped bundles."""
    return Path(__file__).resolve().parent / "policies"


def shipped_policies() -> list[Path]:
    """Every shipped bundle, sorted by name."""
    return sorted(path.parent for path in policies_directory().glob(f"*/{PASSPORT}"))


def shipped_policy(robot: str, task: str) -> Path | None:
    """The shipped bundle for a robot and a task, or None."""
    folder = policies_directory() / f"{robot}_{task}"
    return folder if (folder / PASSPORT).is_file() else None
