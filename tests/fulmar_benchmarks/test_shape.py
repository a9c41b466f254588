"""The shape of every benchmark: what is kept, what is measured again, and what a wrong word gets."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from fulmar_benchmarks import outcomes
from fulmar_benchmarks.campaign import measured, run, write
from fulmar_benchmarks.catalogue import choice, rows
from fulmar_benchmarks.outcomes import keep, keys_of, read
from fulmar_benchmarks.shape import Check
from fulmar_benchmarks.tables import Entry, Row, Table, print_shown, shown_as_html
from fulmar_core.config.errors import ConfigError, RunFailed, UnknownNameError
from tests.fulmar_benchmarks.tiny import asked

MOMENT = ("wall_s", "command")


def without_moment(document):
    return {key: value for key, value in document.items() if key not in MOMENT}


def noted(folder: Path) -> list[str]:
    return (folder / "notes").read_text().split()


def test_what_was_measured_is_taken_from_its_files_and_gives_an_equal_document(tmp_path):
    first, second = run(asked(tmp_path)), run(asked(tmp_path))
    assert noted(tmp_path) == ["1", "2", "3"], "the costliest first"
    assert without_moment(first.document) == without_moment(second.document)
    run(asked(tmp_path, fresh=True))
    assert len(noted(tmp_path)) == 6


def test_a_benchmark_that_is_killed_in_the_middle_goes_on_and_gives_an_equal_document(tmp_path):
    whole = run(asked(tmp_path / "whole"))
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "block_2").touch()
    process = subprocess.Popen([sys.executable, "-m", "tests.fulmar_benchmarks.tiny", str(broken)])
    until = time.monotonic() + 30.0
    while time.monotonic() < until and not ((broken / "notes").exists() and "2" in noted(broken)):
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    (broken / "block_2").unlink()
    assert without_moment(run(asked(broken)).document) == without_moment(whole.document)
    assert noted(broken) == ["1", "2", "2", "3"], "the first cell was kept"


def test_a_torn_outcome_is_set_aside_in_one_line_and_measured_again(tmp_path, capsys):
    whole = run(asked(tmp_path))
    path = tmp_path / "outcomes" / "cell_2.npz"
    torn = path.read_bytes()[:100]
    path.write_bytes(torn)
    again = run(asked(tmp_path))
    assert without_moment(again.document) == without_moment(whole.document)
    assert path.with_name("cell_2.npz.torn").read_bytes() == torn, "nothing is lost"
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("warning: ")
    assert "is now cell_2.npz.torn, and is measured again" in line
    assert noted(tmp_path)[3:] == ["2"]


def test_whatever_bits_of_an_outcome_are_flipped_it_is_the_same_or_set_aside(tmp_path):
    path = tmp_path / "one.npz"
    figures = {"name": "x", "numbers": np.arange(40.0)}
    keep(path, "key", figures)
    whole = path.read_bytes()
    for place in range(0, len(whole), 7):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :])
        found = read(path, "key")
        assert found is None or found["name"] == "x"


def test_a_cell_that_fails_costs_no_other_its_figures_and_is_tried_again(tmp_path):
    (tmp_path / "fail_2").touch()
    with pytest.raises(RunFailed, match="cell_2: RuntimeError: it broke; what was measured is kept"):
        run(asked(tmp_path))
    assert sorted(path.stem for path in (tmp_path / "outcomes").iterdir()) == ["cell_1", "cell_3"]
    (tmp_path / "fail_2").unlink()
    run(asked(tmp_path))
    assert noted(tmp_path) == ["1", "2", "3", "2"]


def test_figures_are_read_as_they_were_written(tmp_path):
    (cell,) = asked(tmp_path).cells()[2:]
    (first,) = measured([cell], folder=tmp_path, jobs=1).values()
    assert first["share"] == 1.0 / 3.0
    assert (first["square"], first["pair"], first["none"]) == (9, [1, 2.5], None)
    np.testing.assert_array_equal(first["inner"]["path"], np.arange(3, dtype=np.float32))


def test_a_key_knows_the_cell_and_the_code_of_its_class(tmp_path, monkeypatch):
    cell = asked(tmp_path).cells()[0]
    key = keys_of([cell])["cell_1"]
    assert keys_of([replace(cell, notes="elsewhere")])["cell_1"] == key, "not of where it runs"
    assert keys_of([replace(cell, number=4)])["cell_1"] != key
    read = Path.read_bytes
    monkeypatch.setattr(
        Path, "read_bytes", lambda path: read(path) + (b"#" if path.name == "tiny.py" else b"")
    )
    assert keys_of([cell])["cell_1"] != key


def test_the_document_says_what_made_it_and_what_was_required(tmp_path):
    document = run(asked(tmp_path, command="fulmar x")).document
    assert (document["benchmark"], document["format"], document["command"]) == ("tiny", 1, "fulmar x")
    assert set(document["machine"]) == {"platform", "processor", "cores", "python"}
    assert document["libraries"]["numpy"] == outcomes.library_version("numpy")
    assert document["fulmar_version"]
    assert "git_revision" in document
    assert (document["asked"], document["met"], document["open"]) == (3, 2, 0)
    assert document["checks"][2] == {
        "name": "cell_3", "measured": 9, "limit": 4, "met": False, "better": "less",
    }  # fmt: skip


def test_the_page_stands_beside_the_document(tmp_path):
    result = run(asked(tmp_path))
    assert write(result, report=False) == tmp_path / "tiny.json"
    page = write(result, report=True).read_text()
    assert "2 of 3 requirements are met." in page
    assert "NOT MET  cell_3: 9 (required: at most 4)" in page


def test_what_was_not_measured_is_open():
    assert (Check.least("a", None, 1.0).met, Check.least("a", 1.0, 1.0).met, Check.most("a", 1.1, 1.0).met) == (
        None, True, False,
    )  # fmt: skip


def test_terminal_and_page_have_the_same_rows(capsys):
    shown = [
        "above",
        Table("Title", ("", "value"), [Row((Entry("<one>"), Entry("1.0", "good")), "ours", True)]),
    ]
    print_shown(shown, Console(), 60)
    text, page = capsys.readouterr().out, "".join(shown_as_html(shown))
    assert "<one>" in text
    assert "1.0 ✓" in text
    assert '<tr class="ours"><td class="">&lt;one&gt;</td><td class="good">1.0 ✓</td></tr>' in page


def test_a_benchmark_that_does_not_exist_is_reported_with_the_nearest():
    with pytest.raises(UnknownNameError, match="Did you mean 'inertia'"):
        choice("inertai")


def test_a_selector_of_another_benchmark_is_reported_with_those_of_this_one():
    others = [row for row in rows().values() if row.name != "inertia"]
    with pytest.raises(ConfigError, match="inertia has --satellites, --profiles, --draws"):
        choice("inertia", kites="a")
    for row in others[:1]:
        with pytest.raises(ConfigError, match=f"selects in .*{row.name}.*, not in inertia"):
            choice("inertia", **{row.selectors[0].name: "a"})
