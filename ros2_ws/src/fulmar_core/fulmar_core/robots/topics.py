"""The wires: every topic, its type, who publishes it, how, how fast, and whether bags keep it.

Read by every node, the recorder, the health checks and the documentation. Names are relative and live under the
robot's namespace, except those that begin with a slash.
"""

from __future__ import annotations

from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.table import SENSORS
from fulmar_core.wires.wire import Delivery as Delivery
from fulmar_core.wires.wire import Source as Source
from fulmar_core.wires.wire import Wire as Wire

# Services, all of std_srvs/Trigger.
ESTOP_TRIGGER, ESTOP_RESET, GIVE_BACK = "estop/trigger", "estop/reset", "teleop/give_back"
SIMULATION_STEP = "simulation/step"
SIMULATION_PAUSE = "simulation/pause"  # the service that takes a value: std_srvs/SetBool

# Where the clock of a simulation begins [ns]; ROS takes 0 for "not set".
SIMULATION_START_NS = 1_000_000_000

# Shares of full command, or m/s, rad/s and rad: by the kind of actuator, as docs/topics.md lists them.
EFFORT_UNIT = "of each actuator, see above"

SENSOR_WIRES: dict[str, Wire] = {name: kind.wire for name, kind in SENSORS.items()}
ODOMETRY, IMU = SENSOR_WIRES["odometry"], SENSOR_WIRES["imu"]
MOCAP = Wire(
    "mocap/pose", "geometry_msgs/msg/PoseStamped", "plant", "best_effort",
    "every capture, where an estimator runs or `mocap_hz` is set",
    "pose as motion capture reports it, Z up, stamped at capture or a constant time after", unit="m",
    frame="`odom`, `map` or `world`",
)  # fmt: skip
TRUTH = Wire(
    "ground_truth/odom", "nav_msgs/msg/Odometry", "plant", "stream", "every plant tick",
    "true state of the simulator; never read by a deployed controller", unit="m, m/s, rad/s",
    frame="`map`, with an origin `odom`; twist in `base_link`",
)  # fmt: skip
ACTUATORS_STATE = Wire(
    "actuators/state", "sensor_msgs/msg/JointState", "plant", "stream", "every plant tick",
    "command that was applied, after limits and watchdog; `effort` by actuator name", unit=EFFORT_UNIT,
)  # fmt: skip
ACTUATORS_HEALTH = Wire(
    "actuators/health", "sensor_msgs/msg/JointState", "controller", "stream",
    "control rate, from a controller that estimates it",
    "the controller's estimate of each valve's thrust; `effort` by actuator name",
    unit="share of nominal thrust, 0 to 1",
)  # fmt: skip
CLOCK = Wire(
    "/clock", "rosgraph_msgs/msg/Clock", "plant", "best_effort", "every plant tick, at most 200 Hz",
    "simulated time", unit="s, ns",
)  # fmt: skip
INERTIA = Wire(
    "inertia", "geometry_msgs/msg/InertiaStamped", "estimator", "stream", "1 Hz, where an inertia estimator runs",
    "estimated mass properties of a satellite about its centre of mass, as far as a body can have them",
    unit="kg·m²", frame="`base_link`",
)  # fmt: skip
INERTIA_COVARIANCE = Wire(
    "inertia/covariance", "std_msgs/msg/Float64MultiArray", "estimator", "stream", "with each `inertia`",
    "its covariance, 6 × 6 by rows, of xx, yy, zz, xy, xz, yz", unit="kg²·m⁴",
)  # fmt: skip
INERTIA_STATUS = Wire(
    "inertia/status", "diagnostic_msgs/msg/DiagnosticArray", "estimator", "stream", "1 Hz",
    "excitation of each axis, what cannot be observed yet, and why there is no estimate",
)  # fmt: skip
EVENTS, EVENTS_2 = (
    Wire(
        topic, "sensor_msgs/msg/PointCloud2", "camera", "stream",
        "packets, where an event camera runs; 1 to 5 MB/s, not recorded",
        f"events of the {which} camera: `x`, `y` uint16, `t` uint64, `p` uint8 (1: brighter)", unit="px, ns",
        frame=f"`{frame}`", recorded=False,
    )
    for topic, which, frame in (("events", "first", "event_camera"), ("events_2", "second", "event_camera_2"))
)  # fmt: skip
CAMERA_INFO = Wire(
    "camera/camera_info", "sensor_msgs/msg/CameraInfo", "camera", "stream", "with each image, where a camera runs",
    "intrinsics of the camera's images, stamped as they", unit="px", frame="`camera_optical_frame`",
)  # fmt: skip
CAMERA_IMAGE, CAMERA_DEPTH, CAMERA_SEGMENTATION = CAMERA_IMAGES = tuple(
    Wire(
        topic, "sensor_msgs/msg/Image", "camera", "stream",
        "`rate_hz` of the robot's camera, where one runs; bags have it compressed",
        content, unit=unit, frame="`camera_optical_frame`", recorded=False,
    )
    for topic, content, unit in (
        ("camera/image_raw", "`rgb8`: what the camera sees, stamped as the state that it sees it from", "0 to 255"),
        ("camera/depth/image_raw", "`32FC1`: depth along the optical axis, infinity where nothing is", "m"),
        ("camera/segmentation/image_raw", "`16UC1`: semantic id of what each pixel shows, 0 for none", "none"),
    )
)  # fmt: skip
# What a recorder makes of each of `CAMERA_IMAGES`; of depth two, since RViz reads the one and Foxglove the other.
IMAGE_JPEG, DEPTH_FLOAT, DEPTH_PNG, IDS_PNG = CAMERA_COMPRESSED = tuple(
    Wire(
        f"{image.name}/{ending}", "sensor_msgs/msg/CompressedImage", "camera", "stream", "with each image, in bags",
        f"the same as `{image.name}`; `format` is `{form}`{more}", unit=unit, frame=image.frame,
    )
    for image, ending, form, more, unit in (
        (CAMERA_IMAGE, "compressed", "rgb8; jpeg compressed bgr8", "", CAMERA_IMAGE.unit),
        (CAMERA_DEPTH, "compressedDepth", "32FC1; compressedDepth png", ", to 100 m", CAMERA_DEPTH.unit),
        (CAMERA_DEPTH, "compressed", "16UC1; png compressed", ", to 65.5 m", "mm"),
        (CAMERA_SEGMENTATION, "compressed", "mono16; png compressed", "", CAMERA_SEGMENTATION.unit),
    )
)  # fmt: skip
RATE = Wire(
    "rate", "geometry_msgs/msg/TwistWithCovarianceStamped", "estimator", "stream",
    "each window of events, where a rate estimator runs",
    "turn rate from events, `twist.angular`, with its covariance", unit="rad/s", frame="`base_link`",
)  # fmt: skip
RATE_STATUS = Wire(
    "rate/status", "diagnostic_msgs/msg/DiagnosticArray", "estimator", "stream", "1 Hz",
    "stars in view, what is not observable, an upper bound at rest, and why there is no rate",
)  # fmt: skip
COMMAND = Wire(
    "actuators/command", "sensor_msgs/msg/JointState", "controller", "stream", "control rate",
    "`effort` by actuator name, stamped as the observation it answers", unit=EFFORT_UNIT,
)  # fmt: skip
OBSERVATION = Wire(
    "controller/observation", "sensor_msgs/msg/JointState", "controller", "stream", "control rate",
    "input vector of the controller; names are its terms",
    unit="of each term, see [observations.md](observations.md)", frame="of each term",
)  # fmt: skip
BELIEVED = Wire(
    "controller/believed", "nav_msgs/msg/Odometry", "controller", "stream",
    "control rate, from a controller with an observer",
    "state that the controller acts on, where that is not the measured one, stamped as that", unit="m, m/s, rad/s",
    frame="`odom`; twist in `base_link`",
)  # fmt: skip
ACTION = Wire(
    "controller/action", "sensor_msgs/msg/JointState", "controller", "stream", "control rate",
    "output vector of the controller, before limits", unit=EFFORT_UNIT,
)  # fmt: skip
METADATA = Wire(
    "controller/metadata", "std_msgs/msg/String", "controller", "latched", "at load",
    "JSON: name of the controller and SHA-256 of its definition",
)  # fmt: skip
STATUS = Wire(
    "controller/status", "diagnostic_msgs/msg/DiagnosticArray", "controller", "latched",
    "on change and at least 2 Hz",
    "mode, reason, ages, latencies, overruns, rejections", unit="in the name of each value",
)  # fmt: skip
ENVELOPE_STATE = Wire(
    "envelope/state", "diagnostic_msgs/msg/DiagnosticArray", "controller", "latched",
    "once each time the envelope guard takes over from a controller or gives back, stamped as the observation",
    "margin, side, intervention and cause; the command that was refused and the one that was sent", latest=100,
    unit="m; commands as in `actuators/command`",
)  # fmt: skip
DIAGNOSTICS = Wire(
    "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", "every node", "stream",
    "on change and at least 1 Hz",
    "health of each node: `<robot>: plant`, `<robot>: controller`, `<robot>: recorder`",
)  # fmt: skip
GOAL_POSE = Wire(
    "goal_pose", "geometry_msgs/msg/PoseStamped", "operator", "latched", "on demand",
    "goal with heading, as RViz's 2D Goal Pose publishes it", unit="m", frame="`odom`",
)  # fmt: skip
GOAL_POINT = Wire(
    "goal_point", "geometry_msgs/msg/PointStamped", "operator", "latched", "on demand",
    "goal without heading", unit="m", frame="`odom`",
)  # fmt: skip
GOAL_PATH = Wire(
    "goal_path", "nav_msgs/msg/Path", "operator", "latched", "on demand",
    "waypoints in order, repeated from the first after the last", unit="m", frame="`odom`",
)  # fmt: skip
GOAL_POSES = Wire(
    "goal_poses", "geometry_msgs/msg/PoseArray", "operator", "latched", "on demand",
    "the same as `goal_path`, for publishers of PoseArray", unit="m", frame="`odom`",
)  # fmt: skip
GOAL_VELOCITY = Wire(
    "goal_velocity", "geometry_msgs/msg/TwistStamped", "operator", "latched", "on demand",
    "velocity and turn rate to track until the next one; a stamp in the future says when it begins", latest=100,
    unit="m/s, rad/s", frame="`base_link`",
)  # fmt: skip
OBSTACLES = Wire(
    "obstacles", "visualization_msgs/msg/MarkerArray", "operator", "latched", "on demand",
    "cylinders to avoid; `scale.x` is the diameter", unit="m", frame="`odom`",
)  # fmt: skip
MARKERS = Wire(
    "markers", "visualization_msgs/msg/MarkerArray", "display", "latched", "on change, at most 10 Hz",
    "what viewers draw: goal, path, tolerance, geofence, area, obstacles, thrust, body; each message is complete",
    unit="m", frame="`odom`, `base_link`",
)  # fmt: skip

