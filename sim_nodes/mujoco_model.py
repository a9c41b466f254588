"""MuJoCo's model of a robot, built from the robot's YAML so that no number is written twice."""

from __future__ import annotations

import mujoco

from fulmar_core.robot import Robot

BODY, IMU_SITE = "base_link", "imu_link"
GRAVITY = 9.81  # [m/s²]


def build_model(robot: Robot) -> mujoco.MjModel:
    """Compile a robot.

    A planar robot gets two slides and a hinge and stands on a floor under gravity, which holds it up but pushes
    nowhere; any other robot floats free without gravity. One actuator for each nozzle pushes at the nozzle's place
    along its direction, and takes newtons.

    Args:
        robot: The robot.

    Returns:
        The compiled model.
    """
    spec = mujoco.MjSpec()
    spec.modelname = robot.name
    spec.option.timestep = robot.timing.physics_dt
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    # A state that blew up has to stay so that the backend sees it; MuJoCo would quietly begin anew at the origin.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    spec.option.gravity = [0.0, 0.0, -GRAVITY if robot.body.planar else 0.0]
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1280, 960
    _add_surroundings(spec)
    body = _add_body(spec, robot)
    for nozzle in robot.actuators.nozzles:
        _add_nozzle(spec, body, nozzle.name, nozzle.position, nozzle.direction)
    _add_sensors(spec)
    return spec.compile()


def _add_surroundings(spec: mujoco.MjSpec) -> None:
    world = spec.worldbody
    world.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[10, 10, 0.1],
        rgba=[0.85, 0.87, 0.9, 1],
        contype=0,
        conaffinity=0,
    )
    world.add_light(name="sun", pos=[0, 0, 6], dir=[0, 0, -1])
    world.add_camera(name="above", pos=[0, 0, 9], fovy=50)


def _add_body(spec: mujoco.MjSpec, robot: Robot) -> mujoco.MjsBody:
    half = 0.5 * robot.body.height
    body = spec.worldbody.add_body(name=BODY, pos=[0.0, 0.0, half if robot.body.planar else 0.0])
    if robot.body.planar:
        body.add_joint(name="x", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[1, 0, 0])
        body.add_joint(name="y", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 1, 0])
        body.add_joint(name="yaw", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
    else:
        body.add_freejoint(name="free")
    body.explicitinertial = True
    body.ipos, body.iquat = (
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0, 0.0],
    )  # else MuJoCo takes the body's own place for it
    body.mass = robot.body.mass
    body.inertia = list(robot.body.inertia)
    # No contacts: the joints hold a planar body on its plane.
    body.add_geom(
        name="hull",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[robot.body.radius, half, 0.0],
        rgba=[0.25, 0.45, 0.7, 1],
        contype=0,
        conaffinity=0,
        mass=0.0,
    )
    body.add_site(name=IMU_SITE, pos=[0.0, 0.0, 0.0])
    return body


def _add_nozzle(
    spec: mujoco.MjSpec,
    body: mujoco.MjsBody,
    name: str,
    position: tuple[float, float, float],
    direction: tuple[float, float, float],
) -> None:
    length = sum(part * part for part in direction) ** 0.5
    body.add_site(name=name, pos=list(position), size=[0.02, 0.02, 0.02], rgba=[0.9, 0.4, 0.2, 1])
    spec.add_actuator(
        name=name,
        trntype=mujoco.mjtTrn.mjTRN_SITE,
        target=name,
        gear=[*(part / length for part in direction), 0.0, 0.0, 0.0],
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        biastype=mujoco.mjtBias.mjBIAS_NONE,
        dyntype=mujoco.mjtDyn.mjDYN_NONE,
    )


def _add_sensors(spec: mujoco.MjSpec) -> None:
    on_body = {"objtype": mujoco.mjtObj.mjOBJ_XBODY, "objname": BODY}
    on_site = {"objtype": mujoco.mjtObj.mjOBJ_SITE, "objname": IMU_SITE}
    spec.add_sensor(name="position", type=mujoco.mjtSensor.mjSENS_FRAMEPOS, **on_body)
    spec.add_sensor(name="attitude", type=mujoco.mjtSensor.mjSENS_FRAMEQUAT, **on_body)
    spec.add_sensor(name="velocity", type=mujoco.mjtSensor.mjSENS_FRAMELINVEL, **on_body)
    spec.add_sensor(name="gyroscope", type=mujoco.mjtSensor.mjSENS_GYRO, **on_site)
    spec.add_sensor(name="accelerometer", type=mujoco.mjtSensor.mjSENS_ACCELEROMETER, **on_site)
