"""An aircraft as a JSBSim model: coefficients, ground effect, propellers and body of a robot's file as XML functions.

JSBSim integrates; deflections [rad] and thrust levels come in as properties `fulmar/<actuator>`, since servos and
motors are those of Fulmar in every simulator. To them is added what JSBSim's own commands, trim and scripts ask for
(`fcs/elevator-cmd-norm` and its like, as a share of the limit; `fcs/throttle-cmd-norm`), which acts at once. Forces
are along JSBSim's body axes (x ahead, y right, z down) about the centre of mass. The planet of `STILL_PLANET` does not
turn, is a sphere, and has Fulmar's gravity.
"""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree as Xml

from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces
from fulmar_core.robots.airframe.airframe import SLOWEST, Airframe
from fulmar_core.robots.airframe.coefficients import NAMES, SURFACES, Coefficients, Curve, slopes_of
from fulmar_core.robots.airframe.ground_effect import HIGHEST, LOWEST
from fulmar_core.robots.airframe.propulsion import SLOWEST as SLOWEST_PISTON
from fulmar_core.robots.airframe.propulsion import ElectricMotor
from fulmar_core.robots.robot import Robot
from fulmar_core.states.gravity import GRAVITY

FOOT, POUND, SLUG_FT3 = 0.3048, 4.4482216152605, 515.378818393  # [m], [N], [kg/m³]
SLUG = POUND / FOOT  # [kg]
RADIUS_M = 6_378_137.0
ENGINE, THRUSTER = "fulmar_throttle", "direct"  # files of engines
# Which trim command belongs to a surface, and what JSBSim calls its positions, with their signs.
TRIM_OF = {"elevator": "pitch", "aileron": "roll", "rudder": "yaw"}
POSITIONS = {
    "elevator": (("elevator", 1.0),),
    "aileron": (("left-aileron", 1.0), ("right-aileron", -1.0)),
    "rudder": (("rudder", 1.0),),
}
Node = Xml.Element


def _node(tag: str, *children: Node, text: str = "", **attributes: str) -> Node:
    made = Xml.Element(tag, attributes)
    made.text = text or None
    made.extend(children)
    return made


def _value(number: float) -> Node:
    return _node("value", text=repr(float(number)))


def _get(name: str) -> Node:
    return _node("property", text=name)


def _times(*parts: Node) -> Node:
    return _node("product", *parts)


def _plus(*parts: Node) -> Node:
    return _node("sum", *parts) if len(parts) > 1 else parts[0]


def _function(name: str, body: Node) -> Node:
    return _node("function", body, name=name)


def aircraft_xml(robot: Robot) -> str:
    """The model of an aircraft; see `write_aircraft` for other robots."""
    frame, craft = robot.wings, robot.actuated_by(ControlSurfaces)
    root = _node("fdm_config", name=robot.name, version="2.0", release="BETA")
    about = f"{robot.title}; written by Fulmar from configs/robots/{robot.name}.yaml"
    root.append(_node("fileheader", _node("author", text="Fulmar"), _node("description", text=about)))
    metrics = _node("metrics")
    for tag, value, unit in (
        ("wingarea", frame.area, "M2"), ("wingspan", frame.span, "M"), ("chord", frame.chord, "M"),
        ("htailarea", 0.0, "M2"), ("htailarm", 0.0, "M"), ("vtailarea", 0.0, "M2"), ("vtailarm", 0.0, "M"),
    ):  # fmt: skip
        metrics.append(_node(tag, text=repr(float(value)), unit=unit))
    metrics.append(_place("AERORP"))
    root.append(metrics)
    xx, yy, zz, xy, xz, yz = robot.body.tensor
    # Fulmar's y points to the left and z up: products with x change their sign. JSBSim takes ∫ x z, not the entry.
    balance = _node("mass_balance", negated_crossproduct_inertia="false")
    for tag, value in (("ixx", xx), ("iyy", yy), ("izz", zz), ("ixy", xy), ("ixz", xz), ("iyz", -yz)):
        balance.append(_node(tag, text=repr(float(value)), unit="KG*M2"))
    balance.append(_node("emptywt", text=repr(float(robot.body.mass)), unit="KG"))
    balance.append(_place("CG"))
    root.append(balance)
    root.append(_node("ground_reactions"))
    root.append(_propulsion(craft))
    root.append(_flight_control(craft))
    root.append(_aerodynamics(frame, craft))
    Xml.indent(root)
    return '<?xml version="1.0"?>\n' + Xml.tostring(root, encoding="unicode") + "\n"