BROADCAST_NAMES = Wire(
    "broadcast/names", "control_msgs/msg/Keys", "display", "latched", "on change, with `--broadcast`",
    "names of `broadcast/values`: `observation/TERM` and `action/ACTUATOR`, as of the controller", recorded=False,
)  # fmt: skip
BROADCAST_VALUES = Wire(
    "broadcast/values", "control_msgs/msg/Float64Values", "display", "stream", "control rate, with `--broadcast`",
    "input and output vector of one control step of the controller, stamped as the observation", recorded=False,
    unit="of each name, see `controller/observation` and `controller/action`",
)  # fmt: skip


def thing_wire(name: str) -> Wire:
    """Where the pose of a thing of a task's world is published; see `fulmar_core.dynamics.things`."""
    return Wire(
        f"{name}/pose",
        "geometry_msgs/msg/PoseStamped",
        "plant",
        "stream",
        f"with each odometry, where there is a {name}",
        f"pose of the {name}, stamped as the odometry",
        unit="m",
        frame="`odom`",
    )


BLOCK = thing_wire("block")
AIR_BEARING = Wire(
    "air_bearing/state", "std_msgs/msg/Bool", "plant", "latched",
    "on change and at 1 Hz, where there is an air bearing",
    "whether air flows through the bearing; the service `air_bearing/enable` switches it",
)  # fmt: skip
DEVICE_STATE = Wire(
    "emulator/actuators", "sensor_msgs/msg/JointState", "plant", "stream",
    "every physics step of an emulated device",
    "actuator state inside an emulated device, also after its driver died; `effort` by actuator name",
    unit=EFFORT_UNIT,
)  # fmt: skip
ESTOP = Wire(
    "estop", "std_msgs/msg/Bool", "operator", "latched", "10 Hz, where there is one",
    "true, once and from any publisher, stops the robot until a reset; so does the silence of an e-stop node",
)  # fmt: skip
FLEET_ESTOP = Wire(
    "/fleet/estop", "std_msgs/msg/Bool", "operator", "latched", "on demand, where robots are a fleet",
    "true, once and from any publisher, stops every robot of the fleet until each is reset",
)  # fmt: skip
FLEET_STATUS = Wire(
    "/fleet/status", "std_msgs/msg/String", "plant", "stream", "2 Hz, where robots are a fleet",
    "JSON: `time_s`, and `robots` by name with `mode`, `message`, `controller`, `goal_distance_m` and `estop`",
    unit="m, s",
)  # fmt: skip
NEIGHBOURS = Wire(
    "neighbours", "sensor_msgs/msg/JointState", "plant", "stream",
    "with each `odom`, for robots of a fleet that keep apart",
    "where the other robots are: `name` is `ROBOT/x`, `ROBOT/y`, with `position` and `velocity` of each; `effort` 1 "
    "where its controller drives it, else 0",
    unit="m, m/s", frame="`map`",
)  # fmt: skip
ESTOP_RELEASED = Wire(
    "estop/released", "std_msgs/msg/String", "operator", "stream", "once per reset",
    "name of the node that reset the e-stop",
)  # fmt: skip
OPERATOR_ACTION = Wire(
    "operator/action", "std_msgs/msg/String", "operator", "latched", "before each press of the e-stop and each goal",
    "JSON: `by`, `does` (`estop` or `goal`) and `stamp_ns` of the goal, from programs that say who they are", latest=10,
)  # fmt: skip
TELEOP = Wire(
    "teleop/command", "sensor_msgs/msg/JointState", "operator", "stream", "20 Hz while a person drives",
    "a person's command, `effort` by actuator name; overrides the controller until control is given back",
    unit=EFFORT_UNIT,
)  # fmt: skip
JOY = Wire(
    "joy", "sensor_msgs/msg/Joy", "operator", "stream", "10 Hz and more, where there is a gamepad",
    "axes and buttons of a gamepad, for teleoperation", unit="-1 to 1",
)  # fmt: skip
SWAP = Wire(
    "controller/swap", "std_msgs/msg/String", "operator", "stream", "on demand",
    "JSON: `id`, `controller` (a name of `robot_info`) or `bundle` (a folder), `by`; or the folder of a policy bundle",
)  # fmt: skip
SWAP_RESULT = Wire(
    "controller/swap/result", "std_msgs/msg/String", "controller", "latched", "for each request",
    "JSON: `id`, `accepted`, `reason`, `stamp_ns` of the first measurement that the new controller answers, `sha256`",
)  # fmt: skip
SIMULATION_RATE = Wire(
    "simulation/rate", "std_msgs/msg/String", "operator", "stream", "on demand, of simulated plants",
    "JSON: `id`, `by`, `rate` in simulated seconds a wall-clock second",
)  # fmt: skip
SIMULATION_DISTURB = Wire(
    "simulation/disturb", "std_msgs/msg/String", "operator", "stream", "on demand, of simulated plants",
    "JSON: `id`, `by`, `what` of `robot_info`'s disturbances, and its fields",
)  # fmt: skip
SIMULATION_STATE = Wire(
    "simulation/state", "std_msgs/msg/String", "operator", "stream", "on demand, of simulated plants",
    "JSON: `id`, `by`, `what`: `pause`, `resume`, `step` with `steps`, `reset`, or `place` with `position_m`, "
    "`quat_xyzw`, `velocity_m_s` and `rate_rad_s`",
    unit="in the names of keys", frame="`odom`; the rate in `base_link`",
)  # fmt: skip
SIMULATION_RESULT = Wire(
    "simulation/result", "std_msgs/msg/String", "plant", "stream", "once per request",
    "JSON: `id` of the request, `accepted`, `reason`; of `simulation/state` also `stamp_ns` and the state",
)  # fmt: skip
SIMULATION_EVENT = Wire(
    "simulation/event", "std_msgs/msg/String", "plant", "latched", "once per change of a simulation while it runs",
    "JSON: `stamp_ns` of the first step that it acts on, `what`, its fields, `by`", latest=100,
)  # fmt: skip
RELAY = Wire(
    "relay", "std_msgs/msg/UInt8MultiArray", "every node", "stream", "with the first messages of a publisher",
    "a goal, an obstacle or a press of the e-stop that a node received, for those not found by its publisher yet: "
    "`layout.dim[0].label` has topic, source time [ns] and number, `data` the message", recorded=False,
)  # fmt: skip
VELOCITY_COMMAND = Wire(
    "cmd_vel", "geometry_msgs/msg/TwistStamped", "controller", "stream", "control rate",
    "command of a differential drive: `linear.x` and `angular.z`, stamped as the observation it answers",
    unit="m/s, rad/s", frame="`base_link`",
)  # fmt: skip
PERIOD = Wire(
    "lockstep/period", "sensor_msgs/msg/JointState", "plant", "stream",
    "control rate, in lock step with nodes between plant and controller",
    "readings of one control period: `name` has topics, `position` the number of messages on each; the stamp ends it",
)  # fmt: skip
ANSWER = Wire(
    "lockstep/answer", "sensor_msgs/msg/JointState", "estimator", "stream",
    "control rate, from each node between plant and controller in lock step",
    "the node `header.frame_id` has processed the period of the stamp; `name` and `position` as in `lockstep/period`",
    recorded=False,
)  # fmt: skip
TRANSFORMS = Wire(
    "/tf", "tf2_msgs/msg/TFMessage", "plant", "stream", "with each odometry, where tf2_msgs is installed",
    "`odom` → `base_link` of the odometry's publisher, and what other nodes publish; not used for control", unit="m",
    frame="each its own",
)  # fmt: skip
STATIC_TRANSFORMS = Wire(
    "/tf_static", "tf2_msgs/msg/TFMessage", "plant", "latched", "at load, where tf2_msgs is installed",
    "`base_link` → frames of its parts; `map` → `odom` in a simulation, or with an origin", latest=100, unit="m",
    frame="each its own",
)  # fmt: skip
DESCRIPTION = Wire(
    "robot_description", "std_msgs/msg/String", "plant", "latched", "at load",
    "URDF of the robot, made from its YAML; its links are called as the frames",
)  # fmt: skip

