"""Benchmarks on a Ray cluster: the documents of one machine, to the bit; one that does not answer loses nothing."""

from __future__ import annotations

import sys

import pytest

from fulmar_benchmarks import pool
from fulmar_benchmarks.campaign import run
from fulmar_benchmarks.catalogue import choice, rows
from tests.fulmar_benchmarks.test_shape import noted, without_moment
from tests.fulmar_benchmarks.tiny import asked
from tests.ray_cluster import two_nodes

needs_ray = pytest.mark.skipif(sys.version_info >= (3, 14), reason="Ray has no wheels for Python 3.14")


class Elsewhere:
    """A pool that does its calls here, the last first; `lost` raise."""

    def __init__(self, *lost):
        self.calls, self.lost = [], lost

    def run(self, function, items, *, on_done, watch):
        self.calls.append(len(items))
        for index, item in reversed(list(enumerate(items))):
            watch({index: 0.5})
            on_done(index, OSError("no memory") if index in self.lost else function(*item))


def test_cells_on_a_cluster_give_the_document_of_one_machine(tmp_path, monkeypatch):
    here = run(asked(tmp_path / "here"))
    cluster = Elsewhere()
    monkeypatch.setattr(pool, "_cluster", [cluster])
    progress = []
    there = run(asked(tmp_path / "there"), progress=lambda *each: progress.append(each))
    assert without_moment(there.document) == without_moment(here.document)
    assert cluster.calls == [0, 1, 1, 1], "what needs a whole computer goes there one by one"
    assert progress[-1] == (24.0, 24.0)
    run(asked(tmp_path / "there"))
    assert noted(tmp_path / "there") == ["1", "2", "3"], "and is taken from its files afterwards"


def test_a_cell_whose_machine_fails_costs_no_other_its_figures(tmp_path, monkeypatch):
    cells, found = asked(tmp_path).cells(), {}
    monkeypatch.setattr(pool, "_cluster", [Elsewhere(1)])
    pool.in_a_pool(cells, 1, lambda done: None, lambda cell, figures: found.update({cell.name: figures}))
    assert found["cell_2"] == "no memory"
    assert (found["cell_1"]["square"], found["cell_3"]["square"]) == (1, 9)


@needs_ray
def test_an_address_that_does_not_answer_is_one_line_and_what_was_measured_stays(fulmar, tmp_path):
    kept = tmp_path / "outcomes" / "cell.npz"
    kept.parent.mkdir()
    kept.write_text("kept")
    code, out, err = fulmar("benchmark", "inertia", "--out", tmp_path, "--ray", "127.0.0.1:1")
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == 1
    assert "Ray address 127.0.0.1:1 does not answer" in err
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == [kept]
    assert kept.read_text() == "kept"


@pytest.mark.slow
@pytest.mark.timeout(300)
@needs_ray
def test_a_benchmark_on_two_nodes_gives_the_document_of_one_machine(tmp_path):
    def document(name):
        few = choice(
            "inertia", satellites="microsat", profiles="chirp,persistent", draws=1, out=tmp_path / name
        )
        return without_moment(run(rows()["inertia"].load()(few)).document)

    here = document("here")
    with two_nodes() as cluster, pool.on_cluster(cluster.address):
        assert document("there") == here
