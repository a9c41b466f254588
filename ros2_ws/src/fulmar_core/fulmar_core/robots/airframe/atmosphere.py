"""The air: density over altitude.

International Standard Atmosphere, troposphere (ISO 2533:1975): T = T0 − L h, ρ = ρ0 (T / T0)^(g / (R L) − 1).
"""

from __future__ import annotations

from fulmar_core.states.arrays import power
from fulmar_core.states.rotation import Array

SEA_LEVEL = 1.225  # density [kg/m³]
LAPSE = 0.0065 / 288.15  # of the temperature, as a share of that at sea level [1/m]
EXPONENT = 4.2558797  # g / (R L) − 1, with 9.80665 m/s², 287.05287 J/(kg·K) and 0.0065 K/m [-]
TOP = 11_000.0  # of the troposphere [m]


def air_density(altitude: Array | float) -> Array:
    """Density at an altitude above mean sea level, from below it up to `TOP` [kg/m³]."""
    return SEA_LEVEL * power(1.0 - LAPSE * altitude, EXPONENT)
