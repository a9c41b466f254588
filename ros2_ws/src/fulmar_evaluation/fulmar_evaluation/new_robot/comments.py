"""What stands beside each key of a new robot's file: its unit, where its value is from, and what measures it."""

from __future__ import annotations

from collections.abc import Mapping

from fulmar_core.config.plausible_ranges import RELATIONS, ROBOT
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.camera import RANGES as CAMERA_RANGES
from fulmar_core.robots.sensors.table import RANGES

# Keys, and what to do about them; a key that ends in `*` stands for all that begin so.
HOW = {
    "body": "of all that moves along, wheels, batteries and a full tank with it",
    "body.mass": "weigh it",
    "body.inertia": "about the centre of mass: xx, yy, zz, in space also xy, xz, yz",
    "body.radius": "circle around all that sticks out, seen from above",
    "body.height": "measure it",
    "body.footprint": "length, width of a box around it; without, a disc of `radius`",
    "body.center_of_mass": "ahead of the origin, to its left, in space above",
    "body.planar": "true: on a floor; false: on water, in space, in the air",
    "uncertainty": "what training draws from: the spans that you do not know better",
    "timing.physics_dt": "step of the simulators",
    "timing.control_hz": "as often as your device takes commands",
    "actuators.thrust": "of one at full command: a load cell",
    "actuators.nozzles": "place [m] and direction of the force on the body; `fulmar commission` finds the wires",
    "actuators.fans": "place [m] and direction of the force on the body; `fulmar commission` finds the wires",
    "actuators.propellers": "place [m]; `fulmar commission` finds the wires",
    "actuators.wheels": "axis of each; positive speeds are counterclockwise about it",
    "actuators.curve": "thrust at even commands from -1 to 1: pull at a bollard with a load cell",
    "actuators.shared_pressure": "true: n open valves give 1/n of the thrust each",
    "actuators.wheel_radius": "under load",
    "actuators.track": "between the contact points of left and right wheels",
    "actuators.wheelbase": "between the axles",
    "actuators.caster_x": "ahead of the axle; negative: behind alone",
    "actuators.max_*": "data sheet, or what it reaches",
    "actuators.wheel_force": "torque of the motor over the wheel's radius",
    "actuators.friction": "of the tyres on your floor",
    "actuators.response": "how fast actuators follow: slew, lag, delay",
    "actuators.torque": "data sheet",
    "actuators.spin_inertia": "data sheet",
    "actuators.top_speed": "data sheet",
    "actuators.tank": "bottle and regulator; leave it out without a bottle",
    "hydrodynamics": "surge, sway, heave, roll, pitch, yaw",
    "hydrodynamics.hydrostatics": "draught is mass / (water_density · waterplane_area)",
    "performance": "the most that it can; `fulmar check robot` compares it with the actuators",
    "costs": "of using actuators, for a learner",
    "sensors": "noise of your own: data sheets, or a recording at rest",
    "limits": "what is possible, not what is usual: beyond it the safe command is sent",
    "limits.geofence": "from the goal",
    "air_bearing": "true: it stands until `air_bearing/enable` lets air flow",
    "airframe": "coefficients: `fulmar new airframe` computes them from a geometry",
    "look": "what people see: no mass, no contact; docs/robots.md",
}
# Quantities that identification measures, and the keys of them.
IDENTIFIED = {
    "mass": "body.mass",
    "yaw_inertia": "body.inertia",
    "center_of_mass_x": "body.center_of_mass",
    "thrust": "actuators.thrust",
    "wheel_scale": "actuators.wheel_radius",
    "turn_scale": "actuators.track",
    "lag": "actuators.response.lag_s",
    "delay": "actuators.response.delay_s",
}
SPANS = {"uncertainty.mass": "kg", "uncertainty.yaw_inertia": "kg·m²"}
PLAIN_UNITS = ("of 1", "times")


class Comments:
    """Comments by dotted key."""

    def __init__(self, robot: Robot, origins: Mapping[str, str]) -> None:
        """Take a robot as read, and where its values are from, by dotted key; of a whole part too."""
        self.origins = origins
        rows = (*robot.actuators.ranges(robot), *ROBOT, *RELATIONS, *RANGES, *CAMERA_RANGES)
        self.units = SPANS | {
            _head(row.key): row.unit for row in reversed(rows) if row.unit not in PLAIN_UNITS
        }
        self.identified = {
            key
            for name, key in IDENTIFIED.items()
            if name in (*robot.kind.calibrated, *robot.actuators.calibrated)
        }

    def __call__(self, key: str) -> str:
        """Unit, origin and what to do, with commas between them."""
        how = HOW.get(key) or next(
            (text for each, text in HOW.items() if each.endswith("*") and key.startswith(each[:-1])), ""
        )
        measured = "`fulmar identify` measures it" if key in self.identified else ""
        first = ", ".join(filter(None, (self.units.get(key, ""), self.origins.get(key, ""))))
        return "; ".join(filter(None, (first, how, measured)))


def _head(key: str) -> str:
    """A key without the numbers of its list."""
    words = key.split(".")
    while words and (words[-1] == "*" or words[-1].isdecimal()):
        words.pop()
    return ".".join(words)