def _place(name: str) -> Node:
    return _node("location", *(_node(axis, text="0.0") for axis in "xyz"), name=name, unit="M")


def _propulsion(craft: ControlSurfaces) -> Node:
    """An engine without power for each motor, which gives JSBSim its throttle; thrust is among the forces."""
    out = _node("propulsion")
    for motor in craft.motors:
        ahead, left, up = motor.position
        # JSBSim's structural axes: x to the rear, y to the right, z up.
        places = zip("xyz", (-ahead, -left, up), strict=True)
        place = _node("location", *(_node(axis, text=repr(float(at))) for axis, at in places), unit="M")
        thruster = _node("thruster", place, file=THRUSTER)
        out.append(_node("engine", thruster, file=ENGINE))
    return out


def _flight_control(craft: ControlSurfaces) -> Node:
    """What is applied: what Fulmar sets, and what JSBSim's commands ask for beside it."""
    out = _node("flight_control", name="fulmar")
    for name in craft.names:
        out.append(_node("property", text=f"fulmar/{name}", value="0.0"))
    channel = _node("channel", name="surfaces")
    for surface in craft.surfaces:
        name, limit = surface.name, math.radians(surface.limit_deg)
        asked = _plus(_get(f"fcs/{name}-cmd-norm"), _get(f"fcs/{TRIM_OF[name]}-trim-cmd-norm"))
        by_command = _times(_value(limit), _node("max", _value(-1.0), _node("min", _value(1.0), asked)))
        channel.append(_applied(name, by_command))
        for place, sign in POSITIONS[name]:
            gain = _node("pure_gain", name=f"fulmar/{place}-position")
            gain.append(_node("input", text=f"fulmar/{name}-applied"))
            gain.append(_node("gain", text=repr(sign)))
            gain.append(_node("output", text=f"fcs/{place}-pos-rad"))
            channel.append(gain)
    for number, motor in enumerate(craft.motors):
        channel.append(_applied(motor.name, _get(f"fcs/throttle-pos-norm[{number}]")))
    out.append(channel)
    return out


def _applied(name: str, by_command: Node) -> Node:
    both = _node("function", _plus(_get(f"fulmar/{name}"), by_command))
    return _node("fcs_function", both, name=f"fulmar/{name}-applied")


def _aerodynamics(frame: Airframe, craft: ControlSurfaces) -> Node:
    out = _node("aerodynamics")
    speed = _times(_get("velocities/vt-fps"), _value(FOOT))
    slowest = _node("max", speed, _value(SLOWEST))
    half = _node("quotient", _value(0.5), slowest)
    out.append(_function("fulmar/half-per-speed", half))
    for name, source, length in (
        ("p", "velocities/p-aero-rad_sec", frame.span), ("q", "velocities/q-aero-rad_sec", frame.chord),
        ("r", "velocities/r-aero-rad_sec", frame.span), ("alphadot", "aero/alphadot-rad_sec", frame.chord),
    ):  # fmt: skip
        hat = _times(_get(source), _get("fulmar/half-per-speed"), _value(length))
        out.append(_function(f"fulmar/{name}-hat", hat))
    model = frame.aerodynamics
    per = math.degrees(1.0) if model.unit == "deg" else 1.0
    alpha = _plus(_times(_get("aero/alpha-rad"), _value(per)), _value(-model.alpha_zero))
    out.append(_function("fulmar/alpha-free", alpha))
    low, high = model.alpha_range or (-1e6, 1e6)
    within = _node(
        "min",
        _node("max", _get("fulmar/alpha-free"), _value(low - model.alpha_zero)),
        _value(high - model.alpha_zero),
    )
    out.append(_function("fulmar/alpha-within", within))
    beyond = _node("difference", _get("fulmar/alpha-free"), _get("fulmar/alpha-within"))
    out.append(_function("fulmar/alpha-beyond", beyond))
    out.append(_function("fulmar/beta-own", _times(_get("aero/beta-rad"), _value(per))))
    present = {surface.name for surface in craft.surfaces}
    for name in SURFACES:
        own = (
            [_times(_get(f"fulmar/{name}-applied"), _value(per * model.signs.get(name, 1.0)))]
            if name in present
            else []
        )
        shift = [_value(-model.elevator_zero)] if name == "elevator" else []
        out.append(_function(f"fulmar/{name}-own", _plus(*own, *shift) if own or shift else _value(0.0)))
    for name in NAMES:
        out.append(_function(f"fulmar/{name}-free", _coefficient(model, name)))
    _add_ground_effect(out, frame)
    _add_forces(out, frame, craft)
    return out


