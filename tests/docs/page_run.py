"""Runs the command lines of a page in order, and says which of them failed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from tests.docs.budgets import shortened
from tests.docs.command_lines import Line, all_lines
from tests.docs.companions import BESIDE, CODES, EXCLUDED, LEARNED_BRIEFLY, NEEDS, prepare
from tests.docs.shell import SERVERS, Outcome, PageShell

LONGEST_S = 180.0  # of one line
# Pages of the first of two processes; all others belong to the second.
FIRST_PART = ("README", "commands", "flight", "installation", "training")
PARTS_OF_TEST = (0, 1)
PRINTED = 1500  # characters of a failed command's output
MISSED = "goal missed"  # how a run says so that was cut before it could arrive


def pages_of(part: int) -> list[str]:
    """Pages with commands that one of the two processes runs, in order."""
    pages = dict.fromkeys(line.page for line in all_lines() if not line.shell)
    return [page for page in pages if (page in FIRST_PART) == (part == 0)]


def failures(page: str, folder: Path, domain: int) -> list[str]:
    """Run a page in an empty folder; each command that failed, with the end of what it printed."""
    lines = [line for line in all_lines() if line.page == page]
    shown = {shortened(line.text): line.text for line in lines}
    failed = []
    for each in outcomes(page, lines, folder, domain):
        text = shown.get(each.text, each.text)
        if not is_fine(each, text):
            end = each.output[-PRINTED:]
            failed.append(f"{text}: code {each.code} after {each.seconds:.0f} s of {each.text}\n{end}")
    return failed


def is_fine(outcome: Outcome, shown: str) -> bool:
    """Whether a line ended as it should; a run that was cut short, or learned little, may miss its goal."""
    may_miss = outcome.text != shown or shown in LEARNED_BRIEFLY
    return (may_miss and outcome.code == 1 and MISSED in outcome.output) or outcome.code in CODES.get(
        shown, (0,)
    )


def left_out(line: Line) -> str:
    """Why a line does not run here; empty: it runs."""
    if line.marker:
        return line.marker
    if line.text in NEEDS and not NEEDS[line.text].exists():
        return f"needs {NEEDS[line.text].name} of {NEEDS[line.text].parent.parent.name}"
    return EXCLUDED.get(line.text, "")


def outcomes(page: str, lines: list[Line], folder: Path, domain: int) -> Iterator[Outcome]:
    """Prepare the folder of a page, run its lines in order, and give what each did.

    Modules are written first: some pages show a command before the class that it loads.
    Servers run until the block ends, another server starts, or a line needs others beside it.
    """
    prepare(page, lines, folder)
    lines = sorted(lines, key=lambda line: not line.is_module)
    shell = PageShell(folder, domain)
    block = -1
    try:
        for line in lines:
            if line.block != block:
                block = line.block
                yield from shell.stop_servers()
            if not left_out(line):
                yield from _run(shell, line)
    finally:
        yield from shell.stop_servers()


def _run(shell: PageShell, line: Line) -> Iterator[Outcome]:
    if line.shell and line.text.startswith("export "):
        shell.export(line.text)
        return
    text = line.text if line.shell else shortened(line.text)
    server = not line.shell and any(pattern.search(text) for pattern, _ in SERVERS)
    if server or line.text in BESIDE:
        needed = BESIDE.get(line.text, ())
        yield from shell.stop_servers(*needed)
        for other in needed:
            if other not in [each.text for each in shell.servers]:
                yield shell.start(other)
    yield shell.start(text) if server else shell.run(text, LONGEST_S)
