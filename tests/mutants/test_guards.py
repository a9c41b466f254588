"""The table of guards fits the product, and a guard that no test holds is found."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tests.mutants.runner import DEAD, NO_RUN, SURVIVES, result_of, run
from tests.mutants.table import REPOSITORY, Guard, read_guards

GUARDS = read_guards()
FEWEST = 60

SOURCE = """def limited(value):
    if value > 1.0:
        return 1.0
    if value < -1.0:
        return -1.0
    return value
"""
TEST = """from limits import limited


def test_much_is_cut():
    assert limited(2.0) == 1.0
    assert limited(-2.0) <= 1.0
"""


def test_each_guard_stands_once_in_its_file_and_has_its_test():
    assert [problem for guard in GUARDS if (problem := guard.problem(REPOSITORY))] == []


def test_guards_have_names_of_their_own_and_are_many():
    assert len({guard.name for guard in GUARDS}) == len(GUARDS) >= FEWEST


def test_tests_of_guards_need_no_clock():
    assert [guard.name for guard in GUARDS if guard.test.startswith("tests/ros/")] == []


def test_every_driver_has_a_guard():
    drivers = {path.name for path in (REPOSITORY / "hardware_drivers").glob("*_driver.py")}
    assert drivers - {Path(guard.file).name for guard in GUARDS} == set()


@pytest.fixture
def limits(tmp_path):
    """A repository with two guards and a test of one of them, and a function that makes a row of it."""
    (tmp_path / "limits.py").write_text(SOURCE)
    (tmp_path / "test_limits.py").write_text(TEST)
    subprocess.run(["git", "init", "--quiet"], cwd=tmp_path, check=True)

    def row(text, by="if False", test="test_limits.py::test_much_is_cut"):
        return Guard("limits", text, "limits.py", text, by, "Too much.", test)

    return tmp_path, row


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (
            {"text": "if value > 2.0"},
            "stands 0 times in limits.py, must be once. Nearest line, 2: if value > 1.0:",
        ),
        ({"text": "if value"}, "stands 2 times in limits.py"),
        ({"text": "if value > 1.0", "by": "if"}, "limits.py is no Python without it, in line 2"),
        (
            {"text": "if value > 1.0", "test": "test_limits.py::test_much_is_cute"},
            "there is no test test_limits.py::test_much_is_cute. Nearest: test_much_is_cut.",
        ),
    ],
)
def test_a_row_that_does_not_fit_is_one_line_with_the_nearest(limits, change, says):
    folder, row = limits
    assert says in row(**change).problem(folder)


@pytest.mark.parametrize(
    ("code", "said", "result"),
    [
        (1, "E   assert 2.0 == 1.0\n1 failed in 0.1s", DEAD),
        (1, "E   DeviceError: gone\n1 error in 0.1s", DEAD),
        (0, "1 passed in 0.1s", SURVIVES),
        (0, "1 skipped in 0.1s", NO_RUN),
        (1, "E   NameError: name 'x' is not defined\n1 failed in 0.1s", NO_RUN),
        (2, "Interrupted: 1 error during collection", NO_RUN),
        (4, "ERROR: not found", NO_RUN),
        (-11, "", NO_RUN),
    ],
)
def test_only_a_test_that_ran_and_failed_shows_that_a_guard_is_held(code, said, result):
    assert result_of(code, said) == result


@pytest.mark.slow  # it runs pytest three times; what it decides by is above
def test_a_guard_that_no_test_holds_survives_and_the_checkout_stays_as_it_is(limits):
    folder, row = limits
    guards = [row("if value > 1.0"), row("if value < -1.0")]
    assert run(guards, folder, jobs=1) == {"if value > 1.0": DEAD, "if value < -1.0": SURVIVES}
    assert (folder / "limits.py").read_text() == SOURCE
