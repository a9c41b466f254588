"""Orders of valves by name: which thruster, counted from 0, each entry after the bearing opens.

Public sources disagree about the wiring of the Zero-G Lab's platform; each order belongs to its own numbering of its
nozzles.
"""

from __future__ import annotations

VALVE_ORDERS: dict[str, tuple[int, ...]] = {
    # snt-spacer/RoboRAN-deploy-to-robot at eeefb9a, robot_interfaces/floating_platform.py; for the nozzles of RoboRAN's
    # FloatingPlatform (pairs at 0, 90, 180 and 270°).
    "roboran": (5, 1, 3, 7, 0, 4, 6, 2),
    # elharirymatteo/RANS at 6f2720b, omniisaacgymenvs/ros/ros_node.py, on the same topic; for the nozzles of RANS
    # (pairs at 45, 135, 225 and 315°, as in configs/robots/floating_platform.yaml).
    "rans": (2, 5, 4, 7, 6, 1, 0, 3),
}
