"""Draw every thing in space side by side into one PNG: `python -m sim_nodes.camera.stills FILE.png`."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from fulmar_core.robots.sensors.camera import CameraConfig
from fulmar_core.states.attitude import from_euler
from fulmar_core.worlds.structures import Structure, list_structures, load_structure
from sim_nodes.camera.renderer import Renderer

CAMERA = CameraConfig(width=480, height=360, field_of_view=50.0)
FAR = 3.0  # of the camera from the middle, in half sizes [-]
FROM = (0.62, -0.60, 0.50)  # direction in which it stands


def still(structure: Structure) -> np.ndarray:
    """A thing from above at an angle, uint8 (h, w, 3)."""
    place = FAR * structure.half_size * np.array(FROM) / np.linalg.norm(FROM)
    x, y, z = -place / np.linalg.norm(place)
    pose = np.array([*place, *map(float, from_euler(0.0, -math.asin(z), math.atan2(y, x)))])
    with Renderer(CAMERA, [structure]) as renderer:
        return renderer.render(pose).rgb


def write_stills(out: Path) -> None:
    """Write the image of all things, in the order of their names."""
    row = np.concatenate([still(load_structure(name)) for name in list_structures()], axis=1)
    Image.fromarray(row).quantize(128).save(out, optimize=True)


if __name__ == "__main__":
    write_stills(Path(sys.argv[1]))
