"""Bags as a `Source`: read in a thread of their own while the page loads, sent once, and played by the page."""

from __future__ import annotations

import json
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fulmar_console.bags.paths import bags_of
from fulmar_console.source import Answer, Image, RobotSample
from fulmar_core.config.errors import BagError, FulmarError

if TYPE_CHECKING:
    from fulmar_console.bags.recording import Recording

PREFIX = "/bags/"


class BagSource:
    """One bag, or two to be compared.

    Paths that the page asks for: `/bags/0.json` (what is there, or how far reading has come), `/bags/0.bin`, and
    `/bags/0/image/INDEX/KIND/NUMBER`.
    """

    mode = "bags"

    def __init__(self, paths: Sequence[Path]) -> None:
        """Look at paths; nothing is read yet.

        Raises:
            BagError: There is no bag at one of them.
        """
        self._paths = [bags_of(path) for path in paths]
        self._names = _names(paths)
        self._read: dict[int, Recording] = {}
        self._texts: dict[int, bytes] = {}
        self._progress: list[tuple[float, str]] = [(0.0, "waiting") for _ in paths]
        self._problem: FulmarError | None = None
        self._over = False
        self._thread = threading.Thread(target=self._run, name="bags", daemon=True)

    def start(self) -> None:
        """Begin to read."""
        self._thread.start()

    def _run(self) -> None:
        from fulmar_console.bags.recording import as_json, read_recording

        for number, paths in enumerate(self._paths):

            def tell(share: float, words: str, number: int = number) -> None:
                self._progress[number] = share, words

            try:
                recording = read_recording(paths, self._names[number], tell)
            except FulmarError as error:
                self._problem = error
                return
            except MemoryError:
                self._problem = BagError(
                    f"{self._names[number]}: the memory of this computer does not suffice."
                )
                return
            self._texts[number] = as_json({**recording.document, "ready": True})
            self._read[number] = recording

    def hello(self) -> dict[str, Any]:
        """The names of the bags, in the order of their numbers."""
        return {"bags": [{"name": name, "path": f"{PREFIX}{i}"} for i, name in enumerate(self._names)]}

    def version(self) -> int:
        """How many bags are read.

        Raises:
            FulmarError: One of them cannot be read, or holds no robot: the console ends with this line.
        """
        if self._problem is not None:
            raise self._problem
        return len(self._read)

    def robots(self) -> list[dict[str, Any]]:
        """None: the page takes robots from the documents of the bags."""
        return []

    def frame(self) -> tuple[list[RobotSample], float]:
        """Nothing moves by itself; the empty frame is the sign of life."""
        return [], 0.0

    def health(self) -> Mapping[str, Mapping[str, Any]]:
        """As `robots`."""
        return {}

    def events(self) -> list[dict[str, Any]]:
        """As `robots`."""
        return []

    def images(self) -> list[Image]:
        """None: the page asks for each by its number."""
        return []

    def do(self, command: Mapping[str, Any], answer: Answer, client: str) -> None:
        """Refuse: nothing of a bag can be commanded."""
        answer(False, f"'{command.get('do')}' is for robots that run; this page plays bags")

    def forget(self, client: str) -> None:
        """Nothing is held down."""

    def file(self, path: str) -> bytes | None:
        """A document, the columns of a bag, or an image."""
        number, rest = _split(path)
        if number is None or not 0 <= number < len(self._paths):
            return None
        recording = self._read.get(number)
        if rest == ".json":
            return self._texts.get(number) or self._waiting(number)
        if recording is None:
            return None
        return recording.columns if rest == ".bin" else _image(recording, rest)

    def _waiting(self, number: int) -> bytes:
        share, words = self._progress[number]
        said = {"ready": False, "name": self._names[number], "share": round(share, 3), "words": words}
        return json.dumps(said).encode()

    def close(self) -> None:
        """End; the thread ends with the process."""


def _split(path: str) -> tuple[int | None, str]:
    """Number of a bag in a path such as `/bags/0.json`, and what follows it."""
    if not path.startswith(PREFIX):
        return None, ""
    rest = path.removeprefix(PREFIX)
    digits = rest[: len(rest) - len(rest.lstrip("0123456789"))]
    return (int(digits), rest[len(digits) :]) if digits and len(digits) < 3 else (None, "")


def _image(recording: Recording, rest: str) -> bytes | None:
    """The image at `/image/INDEX/KIND/NUMBER`."""
    parts = rest.split("/")
    if (
        len(parts) != 5
        or parts[:2] != ["", "image"]
        or not all(p.isdecimal() and len(p) < 9 for p in parts[2:])
    ):
        return None
    index, kind, number = map(int, parts[2:])
    found = [camera for camera in recording.cameras.get(index, ()) if camera.kind == kind]
    return found[0].readable(number) if found else None


def _names(paths: Sequence[Path]) -> list[str]:
    """A short name of each path, such as that two differ."""
    names = [path.resolve().name for path in paths]
    if len(set(names)) < len(names):
        names = [f"{path.resolve().parent.name}/{name}" for path, name in zip(paths, names, strict=True)]
    if len(set(names)) < len(names):
        names = [f"{name} ({number + 1})" for number, name in enumerate(names)]
    return names