def _factor(name: str) -> Node:
    own = {"alpha": "fulmar/alpha-within", "beta": "fulmar/beta-own"}
    own |= {surface: f"fulmar/{surface}-own" for surface in SURFACES}
    return _get(own.get(name, f"fulmar/{name}-hat"))


def _coefficient(model: Coefficients, name: str) -> Node:
    parts = [_value(0.0)]
    for number, factors in model.parsed[name]:
        each = [_factor(factor) for factor, power in factors for _ in range(power)]
        parts.append(_times(_value(number), *each) if each else _value(number))
        for slope, rest in slopes_of(number, factors) if model.alpha_range is not None else ():
            each = [_factor(factor) for factor, power in rest for _ in range(power)]
            parts.append(_times(_value(slope), _get("fulmar/alpha-beyond"), *each))
    if name in model.tables:
        parts.append(_curve(model.tables[name], model.alpha_zero))
    return _plus(*parts)


def _curve(curve: Curve, zero: float) -> Node:
    """A sum of hinges, as `Curve.at`."""
    x, y = curve.alpha, curve.value
    slopes = [(y[i + 1] - y[i]) / (x[i + 1] - x[i]) for i in range(len(x) - 1)]
    alpha = "fulmar/alpha-free"
    parts = [_value(y[0] + slopes[0] * (zero - x[0])), _times(_value(slopes[0]), _get(alpha))]
    for corner, before, after in zip(x[1:-1], slopes, slopes[1:], strict=False):
        hinge = _node("max", _plus(_get(alpha), _value(zero - corner)), _value(0.0))
        parts.append(_times(_value(after - before), hinge))
    return _plus(*parts)


def _add_ground_effect(out: Node, frame: Airframe) -> None:
    """`near_ground` of `robots.airframe.ground_effect`, formula for formula."""
    effect = frame.ground_effect
    if effect is None:
        out.append(_function("fulmar/CL", _get("fulmar/CL-free")))
        out.append(_function("fulmar/CD", _get("fulmar/CD-free")))
        return
    a, t = frame.aspect_ratio, frame.taper
    height = _plus(_times(_get("position/h-agl-ft"), _value(FOOT)), _value(effect.wing_height))
    share = _node("quotient", height, _value(frame.span))
    out.append(
        _function("fulmar/height-share", _node("min", _node("max", share, _value(LOWEST)), _value(HIGHEST)))
    )
    h = _get("fulmar/height-share")
    lift = 1.0 - 2.25 * (t**0.00273 - 0.997) * (a**0.717 + 13.6)
    drag = 1.0 - 0.157 * (t**0.775 - 0.373) * (a**0.417 - 1.27)

    def power(exponent: float) -> Node:
        return _node("pow", h, _value(exponent))

    def fading(scale: float, exponent: float) -> Node:
        return _node("exp", _times(_value(-scale), power(exponent)))

    more = _plus(_value(1.0), _times(_value(lift * 288.0 / a**0.882), power(0.787), fading(9.14, 0.327)))
    out.append(_function("fulmar/lift-ratio", more))
    less = _plus(
        _value(1.0),
        _times(_value(-drag), fading(4.74, 0.814)),
        _times(_value(-1.0), h, h, fading(3.88, 0.758)),
    )
    out.append(_function("fulmar/drag-ratio", less))
    ratio = _get("fulmar/lift-ratio")
    out.append(_function("fulmar/CL", _times(_get("fulmar/CL-free"), ratio)))
    gone = _node("difference", _value(1.0), _times(_get("fulmar/drag-ratio"), ratio, ratio))
    lessened = [_get("fulmar/CD-free")]
    if effect.drag == "induced":
        free = _get("fulmar/CL-free")
        lessened = [free, free, _value(1.0 / (math.pi * a * effect.efficiency))]
    out.append(_function("fulmar/CD", _node("difference", _get("fulmar/CD-free"), _times(gone, *lessened))))


