"""Flies PyFly's Skywalker X8 through a step of its commands; prints turn rates, x ahead, y right, z down [rad/s].

Its one argument is a JSON file with `speed` [m/s], `pitch` [rad], `before` and `after` (elevator [rad], aileron [rad],
throttle) and `steps` of 0.01 s.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from pyfly.pyfly import PyFly


def main() -> None:
    """Print one JSON object."""
    asked = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    craft = PyFly()
    craft.seed(0)
    elevator, aileron, throttle = asked["before"]
    craft.reset(
        state={
            "roll": asked.get("roll", 0.0), "pitch": asked["pitch"], "yaw": 0.0, "Va": asked["speed"],
            "omega_p": 0.0, "omega_q": 0.0, "omega_r": 0.0,
            "velocity_u": asked["velocity"][0], "velocity_v": asked["velocity"][1], "velocity_w": asked["velocity"][2],
            "position_n": 0.0, "position_e": 0.0, "position_d": -100.0,
            "elevon_right": [elevator - aileron, 0.0], "elevon_left": [elevator + aileron, 0.0],
            "throttle": [throttle, 0.0], "wind_n": 0.0, "wind_e": 0.0, "wind_d": 0.0,
        }
    )  # fmt: skip
    rates = []
    for _ in range(asked["steps"]):
        flown, why = craft.step(asked["after"])
        if not flown:
            raise SystemExit(f"PyFly ended: {why}")
        rates.append([craft.state[name].value for name in ("omega_p", "omega_q", "omega_r")])
    json.dump({"rates": rates}, sys.stdout)


if __name__ == "__main__":
    main()
