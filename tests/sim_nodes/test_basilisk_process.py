"""The process with Basilisk: started once, shared, and every way in which it may fail as one line."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fulmar_core.config import other_environment
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots import basilisk_robots
from sim_nodes import basilisk_process
from sim_nodes.basilisk_process import BasiliskCraft, BasiliskError, BasiliskProcess

# It stands for `basilisk_server.py`: says where it runs, and counts what it is asked.
SERVER = """
import json, os, sys, time
from multiprocessing.connection import Connection
pipe, asked = Connection(int(sys.argv[1])), []
pipe.send_bytes(json.dumps({"version": "2.0"}).encode())
while True:
    try:
        request = json.loads(pipe.recv_bytes())
    except EOFError:
        break
    asked.append(request)
    if "die" in request:
        raise RuntimeError("out of fuel")
    if "sleep" in request:
        time.sleep(60.0)
    print("a line of a library")
    pipe.send_bytes(json.dumps({"process": os.getpid(), "asked": asked}).encode())
"""


@pytest.fixture(autouse=True)
def server(tmp_path, monkeypatch):
    """A stand-in for the server and for its Python."""
    script = tmp_path / "server.py"
    script.write_text(SERVER, encoding="utf-8")
    monkeypatch.setattr(basilisk_process, "SERVER", script)
    monkeypatch.setattr(basilisk_process, "basilisk_python", lambda: Path(sys.executable))
    monkeypatch.setattr(BasiliskCraft, "_running", None)
    monkeypatch.setattr(BasiliskCraft, "_numbers", set())
    return script


def lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def test_bodies_share_one_process_which_ends_with_the_last_of_them():
    one, other = BasiliskCraft(), BasiliskCraft()
    first, second = one.ask(begin={}), other.ask(begin={})
    assert first["process"] == second["process"] != os.getpid()
    assert len({request["craft"] for request in second["asked"]}) == 2
    one.close()
    one.close()
    assert other.ask()["asked"][-2] == {"craft": first["asked"][0]["craft"], "end": True}
    other.close()
    assert not lives(first["process"])
    again = BasiliskCraft()
    assert again.ask()["process"] != first["process"]
    again.close()


def test_a_process_that_dies_is_named_with_its_last_words_and_the_next_body_starts_another():
    craft = BasiliskCraft()
    with pytest.raises(BasiliskError, match=r"^Basilisk's process has ended: RuntimeError: out of fuel\.$"):
        craft.ask(die=True)
    with pytest.raises(BasiliskError, match=r"has ended\. Start the simulation again"):
        craft.ask()
    craft.close()
    another = BasiliskCraft()
    assert another.ask()["process"]
    another.close()


def test_a_process_that_does_not_answer_is_ended(monkeypatch):
    process = BasiliskProcess()
    number = process.ask({})["process"]
    monkeypatch.setattr(basilisk_process, "LONGEST_S", 0.2)
    with pytest.raises(BasiliskError, match=r"does not answer within 0\.2 s"):
        process.ask({"sleep": True})
    assert not lives(number)


def test_a_python_without_basilisk_is_one_line_with_what_to_run(server):
    server.write_text("import Basilisk_that_is_nowhere\n", encoding="utf-8")
    words = r"has ended: ModuleNotFoundError: No module named 'Basilisk_that_is_nowhere'\. Run: make peers$"
    with pytest.raises(BasiliskError, match=words):
        BasiliskProcess()


def test_a_python_that_cannot_be_run_is_one_line_with_what_to_run(tmp_path):
    with pytest.raises(BasiliskError, match=r"cannot be run \(PermissionError\)\. Run: make peers$"):
        BasiliskProcess(tmp_path)


def test_a_missing_environment_is_one_line_with_what_to_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(other_environment, "config_directory", lambda: tmp_path / "configs")
    with pytest.raises(ConfigError) as refused:
        basilisk_robots.basilisk_python()
    assert str(refused.value) == (
        "Basilisk runs in an environment of its own, and .venv-peers/bin/python is missing. Run: make peers"
    )


def test_it_ends_when_ours_is_killed(tmp_path):
    script = (
        "import sys; from pathlib import Path; import sim_nodes.basilisk_process as b\n"
        f"b.SERVER = Path({str(basilisk_process.SERVER)!r})\n"
        "process = b.BasiliskProcess(Path(sys.executable))\n"
        "import os; print(process.ask({})['process'], flush=True); os.kill(os.getpid(), 9)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    number, until = int(done.stdout), time.monotonic() + 20.0
    while lives(number) and time.monotonic() < until:
        time.sleep(0.05)
    assert not lives(number)