ORIGIN = Wire(
    "origin", "geometry_msgs/msg/TransformStamped", "plant", "latched", "at load",
    "`map` → `odom`: where the robot's odometry begins in the frame that all robots share; as given, not measured",
    unit="m", frame="`map`",
)  # fmt: skip
ROBOT_INFO = Wire(
    "robot_info", "std_msgs/msg/String", "plant", "latched", "at load, and when a person takes or gives it back",
    "JSON: what the robot is and does, see [robot_info.md](robot_info.md)", unit="m; other units in the names of keys",
    frame="`base_link` for its parts",
)  # fmt: skip

WIRES: tuple[Wire, ...] = (
    *SENSOR_WIRES.values(), MOCAP, TRUTH, ACTUATORS_STATE, ACTUATORS_HEALTH, CLOCK, COMMAND, VELOCITY_COMMAND,
    OBSERVATION, ACTION, BELIEVED, METADATA, STATUS, ENVELOPE_STATE, DIAGNOSTICS, GOAL_POSE, GOAL_POINT, GOAL_PATH,
    GOAL_POSES, GOAL_VELOCITY, OBSTACLES, MARKERS, BROADCAST_NAMES, BROADCAST_VALUES,
    BLOCK, AIR_BEARING, DEVICE_STATE, ESTOP, ESTOP_RELEASED, OPERATOR_ACTION, TELEOP, JOY, SWAP, SWAP_RESULT,
    SIMULATION_RATE, SIMULATION_DISTURB, SIMULATION_STATE, SIMULATION_RESULT, SIMULATION_EVENT, RELAY,
    TRANSFORMS, STATIC_TRANSFORMS, DESCRIPTION, ORIGIN, ROBOT_INFO,
    INERTIA, INERTIA_COVARIANCE, INERTIA_STATUS, EVENTS, EVENTS_2, *CAMERA_IMAGES, *CAMERA_COMPRESSED, CAMERA_INFO,
    RATE, RATE_STATUS, PERIOD, ANSWER, FLEET_ESTOP, FLEET_STATUS, NEIGHBOURS,
)  # fmt: skip


def own_wires(robot: Robot) -> tuple[Wire, ...]:
    """Where the sensors of the user's own of a robot are published, beside `WIRES`.

    Raises:
        ConfigError: A class cannot be loaded.
    """
    kinds = robot.sensors.kinds if robot.sensors.own else {}
    return tuple(kinds[name].wire for name in robot.sensors.own)


GOAL_WIRES: dict[str, Wire] = {wire.name: wire for wire in (GOAL_POSE, GOAL_POINT, GOAL_PATH, GOAL_VELOCITY)}


def goal_wires(topic: str) -> tuple[Wire, ...]:
    """Wires on which goals for a task's goal topic arrive; the first carries the topic's own type."""
    return (GOAL_WIRES[topic], GOAL_POSES) if topic == GOAL_PATH.name else (GOAL_WIRES[topic],)


def command_wire(robot: Robot) -> Wire:
    """Where a robot's commands come in."""
    return VELOCITY_COMMAND if robot.actuators.takes_velocity else COMMAND
