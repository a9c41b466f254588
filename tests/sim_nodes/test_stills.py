"""The figure of all things in space, which a command draws."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from fulmar_core.worlds.structures import list_structures
from sim_nodes.camera.stills import CAMERA, write_stills


def test_the_figure_shows_every_thing_whole_and_is_small(tmp_path: Path) -> None:
    out = tmp_path / "things.png"
    write_stills(out)
    drawn = np.asarray(Image.open(out).convert("L"))
    assert out.stat().st_size < 100_000
    assert drawn.shape == (CAMERA.height, CAMERA.width * len(list_structures()))
    for each in np.split(drawn, len(list_structures()), axis=1):
        assert (each > 20).mean() > 0.02
        edges = (each[0], each[-1], each[:, 0], each[:, -1])
        assert all((edge <= 20).all() for edge in edges), "a part lies outside of the frame"
