"""Forces and moments of lifting surfaces by OpenAeroStruct's vortex lattice, as one JSON object.

Runs by the Python of `.venv-peers`, and so imports nothing of Fulmar. It reads from standard input: `speed` [m/s],
`density` [kg/m³], `cg` (3,) [m], `surfaces`, each `{name, mesh}` with corners (rows from the leading to the trailing
edge, columns along the span, 3) [m], and `states`, each with `alpha` and `beta` [deg], `rate` (3,) [rad/s] and `meshes`
by name in the place of those of `surfaces`. It writes a force [N] and a moment about `cg` [N·m] for each state.

Axes of meshes: x aft, y right, z up. Forces, moments and rates: x ahead, y right, z down.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import numpy as np
import openmdao.api as om
from openaerostruct.aerodynamics.geometry import VLMGeometry
from openaerostruct.aerodynamics.states import VLMStates

AHEAD_DOWN = np.array([-1.0, 1.0, -1.0])  # between the two kinds of axes


class Lattice:
    """Lifting surfaces in one flow."""

    def __init__(self, job: dict[str, Any]) -> None:
        """Build the problem."""
        self._names = [each["name"] for each in job["surfaces"]]
        self._meshes = {each["name"]: np.array(each["mesh"]) for each in job["surfaces"]}
        self._cg = np.array(job["cg"])
        self._problem = om.Problem(reports=False)
        model, inputs = self._problem.model, om.IndepVarComp()
        for name, value, units in (
            ("v", job["speed"], "m/s"), ("rho", job["density"], "kg/m**3"), ("alpha", 0.0, "deg"),
            ("beta", 0.0, "deg"), ("cg", self._cg, "m"), ("omega", np.zeros(3), "rad/s"),
        ):  # fmt: skip
            inputs.add_output(name, val=value, units=units)
        for name, mesh in self._meshes.items():
            inputs.add_output(f"{name}_corners", val=mesh, units="m")
        model.add_subsystem("inputs", inputs, promotes=["*"])
        surfaces = [
            {"name": name, "symmetry": False, "S_ref_type": "wetted", "mesh": mesh, "groundplane": False}
            for name, mesh in self._meshes.items()
        ]
        for surface in surfaces:
            model.add_subsystem(surface["name"], VLMGeometry(surface=surface))
        flow = ["v", "rho", "alpha", "beta", "cg", "omega"]
        model.add_subsystem("flow", VLMStates(surfaces=surfaces, rotational=True), promotes_inputs=flow)
        for name in self._names:
            model.connect(f"{name}_corners", [f"{name}.def_mesh", f"flow.{name}_def_mesh"])
            model.connect(f"{name}.normals", f"flow.{name}_normals")
        self._problem.setup()

    def loads(self, state: dict[str, Any]) -> dict[str, list[float]]:
        """Force and moment of one state."""
        problem = self._problem
        problem["alpha"], problem["beta"] = state["alpha"], state["beta"]
        # Its `omega` is how the air turns about the craft.
        problem["omega"] = -AHEAD_DOWN * np.array(state["rate"])
        force, moment = np.zeros(3), np.zeros(3)
        meshes = {name: np.array(state["meshes"].get(name, self._meshes[name])) for name in self._names}
        for name, mesh in meshes.items():
            problem[f"{name}_corners"] = mesh
        problem.run_model()
        for name, mesh in meshes.items():
            pushes = np.array(problem[f"flow.{name}_sec_forces"])
            quarter = 0.75 * mesh[:-1] + 0.25 * mesh[1:]
            places = 0.5 * (quarter[:, :-1] + quarter[:, 1:])
            force += pushes.sum(axis=(0, 1))
            moment += np.cross(places - self._cg, pushes).sum(axis=(0, 1))
        return {"force": (AHEAD_DOWN * force).tolist(), "moment": (AHEAD_DOWN * moment).tolist()}


def main() -> None:
    """Answer one job."""
    job = json.load(sys.stdin)
    lattice = Lattice(job)
    json.dump([lattice.loads(state) for state in job["states"]], sys.stdout)


if __name__ == "__main__":
    main()
