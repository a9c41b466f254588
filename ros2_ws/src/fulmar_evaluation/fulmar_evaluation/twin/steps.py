"""Steps of a long work, each a file: one whose inputs did not change is not done again."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fulmar_core.config.atomic_write import write_whole
from fulmar_core.config.errors import ConfigError

Say = Callable[[str], None]


@dataclass(frozen=True)
class Steps:
    """The folder of a work.

    A step `NAME` is `NAME.json`: what it was made from, its result, and the hash of every file that it wrote. It is
    done again where an input is another one, or where a file that it wrote is gone or was changed.
    """

    folder: Path
    names: tuple[str, ...]  # of all steps, in their order
    say: Say  # receives a line for each step

    def begin(self) -> None:
        """Make the folder.

        Raises:
            ConfigError: It holds something else.
        """
        if self.folder.exists() and not self.folder.is_dir():
            raise ConfigError(f"--out {self.folder}: is a file. Give a folder.")
        own = self._file(self.names[0])
        if self.folder.is_dir() and any(self.folder.iterdir()) and not own.exists():
            raise ConfigError(
                f"--out {self.folder}: is not empty and holds no {own.name}; nothing in it is overwritten. "
                "Give a new folder, or that of a twin to go on with."
            )
        self.folder.mkdir(parents=True, exist_ok=True)

    def take(
        self,
        name: str,
        made_from: Mapping[str, Any],
        make: Callable[[], dict[str, Any]],
        writes: tuple[Path, ...] = (),
    ) -> dict[str, Any]:
        """The result of a step, made anew if need be.

        Args:
            name: One of `names`.
            made_from: Everything that its result depends on, ready for JSON.
            make: Does it; its result is ready for JSON.
            writes: Files and folders that it writes.
        """
        inputs = json.loads(json.dumps(made_from))
        place = f"{self.names.index(name) + 1} of {len(self.names)}, {name}"
        done = self._read(name)
        if done is not None and done["made_from"] == inputs and done["files"] == hashes(writes):
            self.say(f"{place}: nothing has changed")
            return dict(done["result"])
        self.say(f"{place} ...")
        result = make()
        content = {"made_from": inputs, "result": result, "files": hashes(writes)}
        text = json.dumps(content, indent=2, allow_nan=False) + "\n"
        write_whole({self._file(name): text.encode()})
        return result

    def _file(self, name: str) -> Path:
        return self.folder / f"{name}.json"

    def _read(self, name: str) -> dict[str, Any] | None:
        """A step that was done; None if there is none, or its file is damaged."""
        try:
            found = json.loads(self._file(name).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        keys = ("made_from", "result", "files")
        return found if isinstance(found, dict) and all(key in found for key in keys) else None


def hashes(places: tuple[Path, ...]) -> dict[str, str]:
    """SHA-256 of files and of every file in folders, by path; what does not exist is left out.

    Raises:
        OSError: A file cannot be read.
    """
    files = [
        file
        for place in places
        for file in (sorted(place.rglob("*")) if place.is_dir() else [place])
        if file.is_file()
    ]
    found = {}
    for file in files:
        with file.open("rb") as content:
            found[str(file)] = hashlib.file_digest(content, "sha256").hexdigest()
    return found


def hash_of(text: str) -> str:
    """SHA-256 of a text."""
    return hashlib.sha256(text.encode()).hexdigest()
