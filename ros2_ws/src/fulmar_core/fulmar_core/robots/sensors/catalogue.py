"""Stars of the Hipparcos catalogue, out of the package cedar-solve (Apache-2.0), whose file is read without its code.

`fulmar install-stars` fetches the package: its own pins contradict those of this environment, so that it is no extra.
"""

from __future__ import annotations

import functools
import sys
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from fulmar_core.config.bounded_file import CATALOGUE_BYTES, load_arrays
from fulmar_core.config.errors import ConfigError

FILE = Path("tetra3/data/default_database.npz")
FOLDER = Path(sys.prefix) / "share" / "fulmar" / "stars"  # where `fulmar install-stars` puts it
FAINTEST = 8.0  # visual magnitude to which the file is complete


@dataclass(frozen=True)
class Stars:
    """Directions in the world, which is inertial, with brightness. Equinox 2000, proper motion to 2024."""

    directions: np.ndarray  # unit vectors, shape (n, 3)
    magnitudes: np.ndarray  # visual, brightest first, shape (n,)

    def __len__(self) -> int:
        return len(self.magnitudes)

    def brighter_than(self, magnitude: float) -> Stars:
        """Those of at most this visual magnitude."""
        count = int(np.searchsorted(self.magnitudes, magnitude, side="right"))
        return Stars(self.directions[:count], self.magnitudes[:count])


@functools.cache
def load_stars() -> Stars:
    """Read the catalogue.

    Raises:
        ConfigError: It is not installed.
    """
    path = catalogue_path()
    if path is None:
        raise ConfigError("the star catalogue is not installed. Run: fulmar install-stars")
    try:
        table = load_arrays(path, CATALOGUE_BYTES, names=["star_table"])["star_table"].astype(float)
    except (OSError, ValueError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}. Run: fulmar install-stars") from error
    # Columns: right ascension, declination, x, y, z, magnitude.
    order = np.argsort(table[:, 5], kind="stable")
    directions = table[order, 2:5]
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return Stars(directions, table[order, 5])


def catalogue_path() -> Path | None:
    """Where the catalogue lies; None where it is not installed."""
    if (FOLDER / FILE).is_file():
        return FOLDER / FILE
    package = find_spec("tetra3")
    for place in (package.submodule_search_locations or []) if package else []:
        if (Path(place) / "data" / FILE.name).is_file():
            return Path(place) / "data" / FILE.name
    return None
