"""Coefficients of an aircraft from its geometry: the states that the lattice is asked for, and what follows from them.

Derivatives are central differences about cruise; drag is a parabola over the angle of attack.
"""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.airframe.atmosphere import SEA_LEVEL
from fulmar_core.states.gravity import GRAVITY
from fulmar_evaluation.new_airframe.geometry import Geometry

SCRIPT = Path(__file__).with_name("vortex_lattice.py")
ALPHAS_DEG = (-3.0, -1.0, 1.0, 3.0, 5.0)  # over which lift, drag and pitching moment are fitted
STEP_DEG, STEP_RATE = 1.0, 0.02  # of angles [deg], and of dimensionless rates
LONGEST_S = 300.0  # of a run of the lattice [s]

Terms = dict[str, dict[str, float]]


def coefficient_set(geometry: Geometry, python: Path) -> Terms:
    """Terms of a robot's `aerodynamics`, angles in radians, in Fulmar's signs.

    Args:
        geometry: Of the aircraft.
        python: A Python that has OpenAeroStruct.

    Raises:
        ConfigError: There is no such Python, or the lattice fails.
    """
    sweep = _loads(geometry, python, [_state(geometry, alpha) for alpha in ALPHAS_DEG])
    alphas = np.deg2rad(ALPHAS_DEG)
    fits = {name: np.polynomial.polynomial.polyfit(alphas, sweep[name], 1) for name in ("CL", "Cm")}
    drag = np.polynomial.polynomial.polyfit(alphas, sweep["CD"], 2)
    wanted = geometry.mass * GRAVITY / (0.5 * SEA_LEVEL * geometry.speed**2 * geometry.wing.area)
    cruise = float(np.rad2deg((wanted - fits["CL"][0]) / fits["CL"][1]))
    moves = {
        "beta": {"beta": STEP_DEG}, "elevator": {"elevator": STEP_DEG}, "aileron": {"aileron": STEP_DEG},
        "rudder": {"rudder": STEP_DEG}, "p": {"p": STEP_RATE}, "q": {"q": STEP_RATE}, "r": {"r": STEP_RATE},
    }  # fmt: skip
    states = [
        _state(geometry, cruise, **{name: sign * size for name, size in move.items()})
        for move in moves.values()
        for sign in (1.0, -1.0)
    ]
    around = _loads(geometry, python, states)
    terms: Terms = {
        "CL": {"1": float(fits["CL"][0]), "alpha": float(fits["CL"][1])},
        "CD": {"1": float(drag[0]) + geometry.profile_drag, "alpha": float(drag[1]), "alpha^2": float(drag[2])},
        "Cm": {"1": float(fits["Cm"][0]), "alpha": float(fits["Cm"][1])},
        "CY": {}, "Cl": {}, "Cn": {},
    }  # fmt: skip
    for number, name in enumerate(moves):
        size = STEP_RATE if name in ("p", "q", "r") else np.deg2rad(STEP_DEG)
        for coefficient in ("CL", "Cm") if name in ("elevator", "q") else ("CY", "Cl", "Cn"):
            high, low = around[coefficient][2 * number : 2 * number + 2]
            terms[coefficient][name] = float((high - low) / (2.0 * size))
    return terms


def _state(
    geometry: Geometry,
    alpha: float,
    *,
    beta: float = 0.0,
    p: float = 0.0,
    q: float = 0.0,
    r: float = 0.0,
    **deflections: float,
) -> dict[str, Any]:
    """One question to the lattice: angles [deg], dimensionless rates as in `Coefficients`, deflections [deg]."""
    wing, twice = geometry.wing, 2.0 * geometry.speed
    rate = (p * twice / wing.span, q * twice / wing.mean_chord, r * twice / wing.span)
    meshes = geometry.meshes(**{name: float(np.deg2rad(value)) for name, value in deflections.items()})
    return {
        "alpha": alpha,
        "beta": beta,
        "rate": rate,
        "meshes": {name: mesh.tolist() for name, mesh in meshes.items()} if deflections else {},
    }


def _loads(geometry: Geometry, python: Path, states: list[dict[str, Any]]) -> dict[str, np.ndarray]:
    """Coefficients of some states, each of shape (states,)."""
    job = {
        "speed": geometry.speed,
        "density": SEA_LEVEL,
        "cg": [0.0, 0.0, 0.0],
        "surfaces": [{"name": name, "mesh": mesh.tolist()} for name, mesh in geometry.meshes().items()],
        "states": states,
    }
    found = _answered(python, json.dumps(job))
    forces, moments = (np.array([each[key] for each in found]) for key in ("force", "moment"))
    alpha, beta = (np.deg2rad([state[name] for state in states]) for name in ("alpha", "beta"))
    ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
    x, y, z = forces.T
    back = -x * ca - z * sa  # drag without sideslip
    wing = geometry.wing
    push = 0.5 * SEA_LEVEL * geometry.speed**2 * wing.area
    arms = push * np.array([wing.span, wing.mean_chord, wing.span])
    roll, pitch, yaw = (moments / arms).T
    return {
        "CL": (x * sa - z * ca) / push,
        "CD": (back * cb - y * sb) / push,
        "CY": (y * cb + back * sb) / push,
        "Cl": roll,
        "Cm": pitch,
        "Cn": yaw,
    }


def _answered(python: Path, job: str) -> list[dict[str, list[float]]]:
    """What the script makes of a job."""
    if not python.is_file():
        raise ConfigError(
            f"{python}: is missing. The vortex lattice is OpenAeroStruct's, in an environment of its own: make peers; "
            "or give --python, a Python that has openaerostruct."
        )
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    try:
        done = subprocess.run(
            [python, SCRIPT],
            input=job,
            env=environment,
            capture_output=True,
            text=True,
            timeout=LONGEST_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise ConfigError(f"{python}: the vortex lattice took more than {LONGEST_S:g} s.") from None
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["no words"])[-1]
        raise ConfigError(f"{python}: the vortex lattice failed: {last}")
    answer: list[dict[str, list[float]]] = json.loads(done.stdout)
    if not all(np.isfinite(each["force"] + each["moment"]).all() for each in answer):
        raise ConfigError("the vortex lattice has no finite answer. Do surfaces of the geometry touch?")
    return answer
