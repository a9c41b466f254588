"""The file that a new robot is taken from, if any."""

from __future__ import annotations

from pathlib import Path

from fulmar_core.config.errors import ConfigError
from fulmar_evaluation.new_robot.description import Description
from fulmar_evaluation.new_robot.urdf_reader import read_urdf


def read_description(urdf: Path | None, mjcf: Path | None, root: str = "") -> Description | None:
    """Read a URDF or an MJCF; None where neither is given.

    Raises:
        ConfigError: Both are given, or the file cannot be read.
    """
    if urdf is not None and mjcf is not None:
        raise ConfigError("--urdf and --mjcf exclude one another: give one file.")
    if urdf is not None:
        return read_urdf(urdf, root)
    if mjcf is not None:
        from fulmar_evaluation.new_robot.mjcf_reader import read_mjcf  # MuJoCo is an extra

        return read_mjcf(mjcf, root)
    if root:
        raise ConfigError("--root names a link of a file: give --urdf or --mjcf.")
    return None
