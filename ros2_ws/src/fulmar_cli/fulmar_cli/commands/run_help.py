"""What the options of `fulmar run` say of themselves."""

from __future__ import annotations

from fulmar_cli.commands import arguments as cli

RUN_TASK_HELP = (
    f"{cli.TASK_HELP} By default the goal decides: go_to_position for x,y, go_to_pose for x,y,deg and without a goal, "
    "and the task that takes the goals of --goals. In space go_to_pose_3d for six numbers; satellites slew, point."
)
BACKEND_HELP = (
    "mujoco, mock (Fulmar's own dynamics, perfect sensors), jsbsim[:MODEL] (aircraft), basilisk (spacecraft) or "
    "hardware."
)
DURATION_HELP = "Simulated seconds; the task's episode by default."
GOAL_HELP = (
    "Where to go [m, deg], in space x,y,z,roll,pitch,yaw or x,y,z with --task go_to_position_3d; of satellites "
    "roll,pitch,yaw. By default the seed draws it."
)
START_HELP = (
    "Where to begin [m, deg], in space x,y,z or x,y,z,roll,pitch,yaw and of satellites roll,pitch,yaw; by default the "
    "seed draws it."
)
VELOCITY = "ahead,left,turning [m/s, deg/s]; in space ahead,left,up,roll,pitch,yaw; of aircraft the airspeed"
VELOCITY_HELP = (
    f"Velocity to keep: {VELOCITY}. The task is then track_velocities, track_velocities_3d, fly_airspeed."
)
HEIGHT_HELP = (
    "Height above the ground that an aircraft holds; with fly_airspeed or fly_attitude it begins there [m]."
)
CONTROLLER_HELP = f"{cli.CONTROLLER_HELP} By default the shipped policy, or a law where there is none."
GOALS_HELP = "Goals in turn, a path, or torques for excite: one of `fulmar list goals`, or a .yaml file."
ESTIMATOR_HELP = "Estimate odometry, inertia, rates: names of configs/estimators or classes, with commas."
END_HELP = "An e-stop ends and fails the run; by default the robot waits for a reset and a new goal."
AREA_HELP = "x_min, x_max, y_min, y_max, in space also z_min, z_max, not to be left [m]: --area=-2,2,-1,1."
GUARD_HELP = (
    "envelope: a law takes over before the robot leaves area, geofence, turn rate or speed, or touches water."
)
RECORDING_HELP = (
    "whole: every message. ring: the last 30 s stay in memory and are written only when a fault occurs (an error of "
    "plant or controller, the watchdog, the e-stop), with 5 s after it; without a fault there is no bag and no result "
    "for the goal, and the exit code is 0. The system file's `recorder:` by default."
)
REMAP_HELP = (
    "Another name for mocap/pose, a sensor's topic such as odom, ground_truth/odom or a command topic, for every node; "
    "the bag keeps the usual one. Give it once for each topic."
)
ADAPTER_HELP = (
    "With --controller external: take commands as the driver of this hardware file sends them, and pass them on to "
    "the plant. A name from configs/hardware, or a .yaml file."
)
SYSTEM_HELP = (
    "A fleet in the place of a robot: a file of configs/systems with several robots. See docs/fleets.md."
)
NO_GUARD_HELP = "Of a fleet: let no guard keep its robots apart."
