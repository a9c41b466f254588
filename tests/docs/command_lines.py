"""The command lines of README and docs, as a reader copies them: blocks of code, files, markers."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MARKER = re.compile(r"^<!-- (needs hardware|needs a person)(?:: (.*))? -->$")
COMMAND = re.compile(r"^(?:\$ |sudo \.venv/bin/|[A-Z_]+=\S+ )*fulmar [a-z]")
SHELL = re.compile(r"^(?:cp |mkdir |sed |export FULMAR_CONFIGS=)")  # lines that commands after them need
PASTED = re.compile(r"^cat > (\S+) <<'EOF'$")
MODULE = re.compile(r'^"""(\w+\.py): ')  # the first line of a block that is a module
COMMENT = re.compile(r"\s+#\s.*$|\s{2,}(?=[^-\s\[]).*$")  # words beside a command explain it
MAKES = re.compile(r" --(?:out|record|to-bag|write)\b| bag plot | rates | report |^fulmar train ")


@dataclass(frozen=True)
class Line:
    """A command line of a page."""

    page: str  # stem of its file
    block: int  # of the page, from 0
    text: str
    marker: str = ""  # why a test cannot run it
    shell: bool = False  # makes a file or a variable, and is no command of Fulmar

    @property
    def is_module(self) -> bool:
        """Whether it writes a module of Python."""
        return self.shell and self.text.partition(" <<")[0].endswith(".py")


def pages() -> dict[str, str]:
    """Text of README and of each page, by the stem of its file."""
    files = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
    return {file.stem: file.read_text(encoding="utf-8") for file in files}


def lines_of(page: str, text: str) -> list[Line]:
    """Command lines of a page, in order, with those that write the files which they need.

    A comment `<!-- needs hardware -->` or `<!-- needs a person -->` before a block marks the commands of the block;
    with a command behind a colon that one, or with ` ...` at its end those that begin so.
    """
    found: list[Line] = []
    marks: list[tuple[str, str]] = []
    for number, (language, body) in enumerate(_blocks(text)):
        if language == "text":  # what a program prints
            continue
        if language == "marker":
            marks.append((body[0], body[1]))
            continue
        found += [replace(line, marker=_marker(line, marks)) for line in _commands(page, number, body)]
        marks = []
    return found


def all_lines() -> list[Line]:
    """Command lines of all pages; one that is there already counts once, unless it makes files for its page."""
    seen: set[str] = set()
    found = []
    for page, text in pages().items():
        for line in lines_of(page, text):
            if line.shell or line.text not in seen or MAKES.search(line.text):
                found.append(line)
            if not line.shell:
                seen.add(line.text)
    return found


def _blocks(text: str) -> Iterator[tuple[str, list[str]]]:
    """Fenced and indented blocks, and markers: language or `marker`, and lines."""
    rows = iter(text.splitlines())
    indented: list[str] = []
    for row in rows:
        if indented and row.strip() and not row.startswith("    "):
            yield "", indented
            indented = []
        if mark := MARKER.match(row):
            yield "marker", [mark[1], mark[2] or ""]
        elif fence := re.match(r"^( *)```(\w*)", row):
            body = []
            for inner in rows:
                if inner.strip() == "```":
                    break
                body.append(inner.removeprefix(fence[1]))
            yield fence[2], body
        elif row.startswith("    "):
            indented.append(row.removeprefix("    "))
    if indented:
        yield "", indented


def _commands(page: str, block: int, body: list[str]) -> Iterator[Line]:
    if body and (module := MODULE.match(body[0])):
        yield Line(page, block, _pasted(module[1], body), shell=True)
        return
    rows = iter(body)
    for row in rows:
        if pasted := PASTED.match(row):
            yield Line(page, block, _pasted(pasted[1], _until_eof(rows)), shell=True)
        elif SHELL.match(row):
            yield Line(page, block, _plain(row), shell=True)
        elif COMMAND.match(row):
            yield Line(page, block, re.sub(r"^(?:\$ |sudo \.venv/bin/)", "", _plain(row)))


def _until_eof(rows: Iterator[str]) -> Iterator[str]:
    for row in rows:
        if row == "EOF":
            return
        yield row


def _pasted(file: str, body: Iterable[str]) -> str:
    return "\n".join((f"cat > {file} <<'EOF'", *body, "EOF"))


def _plain(row: str) -> str:
    return COMMENT.sub("", row.rstrip())


def _marker(line: Line, marks: list[tuple[str, str]]) -> str:
    if line.shell:
        return ""
    return next((kind for kind, command in marks if _means(command, line.text)), "")


def _means(command: str, text: str) -> bool:
    """Whether a marker means a line: all of its block, the same command, or one that begins so."""
    return (
        text.startswith(command.removesuffix(" ...")) if command.endswith(" ...") else command in ("", text)
    )
