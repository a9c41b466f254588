"""Files for Foxglove and Rerun, read back with the readers of others."""

from __future__ import annotations

import asyncio
import json
import struct
import threading

import numpy as np
import pytest
from mcap.reader import make_reader
from typer.testing import CliRunner

from fulmar_cli.main import app
from fulmar_console.bags.recording import read_recording
from fulmar_core.robots.mesh_file import Mesh
from fulmar_core.robots.mesh_outline import packed
from tests.fulmar_cli.bag_commands import LQR

MESH = Mesh(
    np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float), np.array([[0, 1, 2], [0, 3, 1]])
)


def recording():
    return read_recording([LQR], "run", lambda *_: None)


def of_a_meshed_robot():
    """The same recording of a robot that has a mesh among its parts."""
    found = recording()
    part = {"shape": "mesh", "size": [1, 1, 1], "at": [0, 0, 0], "quat": [0, 0, 0, 1], "color": "own"}
    found.document["robots"][0]["info"]["look"] = [part | {"mesh": packed(MESH)}]
    return found


def test_foxglove_gets_its_own_schemas_in_mcap(tmp_path):
    pytest.importorskip("foxglove")
    from fulmar_console.exports.foxglove_file import write_foxglove

    path = write_foxglove(recording(), tmp_path / "run.mcap")
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    found = {channel.topic: summary.schemas[channel.schema_id].name for channel in summary.channels.values()}
    assert found["/scene"] == "foxglove.SceneUpdate"
    assert found["/frames"] == "foxglove.FrameTransforms"
    assert found["/floating_platform/pose"] == found["/floating_platform/goal"] == "foxglove.PoseInFrame"
    with path.open("rb") as file:
        signals = [
            json.loads(m.data) for _, _, m in make_reader(file).iter_messages(["/floating_platform/signals"])
        ]
    assert signals[0]["error"] > signals[-1]["error"] and "thruster_1" in signals[0]


def test_foxglove_and_rerun_draw_the_triangles_of_a_mesh(tmp_path):
    pytest.importorskip("foxglove")
    pytest.importorskip("rerun")
    from fulmar_console.exports.foxglove_file import write_foxglove
    from fulmar_console.exports.rerun_file import write_rerun

    with write_foxglove(of_a_meshed_robot(), tmp_path / "run.mcap").open("rb") as file:
        scenes = [m.data for _, _, m in make_reader(file).iter_messages(["/scene"])]
    assert struct.pack("<4I", 0, 1, 2, 0) in scenes[0] or bytes([0, 1, 2, 0, 3, 1]) in scenes[0]
    assert b"/body/mesh_0" in write_rerun(of_a_meshed_robot(), tmp_path / "run.rrd").read_bytes()


def test_rerun_opens_what_is_written_for_it(tmp_path):
    rerun = pytest.importorskip("rerun")
    from fulmar_console.exports.rerun_file import write_rerun

    path = write_rerun(recording(), tmp_path / "run.rrd")
    content = path.read_bytes()
    assert content.startswith(b"RRF2") and rerun.__version__
    assert b"/floating_platform" in content


def test_a_second_viewer_on_one_port_is_refused_and_a_first_gets_channels():
    foxglove = pytest.importorskip("foxglove")
    websockets = pytest.importorskip("websockets")
    from fulmar_console.exports.foxglove_file import steps_of
    from fulmar_console.exports.foxglove_scene import FoxgloveScene
    from fulmar_console.exports.foxglove_server import _started
    from fulmar_core.config.errors import ConfigError

    context = foxglove.Context()
    server = _started(0, context)
    over = threading.Event()

    def publish() -> None:
        scene = FoxgloveScene(context)
        while not over.wait(0.05):
            for _, step in list(steps_of(recording(), scene))[:20]:
                step()

    async def topics() -> set[str]:
        async with websockets.connect(
            f"ws://127.0.0.1:{server.port}", subprotocols=["foxglove.sdk.v1"]
        ) as client:
            found: set[str] = set()
            while "/scene" not in found:
                message = await asyncio.wait_for(client.recv(), 10.0)
                received = json.loads(message) if isinstance(message, str) else {}
                found |= {channel["topic"] for channel in received.get("channels", ())}
            return found

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        assert "/frames" in asyncio.run(topics())
        with pytest.raises(ConfigError, match="another program listens"):
            _started(server.port, foxglove.Context())
    finally:
        over.set()
        thread.join()
        server.stop()


def test_exports_name_the_file_that_they_wrote(tmp_path):
    pytest.importorskip("foxglove")
    out = tmp_path / "x.mcap"
    done = CliRunner().invoke(
        app, ["bag", "export", str(LQR), "--to", "foxglove", "--out", str(out), "--json"]
    )
    assert json.loads(done.stdout)["files"] == [str(out)] and out.stat().st_size > 10_000


def test_a_viewer_must_be_named():
    done = CliRunner().invoke(app, ["view", str(LQR)])
    assert "fulmar view --foxglove" in str(done.exception)
