"""Files of the page: a list, not a folder, so that no path leads anywhere else."""

from __future__ import annotations

import gzip
import hashlib
from functools import cache, cached_property
from importlib.metadata import version
from pathlib import Path

FOLDER = Path(__file__).parent / "page"
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
    ".txt": "text/plain; charset=utf-8",
}
VERSION = b"VERSION_OF_THE_PAGE"  # stands in index.html for what `Pages.version` is


class Pages:
    """What is served, read once."""

    def __init__(self, folder: Path = FOLDER) -> None:
        """Read every file of the page in a folder."""
        found = [file for file in sorted(folder.iterdir()) if file.suffix in TYPES]
        self._files = {f"/{file.name}": file.read_bytes() for file in found}

    @cached_property
    def version(self) -> str:
        """Of the package and of every file: a page of another version is asked to load itself again."""
        digest = hashlib.sha256()
        for name, content in self._files.items():
            digest.update(f"{name} {len(content)} ".encode() + content)
        return f"{version('fulmar')}+{digest.hexdigest()[:12]}"

    def file(self, path: str) -> tuple[bytes, str] | None:
        """Content and type at a path; None where there is nothing."""
        name = "/index.html" if path == "/" else path
        content = self._files.get(name)
        if content is None:
            return None
        if name == "/index.html":
            content = content.replace(VERSION, self.version.encode())
        return content, TYPES[Path(name).suffix]


@cache
def compressed(content: bytes) -> bytes:
    """The same for a client that asks for gzip."""
    return gzip.compress(content, 6, mtime=0)
