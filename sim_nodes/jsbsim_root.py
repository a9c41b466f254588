"""An aircraft as users of JSBSim alone take it: a root folder with a model, engines, a start and a script."""

from __future__ import annotations

from pathlib import Path

from fulmar_core.robots.robot import Robot
from sim_nodes.jsbsim_model import write_aircraft

CRUISE_M = 100.0  # height above the sea that a written flight begins at [m]
KNOT = 1852.0 / 3600.0  # [m/s]


def cruise_xml(robot: Robot, height: float) -> str:
    """Where a flight of JSBSim's begins: at the robot's cruising speed, so high above the sea [m]."""
    return f"""<?xml version="1.0"?>
<initialize name="cruise">
  <vt unit="KTS">{robot.wings.speed / KNOT!r}</vt>
  <psi unit="DEG">90.0</psi>
  <gamma unit="DEG">0.0</gamma>
  <altitude unit="M">{height!r}</altitude>
  <running>-1</running>
</initialize>
"""


def script_xml(robot: Robot) -> str:
    """A script of JSBSim's that trims the craft and gives its elevator a pulse."""
    return f"""<?xml version="1.0"?>
<runscript name="{robot.name}: trim, then a pulse of the elevator">
  <use aircraft="{robot.name}" initialize="cruise"/>
  <run start="0.0" end="10.0" dt="0.0025">
    <event name="trim">
      <condition>simulation/sim-time-sec ge 0.0</condition>
      <set name="simulation/do_simple_trim" value="{1 if "rudder" in robot.actuators.names else 0}"/>
    </event>
    <event name="pulse">
      <condition>simulation/sim-time-sec ge 1.0</condition>
      <set name="fcs/elevator-cmd-norm" value="-0.05" type="FG_DELTA"/>
    </event>
    <event name="back">
      <condition>simulation/sim-time-sec ge 1.5</condition>
      <set name="fcs/elevator-cmd-norm" value="0.05" type="FG_DELTA"/>
    </event>
  </run>
</runscript>
"""


def write_root(robot: Robot, root: Path) -> Path:
    """Write what `JSBSim --root` needs to trim and fly an aircraft; arguments, result and errors as `write_aircraft`.

    `aircraft/<name>` has the model and where it begins (`cruise.xml`), `engine` its engines, `scripts/<name>.xml` a
    flight, and `still_planet.xml` is the planet that the model was compared on.
    """
    path = write_aircraft(robot, root / "aircraft", engines=str(root / "engine"))
    (root / "aircraft" / "still_planet.xml").replace(root / "still_planet.xml")
    (path.parent / "cruise.xml").write_text(cruise_xml(robot, CRUISE_M), encoding="utf-8")
    for name in ("systems", "scripts"):
        (root / name).mkdir(exist_ok=True)
    (root / "scripts" / f"{robot.name}.xml").write_text(script_xml(robot), encoding="utf-8")
    return path
