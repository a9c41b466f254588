"""Bodies in space that reaction wheels turn, and nothing pushes."""

from __future__ import annotations

from fulmar_core.robots.kinds.kind import Kind
from fulmar_core.states.spatial import SpatialState

SATELLITE = Kind(
    name="satellite",
    plural="satellites that only turn",
    state_type=SpatialState,
    usual_robot="cubesat_wheels",
    usual_task="point",
    usual_estimator="attitude",
    far_goal=(0.0, 0.0, 0.0, 20.0, -30.0, 90.0),
    goal_forms=(("roll", "pitch", "yaw"),),
    start_forms=(("roll", "pitch", "yaw"),),
    goal_task="slew",
    usual_law="classical",
    recipe="free_flyer",
    always_estimated=True,
    goes_anywhere=False,
    weighs=False,
    drifts=True,
    axes=(3, 4, 5),
)
