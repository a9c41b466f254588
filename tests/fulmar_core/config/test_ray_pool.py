"""Calls on a Ray cluster of two nodes of this machine: the same results, also where a node is lost meanwhile."""

from __future__ import annotations

import operator
import sys
import time

import pytest

from fulmar_core.config.errors import ConfigError, RunFailed
from fulmar_core.config.ray_address import check_that_ray_answers
from tests.fulmar_core.config.test_pool import run
from tests.ray_cluster import two_nodes

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.version_info >= (3, 14), reason="Ray has no wheels for Python 3.14"),
]
REPORTS = "__import__('fulmar_core.config.pool').config.pool.report(7) or __import__('time').sleep(2)"


def test_calls_on_two_nodes_give_results_errors_and_reports_and_survive_the_loss_of_a_node(monkeypatch):
    from fulmar_core.config import ray_pool

    with two_nodes() as cluster:
        check_that_ray_answers(cluster.address)
        pool = ray_pool.RayPool(cluster.address)
        results, _ = run(pool, operator.truediv, [(6.0, 3.0), (1.0, 0.0), (1.0, 4.0)])
        assert (results[0], results[2]) == (2.0, 0.25)
        assert isinstance(results[1], RunFailed)
        assert str(results[1]) == "ZeroDivisionError float division by zero"
        results, reported = run(
            pool, eval, [(REPORTS,), ("__import__('os').getenv('OPENBLAS_NUM_THREADS')",)]
        )
        assert results == {0: None, 1: "1"}
        assert {0: 7} in reported

        monkeypatch.setattr(ray_pool, "_code", lambda: "0.1 another")
        results, _ = run(pool, operator.neg, [(1,)])
        assert "another asks: install the same on both" in str(results[0])
        monkeypatch.undo()

        results, begun = {}, time.monotonic()

        def lose_a_node(_reported):
            if cluster.second is not None and time.monotonic() - begun > 1.0:
                cluster.remove_node(cluster.second)
                cluster.second = None

        sleep = "__import__('time').sleep(3) or {}"
        items = [(sleep.format(number),) for number in range(3)]
        pool.run(eval, items, on_done=results.__setitem__, watch=lose_a_node)
        assert results == {0: 0, 1: 1, 2: 2}
        assert cluster.second is None
        pool.close()


def test_a_cluster_of_this_machine_that_is_not_there_is_refused():
    from fulmar_core.config.ray_pool import RayPool

    with pytest.raises(ConfigError, match=r"^Ray.*Could not find any running Ray instance"):
        RayPool("auto")
