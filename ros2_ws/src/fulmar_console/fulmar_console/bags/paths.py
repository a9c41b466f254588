"""The bags that a person names: a bag, or a folder with the bags of one system.

Imports nothing heavy: this runs before the page is served.
"""

from __future__ import annotations

from pathlib import Path

from fulmar_core.config.errors import BagError, did_you_mean

ENDINGS = (".mcap", ".db3", ".bag", ".mcap.begun", ".mcap.zstd", ".db3.zstd", ".bag.zstd")
GIVE = "Give a bag folder, the .mcap or .db3 file in it, or a .bag of ROS 1."
DEEPEST = 2  # folders below the one that is named
MOST = 32  # bags of one system


def bags_of(path: Path) -> tuple[Path, ...]:
    """The bag of a path; the bags in a folder of several, as robots of one system or goals of one run have them.

    Raises:
        BagError: There is no such path, or no bag at it.
    """
    if not path.exists():
        parent = path.parent
        near = sorted(each.name for each in parent.iterdir()) if parent.is_dir() else []
        hint = did_you_mean(path.name, near) if near else ""
        raise BagError(f"{path}: there is no such bag.{hint if 'mean' in hint else ''} {GIVE}")
    if path.is_file():
        if not path.name.endswith(ENDINGS):
            raise BagError(f"{path}: this is no bag. {GIVE}")
        return (path,)
    folders = [path]
    for _ in range(DEEPEST + 1):
        found = [folder for folder in folders if _holds_bag(folder)]
        if found:
            return tuple(found[:MOST])
        folders = [each for folder in folders for each in sorted(folder.iterdir()) if each.is_dir()]
    there = ", ".join(sorted(each.name for each in path.iterdir())[:4])
    raise BagError(f"{path}: holds no bag{f', only {there}' if there else ': it is empty'}. {GIVE}")


def _holds_bag(folder: Path) -> bool:
    return any(file.name.endswith(ENDINGS) for file in folder.iterdir() if file.is_file())
