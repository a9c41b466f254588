"""Steps of a twin: what did not change is not done again."""

from __future__ import annotations

import json

import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_evaluation.twin.steps import Steps


class Work:
    """A step that counts how often it is done, and writes a file."""

    def __init__(self, folder):
        self.lines, self.done = [], 0
        self.steps = Steps(folder, ("first", "second"), self.lines.append)
        self.file = folder / "made.txt"

    def take(self, **made_from):
        def make():
            self.done += 1
            self.file.write_text("content")
            return {"number": self.done}

        return self.steps.take("first", made_from, make, (self.file,))


@pytest.fixture
def work(tmp_path):
    made = Work(tmp_path / "twin")
    made.steps.begin()
    return made


def test_a_step_whose_inputs_are_the_same_is_read_from_its_file(work):
    assert work.take(seed=1, names=("a", "b")) == work.take(seed=1, names=("a", "b")) == {"number": 1}
    assert work.lines == ["1 of 2, first ...", "1 of 2, first: nothing has changed"]


def test_a_step_is_done_again_where_an_input_changed(work):
    assert [work.take(seed=seed)["number"] for seed in (1, 2, 2)] == [1, 2, 2]


def test_a_step_is_done_again_where_its_file_is_gone_or_was_changed(work):
    work.take(seed=1)
    work.file.write_text("other")
    assert work.take(seed=1)["number"] == 2
    work.file.unlink()
    assert work.take(seed=1)["number"] == 3


def test_a_damaged_step_is_done_again(work, tmp_path):
    work.take(seed=1)
    for damaged in ("{", "[]", json.dumps({"result": {}})):
        (tmp_path / "twin" / "first.json").write_text(damaged)
        before = work.done
        work.take(seed=1)
        assert work.done == before + 1


def test_a_step_that_fails_leaves_no_result(work, tmp_path):
    def fail():
        raise ConfigError("no")

    with pytest.raises(ConfigError):
        work.steps.take("second", {}, fail)
    assert not (tmp_path / "twin" / "second.json").exists()


def test_a_folder_with_something_else_in_it_is_rejected(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(ConfigError, match=r"is not empty and holds no first\.json"):
        Steps(tmp_path, ("first",), print).begin()
    with pytest.raises(ConfigError, match="is a file"):
        Steps(tmp_path / "mine.txt", ("first",), print).begin()
