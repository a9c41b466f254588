"""Runs the test of each guard in a tree without that guard."""

from __future__ import annotations

import contextlib
import os
import queue
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from importlib.util import cache_from_source
from pathlib import Path

from fulmar_bringup.progress import work_bar
from tests.mutants.table import Guard

HANGS_S = 40  # of a test without its guard, which counts as failed then [s]
DEAD, SURVIVES, FAILS, NO_RUN = "dead", "survives", "fails with its guard", "does not run"
# A replacement that is no code of this file ends its test too, and shows nothing.
MISWRITTEN = re.compile(
    r"^E +(NameError|SyntaxError|IndentationError|ImportError|UnboundLocalError)\b", re.MULTILINE
)


def run(guards: list[Guard], root: Path, *, jobs: int) -> dict[str, str]:
    """What becomes of each guard of a repository, by its name: DEAD is as it must be."""
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder, work_bar("guards") as bar:
        trees: queue.Queue[Path] = queue.Queue()
        first = _copy(root, Path(folder) / "0")
        failing = _failing(first, sorted({guard.test for guard in guards}), jobs)
        for number in range(jobs):  # with the bytecode that the first one has made
            trees.put(shutil.copytree(first, Path(folder) / str(number), symlinks=True) if number else first)

        def evaluate(guard: Guard) -> str:
            if any(name.partition("[")[0] == guard.test for name in failing):
                return FAILS
            tree = trees.get()
            try:
                return _without(guard, tree)
            finally:
                trees.put(tree)

        with ThreadPoolExecutor(jobs) as pool:
            asked = {pool.submit(evaluate, guard): guard.name for guard in guards}
            results = {}
            for done in as_completed(asked):
                results[asked[done]] = done.result()
                bar(len(results), len(guards))
    return results


def result_of(code: int, said: str) -> str:
    """What pytest's exit code, and what it said of a test, mean for the guard that it ran without."""
    if code == 0:
        return SURVIVES if re.search(r"\d passed", said) else NO_RUN  # all skipped
    return DEAD if code == 1 and not MISWRITTEN.search(said) else NO_RUN


def _without(guard: Guard, tree: Path) -> str:
    """Run the test of a guard in a tree that lacks it meanwhile."""
    path = tree / guard.file
    source = path.read_text(encoding="utf-8")
    try:
        _write(path, guard.removed(source))
        return result_of(*_pytest(tree, "-x", guard.test, within_s=HANGS_S))
    finally:
        _write(path, source)


def _write(path: Path, source: str) -> None:
    path.write_text(source, encoding="utf-8")
    # Python compares time and size alone: it would take one of the same second and length for unchanged.
    Path(cache_from_source(str(path))).unlink(missing_ok=True)


def _failing(tree: Path, tests: Iterable[str], jobs: int) -> list[str]:
    """Tests that do not pass as the tree is: failed, broken or skipped."""
    code, said = _pytest(tree, "-rA", "-p", "xdist", "-n", str(jobs), *tests)
    if code not in (0, 1):
        raise SystemExit(f"{said}\nThe tests of the guards cannot be run as the tree is.")
    passed = {name.partition("[")[0] for name in re.findall(r"^PASSED (\S+)", said, re.MULTILINE)}
    return [*re.findall(r"^(?:FAILED|ERROR) (\S+)", said, re.MULTILINE), *({*tests} - passed)]


def _pytest(tree: Path, *arguments: str, within_s: float | None = None) -> tuple[int, str]:
    """Exit code and output of pytest in a tree; where it takes longer than a time [s], it has failed."""
    packages = [str(path) for path in sorted(tree.glob("ros2_ws/src/*")) if path.is_dir()]
    # Each plugin that a test does not need costs more than most of these tests.
    own = {"PYTHONPATH": os.pathsep.join([*packages, str(tree)]), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    environment = {**os.environ, **own}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "-p",
        "pytest_timeout",
        *arguments,
    ]
    with subprocess.Popen(
        command,
        cwd=tree,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    ) as child:
        try:
            said, _ = child.communicate(timeout=within_s)
            return child.returncode, said
        except subprocess.TimeoutExpired:
            return 1, "it hangs"
        finally:
            with contextlib.suppress(ProcessLookupError):  # what the test started ends with it
                os.killpg(child.pid, signal.SIGKILL)


def _copy(root: Path, to: Path) -> Path:
    """Copy what git tracks or would track, as it is now."""
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(listed, cwd=root, capture_output=True, text=True, check=True).stdout.split("\0")
    for name in filter(None, names):
        if (root / name).is_symlink() or (root / name).exists():
            (to / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, to / name, follow_symlinks=False)
    return to
