"""The files of a bag: which there are, which there should be, and what `metadata.yaml` tells beside them."""

from __future__ import annotations

from pathlib import Path

from fulmar_bags.mcap_file import BEGUN
from fulmar_bags.metadata import read_custom, read_information
from fulmar_bags.records import place_in_bag, plain_name
from fulmar_core.errors import BagError

ENDINGS = {".mcap": "mcap", ".db3": "sqlite3"}
GIVE = "Give a bag folder, or the .mcap or .db3 file in it."


def storage_of(file: Path) -> str | None:
    """`mcap` or `sqlite3`, also where the file is packed as a whole; None if neither."""
    return ENDINGS.get(plain_name(file).suffix)


def files_of(path: Path) -> tuple[Path, ...]:
    """Files of a bag in the order of their numbers; a bag may be split into several.

    Raises:
        BagError: There is none.
    """
    if path.is_file():
        if storage_of(path) is None:
            raise BagError(f"{path}: this is no bag. {GIVE}")
        return (path,)
    if not path.is_dir():
        raise BagError(f"{path}: there is no such bag. {GIVE}")
    there = [
        file for file in path.iterdir() if file.is_file() and (file.suffix != BEGUN or file.stat().st_size)
    ]
    for storage in ENDINGS.values():
        files = [file for file in there if storage_of(file) == storage]
        if files:
            return tuple(sorted(files, key=place_in_bag))
    found = ", ".join(sorted(each.name for each in path.iterdir())[:4])
    raise BagError(
        f"{path}: has no .mcap and no .db3 file{f', only {found}' if found else ': it is empty'}. {GIVE}"
    )


def missing_files(path: Path) -> tuple[str, ...]:
    """Names that `metadata.yaml` lists and that are not in the folder; none where one file alone was given."""
    listed = read_information(path).get("relative_file_paths") if path.is_dir() else None
    there = {plain_name(file).name for file in path.iterdir()} if path.is_dir() else set()
    names = (
        [name for name in listed if isinstance(name, str) and Path(name).name]
        if isinstance(listed, list)
        else []
    )
    return tuple(name for name in names if plain_name(Path(name)).name not in there)


def told_beside(path: Path, entry: str) -> str:
    """A text from `custom_data` in the bag's `metadata.yaml`; empty where it is not there."""
    return read_custom(path if path.is_dir() else path.parent).get(entry, "")
