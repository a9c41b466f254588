"""Calls in several processes: what they return, raise and report comes here; a cluster that is not there is refused."""

from __future__ import annotations

import multiprocessing
import operator
import os
import socket
import threading
import time
from concurrent.futures import ProcessPoolExecutor

import pytest

from fulmar_core.config.errors import ConfigError, RunFailed
from fulmar_core.config.pool import ProcessPool, report
from fulmar_core.config.ray_address import check_that_ray_answers


def run(pool, function, items):
    """Results by index, and everything that was reported."""
    results, reported = {}, []
    pool.run(function, items, on_done=results.__setitem__, watch=lambda each: reported.append(dict(each)))
    return results, reported


def test_each_call_gives_what_it_returns_or_raises():
    results, _ = run(ProcessPool(2), operator.truediv, [(6.0, 3.0), (1.0, 0.0), (1.0, 4.0)])
    assert (results[0], results[2]) == (2.0, 0.25)
    assert isinstance(results[1], ZeroDivisionError)


def test_what_a_call_reports_is_received_and_processes_have_one_thread_each():
    results, reported = run(
        ProcessPool(1), eval, [("__import__('fulmar_core.config.pool').config.pool.report(7)",)]
    )
    assert results == {0: None}
    assert reported[-1] == {0: 7.0}
    results, _ = run(ProcessPool(1), os.getenv, [("OMP_NUM_THREADS",)])
    assert results == {0: "1"}


def test_a_process_that_is_ended_from_outside_is_an_error_of_the_run():
    with pytest.raises(RunFailed, match="a worker process was ended from outside"):
        run(ProcessPool(1), os._exit, [(3,)])


def test_a_pool_that_ends_after_an_error_leaves_other_pools_as_they_are():
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, spawn) as other:
        own = other.submit(os.getpid).result()

        def refuse(_index, _result):
            raise RunFailed("the first result is enough")

        with pytest.raises(RunFailed, match="the first result"):
            ProcessPool(1).run(operator.neg, [(1,), (2,)], on_done=refuse, watch=lambda _each: None)
        assert other.submit(os.getpid).result() == own


def test_no_items_begin_no_process():
    assert run(ProcessPool(2), operator.neg, []) == ({}, [])


def test_a_report_outside_of_a_pool_is_received_by_nobody():
    report(1.0)


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("nonsense", "must be HOST:PORT"),
        ("host:port", "must be HOST:PORT"),
        ("ray://127.0.0.1:1", "does not answer: .*refused.*`ray start --head`"),
        ("127.0.0.1:1", "does not answer: .*refused"),
    ],
)
def test_an_address_that_does_not_answer_is_said_in_one_line_at_once(address, said):
    began = time.monotonic()
    with pytest.raises(ConfigError, match=said) as found:
        check_that_ray_answers(address)
    assert address in str(found.value)
    assert "\n" not in str(found.value)
    assert time.monotonic() - began < 3.0


def test_a_server_that_is_silent_or_not_of_ray_is_refused(monkeypatch):
    monkeypatch.setattr("fulmar_core.config.ray_address.ANSWER_S", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(ConfigError, match="does not answer: timed out"):
            check_that_ray_answers(address)
        server.accept()[0].close()
        other = threading.Thread(target=lambda: server.accept()[0].sendall(b"HTTP/1.1 400 Bad Request\r\n"))
        other.start()
        with pytest.raises(ConfigError, match="answers, but not as Ray does"):
            check_that_ray_answers(address)
        other.join()
