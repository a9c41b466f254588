"""Lift and induced drag of airship_v7's wing near the ground, by OpenAeroStruct's vortex lattice, as one JSON object.

It made tests/fulmar_core/dynamics/ground_effect.json:

    .venv-peers/bin/python tests/peers/ground_effect_table.py > tests/fulmar_core/dynamics/ground_effect.json
"""

from __future__ import annotations

import json
import sys

import numpy as np
import openmdao.api as om
from openaerostruct.aerodynamics.aero_groups import AeroPoint
from openaerostruct.geometry.geometry_group import Geometry
from openaerostruct.meshing.mesh_generator import generate_mesh

SPAN, AREA, TAPER, ALPHA_DEG, SPEED = 5.0, 3.32, 0.39, 5.0, 28.0
HEIGHTS = (0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.75, 1.0, 1.5, 2.0)  # of the quarter chord over the span
FREE = 1e4  # spans that stand for free air


def wing() -> dict:
    """Half of a plane trapezoid with a straight quarter chord line."""
    mesh = generate_mesh(
        {
            "num_y": 41, "num_x": 5, "wing_type": "rect", "symmetry": True, "span": SPAN, "root_chord": 1.0,
            "span_cos_spacing": 0.5, "chord_cos_spacing": 0.0,
        }
    )  # fmt: skip
    root = 2.0 * AREA / (SPAN * (1.0 + TAPER))
    for j in range(mesh.shape[1]):
        share = abs(mesh[0, j, 1]) / (0.5 * SPAN)
        chord = root * (1.0 - (1.0 - TAPER) * share)
        mesh[:, j, 0] = (mesh[:, j, 0] - 0.25) * chord
    return {
        "name": "wing", "symmetry": True, "S_ref_type": "wetted", "mesh": mesh, "CL0": 0.0, "CD0": 0.0,
        "k_lam": 0.05, "t_over_c_cp": np.array([0.12]), "c_max_t": 0.303, "with_viscous": False, "with_wave": False,
        "groundplane": True,
    }  # fmt: skip


def coefficients(surface: dict, height: float) -> tuple[float, float]:
    """C_L and C_Di at a height of the wing [m]."""
    problem = om.Problem(reports=False)
    inputs = om.IndepVarComp()
    for name, value, units in (
        ("v", SPEED, "m/s"), ("alpha", ALPHA_DEG, "deg"), ("beta", 0.0, "deg"), ("Mach_number", 0.0, None),
        ("re", 1e6, "1/m"), ("rho", 1.225, "kg/m**3"), ("cg", np.zeros(3), "m"), ("height_agl", height, "m"),
    ):  # fmt: skip
        inputs.add_output(name, val=value, units=units)
    problem.model.add_subsystem("inputs", inputs, promotes=["*"])
    problem.model.add_subsystem("wing", Geometry(surface=surface))
    promoted = ["v", "alpha", "beta", "Mach_number", "re", "rho", "cg", "height_agl"]
    problem.model.add_subsystem("point", AeroPoint(surfaces=[surface]), promotes_inputs=promoted)
    problem.model.connect("wing.mesh", "point.wing.def_mesh")
    problem.model.connect("wing.mesh", "point.aero_states.wing_def_mesh")
    problem.model.connect("wing.t_over_c", "point.wing_perf.t_over_c")
    problem.setup()
    problem.run_model()
    return float(problem["point.wing_perf.CL"][0]), float(problem["point.wing_perf.CD"][0])


def main() -> None:
    """Print ratios to free air: of the lift, and of C_Di / C_L²."""
    surface = wing()
    free_lift, free_drag = coefficients(surface, FREE * SPAN)
    rows = []
    for share in HEIGHTS:
        lift, drag = coefficients(surface, share * SPAN)
        rows.append([share, lift / free_lift, drag / lift**2 / (free_drag / free_lift**2)])
    table = {
        "peer": "openaerostruct 2.12.0", "command": "tests/peers/ground_effect_table.py",
        "aspect_ratio": SPAN**2 / AREA, "taper": TAPER, "alpha_deg": ALPHA_DEG,
        "free": {"CL": free_lift, "CDi": free_drag},
        "columns": ["height over span", "lift ratio", "induced drag ratio"], "rows": rows,
    }  # fmt: skip
    sys.stdout.write(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main()