def _add_forces(out: Node, frame: Airframe, craft: ControlSurfaces) -> None:
    speed = _times(_get("velocities/vt-fps"), _value(FOOT))
    density = _times(_get("atmosphere/rho-slugs_ft3"), _value(SLUG_FT3))
    push = _times(_value(0.5 * frame.area), density, speed, speed)
    out.append(_function("fulmar/push", push))
    slip = {"standard": 1.0, "mirrored": -1.0, "stability": 0.0}[frame.wind_axes]
    for name, kind, angle, share in (
        ("ca", "cos", "alpha", 1.0),
        ("sa", "sin", "alpha", 1.0),
        ("cb", "cos", "beta", slip),
        ("sb", "sin", "beta", slip),
    ):
        turned = _node(kind, _times(_get(f"aero/{angle}-rad"), _value(share)))
        out.append(_function(f"fulmar/{name}", turned))
    ca, sa, cb, sb = (_get(f"fulmar/{name}") for name in ("ca", "sa", "cb", "sb"))
    lift, drag, side = _get("fulmar/CL"), _get("fulmar/CD"), _get("fulmar/CY-free")
    along = _plus(_times(_value(-1.0), drag, cb), _times(_value(-1.0), side, sb))
    out.append(_function("fulmar/along", along))
    ahead = _get("fulmar/along")
    force = {
        "X": _plus(_times(ahead, ca), _times(lift, sa)),
        "Y": _plus(_times(side, cb), _times(_value(-1.0), drag, sb)),
        "Z": _plus(_times(ahead, sa), _times(_value(-1.0), lift, ca)),
    }
    moment = {
        "ROLL": _times(_get("fulmar/Cl-free"), _value(frame.span)),
        "PITCH": _times(_get("fulmar/Cm-free"), _value(frame.chord)),
        "YAW": _times(_get("fulmar/Cn-free"), _value(frame.span)),
    }
    own: dict[str, list[Node]] = {axis: [] for axis in (*force, *moment)}
    for motor in craft.motors:
        level = _get(f"fulmar/{motor.name}-applied")
        engine, limit = motor.engine, _value(motor.engine.thrust)
        if isinstance(engine, ElectricMotor):
            more = _times(level, _node("difference", _value(engine.jet_speed), speed))
            whole = _times(
                _value(0.5 * engine.disc_area * engine.efficiency), density, _plus(speed, more), more
            )
            reaction = _times(
                _value(-motor.rotation * engine.torque_per_speed2 * engine.top_rate**2), level, level
            )
            own["ROLL"].append(reaction)
        else:
            slowest = _node("max", speed, _value(SLOWEST_PISTON))
            whole = _node("quotient", _times(level, _value(engine.power * engine.efficiency)), slowest)
        out.append(
            _function(f"fulmar/thrust-{motor.name}", _node("min", _node("max", whole, _value(0.0)), limit))
        )
        thrust = _get(f"fulmar/thrust-{motor.name}")
        _, left, up = motor.position
        own["X"].append(thrust)
        own["PITCH"].append(_times(_value(-up), thrust))  # a push above the centre of mass lowers the nose
        own["YAW"].append(_times(_value(left), thrust))  # one to the left turns the nose to the right
    for axis, body in {**force, **moment}.items():
        unit = POUND if axis in force else POUND * FOOT
        total = _plus(_times(_get("fulmar/push"), body), *own[axis])
        out.append(_node("axis", _function(f"fulmar/{axis}", _times(_value(1.0 / unit), total)), name=axis))


STILL_PLANET = f"""<?xml version="1.0"?>
<planet name="Still">
  <semimajor_axis unit="M">{RADIUS_M}</semimajor_axis>
  <semiminor_axis unit="M">{RADIUS_M}</semiminor_axis>
  <rotation_rate unit="RAD/SEC">0.0</rotation_rate>
  <GM unit="M3/SEC2">{GRAVITY * RADIUS_M**2!r}</GM>
  <J2>0.0</J2>
</planet>
"""


HEAD = '<?xml version="1.0"?>\n'
ENGINES = {
    ENGINE: f'{HEAD}<electric_engine name="{ENGINE}">\n  <power unit="WATTS">0.0</power>\n</electric_engine>\n',
    THRUSTER: f'{HEAD}<direct name="Direct"/>\n',
}


def write_aircraft(robot: Robot, folder: Path, *, engines: str = "") -> Path:
    """Write `<name>/<name>.xml` below a folder, and `still_planet.xml` into it.

    Args:
        robot: An aircraft.
        folder: JSBSim's path of aircraft.
        engines: Folder of the engines; empty: `Engines` of the model's own.

    Returns:
        The model.

    Raises:
        ConfigError: The robot is no aircraft.
    """
    from fulmar_core.config.errors import ConfigError

    if robot.airframe is None:
        raise ConfigError(f"'{robot.name}' is no aircraft, and JSBSim flies nothing else.")
    path = folder / robot.name / f"{robot.name}.xml"
    own = Path(engines) if engines else path.parent / "Engines"
    own.mkdir(parents=True, exist_ok=True)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(aircraft_xml(robot), encoding="utf-8")
    for name, text in ENGINES.items():
        (own / f"{name}.xml").write_text(text, encoding="utf-8")
    (folder / "still_planet.xml").write_text(STILL_PLANET, encoding="utf-8")
    return path
