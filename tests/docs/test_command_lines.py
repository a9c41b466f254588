"""How the documented command lines are found, marked and shortened; test_commands_run_*.py runs them."""

from __future__ import annotations

import re

import pytest

from tests.docs import budgets, companions
from tests.docs.command_lines import Line, all_lines, lines_of
from tests.docs.page_run import PARTS_OF_TEST, is_fine, left_out, pages_of
from tests.docs.shell import SERVERS, Outcome

MOST_MARKED = 10
PLACEHOLDER = re.compile(r"(?<!-s )\b[A-Z]{2,}\b")  # but for the name of a signal
BRIEFLY = min(companions.LEARNED_BRIEFLY)
PAGE = """
<!-- needs hardware: fulmar run a ... -->

```
fulmar run a --goal 1,2     # words
fulmar run b
export FULMAR_CONFIGS=$PWD/mine
cat > mine/x.yaml <<'EOF'
fulmar: inside
EOF
make demo
```

Words.

    fulmar goals circle --robot r      a description

<!-- needs a person -->
```
fulmar teleop r
```

```text
fulmar run printed
```
"""


@pytest.fixture(scope="module")
def lines() -> list[Line]:
    return [line for line in all_lines() if not line.shell]


def test_lines_of_fenced_and_indented_blocks_are_found_with_files_and_markers():
    found = [(line.block, line.text.splitlines()[0], line.marker) for line in lines_of("x", PAGE)]
    assert found == [
        (1, "fulmar run a --goal 1,2", "needs hardware"),
        (1, "fulmar run b", ""),
        (1, "export FULMAR_CONFIGS=$PWD/mine", ""),
        (1, "cat > mine/x.yaml <<'EOF'", ""),
        (2, "fulmar goals circle --robot r", ""),
        (4, "fulmar teleop r", "needs a person"),
    ]


def test_at_most_ten_lines_are_marked(lines):
    marked = {line.text for line in lines if line.marker}
    assert 0 < len(marked) <= MOST_MARKED, sorted(marked)


def test_every_page_is_run_by_one_of_the_two_tests(lines):
    pages = [page for part in PARTS_OF_TEST for page in pages_of(part)]
    assert sorted(pages) == sorted({line.page for line in lines})


@pytest.mark.parametrize(
    ("name", "table"),
    [
        ("what is run instead", budgets.INSTEAD),
        ("what runs beside", companions.BESIDE),
        ("what is left out", companions.EXCLUDED),
        ("what needs an environment", companions.NEEDS),
        ("what ends with another code", companions.CODES),
        ("what has learned briefly", companions.LEARNED_BRIEFLY),
    ],
)
def test_every_row_of_a_table_is_a_line_of_the_docs(name, table, lines):
    assert set(table) - {line.text for line in lines} == set(), name


def test_no_line_runs_with_a_placeholder(lines):
    run = [
        budgets.shortened(line.text)
        for line in lines
        if not line.marker and line.text not in companions.EXCLUDED
    ]
    assert [text for text in run if PLACEHOLDER.search(text)] == []


def test_every_budget_and_every_kind_of_server_is_used(lines):
    texts = {line.text for line in lines}
    for row in budgets.PARTS:
        others = [each for each in budgets.PARTS if each is not row]
        assert any(budgets.shortened(text) != budgets.shortened(text, others) for text in texts), row
    for pattern, _ in SERVERS:
        started = [*texts, *(each for needed in companions.BESIDE.values() for each in needed)]
        assert any(pattern.search(text) for text in started), pattern.pattern


@pytest.mark.parametrize(
    ("shown", "run"),
    [
        ("fulmar train a b --time-limit 600 --out c", "fulmar train a b --time-limit 3 --out c --episodes 4"),
        ("fulmar train a b", "fulmar train a b --updates 1 --episodes 4"),
        ("fulmar run a --lockstep --seed 3", "fulmar run a --lockstep --seed 3"),
        ("fulmar run a", "fulmar run a --duration 5"),
        (
            "fulmar benchmark estimator --plot x.png",
            "fulmar benchmark estimator --plot x.png --drives 1 --seconds 10",
        ),
    ],
)
def test_learning_real_time_and_benchmarks_have_smaller_budgets(shown, run):
    assert budgets.shortened(shown) == run


def test_a_marked_line_does_not_run(lines):
    marked = [line for line in lines if line.marker]
    assert all(left_out(line) for line in marked)


@pytest.mark.parametrize(
    ("shown", "run", "code", "output", "fine"),
    [
        ("fulmar run a", "fulmar run a", 0, "goal met", True),
        ("fulmar run a", "fulmar run a", 1, "goal missed", False),
        ("fulmar run a", "fulmar run a --duration 5", 1, "goal missed", True),
        ("fulmar run a", "fulmar run a --duration 5", 1, "Traceback", False),
        (BRIEFLY, BRIEFLY, 1, "goal missed", True),
        (BRIEFLY, BRIEFLY, 1, "Traceback", False),
    ],
)
def test_a_run_cut_short_or_of_a_policy_that_learned_briefly_may_only_miss_its_goal(
    shown, run, code, output, fine
):
    assert is_fine(Outcome(run, code, 1.0, output), shown) is fine
