"""URDF and MJCF of the structure that public robots have, small enough to read; and meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

# A box on four continuous wheels, its base above a footprint on the floor, with meshes of a package.
ROVER = """<?xml version="1.0"?>
<robot name="rover">
  <material name="Blue"><color rgba="0.2 0.45 0.8 1.0"/></material>
  <link name="base_footprint"/>
  <joint name="chassis" type="fixed">
    <origin xyz="0 0 0.15"/><parent link="base_footprint"/><child link="base_link"/>
  </joint>
  <link name="base_link">
    <visual>
      <geometry><mesh filename="package://rover_description/meshes/base.stl" scale="0.001 0.001 0.001"/></geometry>
      <material name="Blue"/>
    </visual>
    <collision>
      <origin xyz="0 0 0.1"/><geometry><box size="0.9 0.5 0.25"/></geometry>
    </collision>
  </link>
  <link name="inertial_link">
    <inertial>
      <mass value="30"/><origin xyz="-0.1 0 0.1"/>
      <inertia ixx="0.6" ixy="0" ixz="-0.1" iyy="1.7" iyz="0" izz="2.0"/>
    </inertial>
  </link>
  <joint name="inertial" type="fixed"><parent link="base_link"/><child link="inertial_link"/></joint>
  <link name="imu_link"/>
  <joint name="imu" type="fixed">
    <origin xyz="$(optenv IMU 0.2 0 0.1)"/><parent link="base_link"/><child link="imu_link"/>
  </joint>
  {wheels}
</robot>
"""
ROVER_WHEEL = """
  <link name="{name}_link">
    <inertial><mass value="2.5"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.04" iyz="0" izz="0.02"/></inertial>
    <collision>
      <origin rpy="1.5707963267948966 0 0"/><geometry><cylinder length="0.1" radius="0.18"/></geometry>
    </collision>
  </link>
  <joint name="{name}" type="continuous">
    <origin xyz="{x} {y} 0.03"/><parent link="base_link"/><child link="{name}_link"/><axis xyz="0 1 0"/>
    <limit effort="25" velocity="6"/>
  </joint>
"""
# A round base on two wheels, which are turned in their links, and two casters without mass.
TURTLE = """<robot name="turtle">
  <link name="base_link">
    <inertial><mass value="2.4"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.03"/></inertial>
    <visual><geometry><cylinder length="0.1" radius="0.17"/></geometry></visual>
    <collision><origin xyz="0 0 0.05"/><geometry><cylinder length="0.2" radius="0.17"/></geometry></collision>
  </link>
  <link name="left_wheel">
    <inertial><mass value="0.2"/><inertia ixx="0.0001" ixy="0" ixz="0" iyy="0.0001" iyz="0" izz="0.0002"/></inertial>
    <visual><geometry><cylinder length="0.02" radius="0.04"/></geometry></visual>
  </link>
  <link name="right_wheel">
    <inertial><mass value="0.2"/><inertia ixx="0.0001" ixy="0" ixz="0" iyy="0.0001" iyz="0" izz="0.0002"/></inertial>
    <visual><geometry><cylinder length="0.02" radius="0.04"/></geometry></visual>
  </link>
  <link name="front_caster"/><link name="back_caster"/>
  <joint name="left_wheel_joint" type="continuous">
    <origin xyz="0 0.12 0.01" rpy="-1.5707963267948966 0 0"/><parent link="base_link"/><child link="left_wheel"/>
    <axis xyz="0 0 1"/>
  </joint>
  <joint name="right_wheel_joint" type="continuous">
    <origin xyz="0 -0.12 0.01" rpy="-1.5707963267948966 0 0"/><parent link="base_link"/><child link="right_wheel"/>
    <axis xyz="0 0 1"/>
  </joint>
  <joint name="front" type="fixed">
    <origin xyz="0.13 0 0"/><parent link="base_link"/><child link="front_caster"/>
  </joint>
  <joint name="back" type="fixed"><origin xyz="-0.13 0 0"/><parent link="base_link"/><child link="back_caster"/></joint>
</robot>
"""
# Nested bodies, classes of defaults, a free joint, a mesh in millimetres, sites that actuators push at.
FOUR = """<mujoco model="four">
  <compiler angle="degree" meshdir="assets"/>
  <default>
    <default class="visual"><geom contype="0" conaffinity="0" group="2" rgba="0.8 0.16 0.14 1"/></default>
    <default class="collision"><geom group="3"/></default>
    <default class="jet">
      <site size="0.01"/><general ctrlrange="0 1" ctrllimited="true" gainprm="0.8" gear="1 0 0 0 0 0"/>
    </default>
  </default>
  <asset><mesh name="hull" file="hull.stl" scale="0.001 0.001 0.001"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 0.1"/>
    <body name="base" pos="0 0 0.3" childclass="visual">
      <freejoint/>
      <inertial pos="0.01 0 0.02" mass="6" diaginertia="0.2 0.2 0.25"/>
      <geom type="mesh" mesh="hull" pos="0 0 0.1"/>
      <geom class="collision" contype="1" conaffinity="1" type="cylinder" size="0.3 0.2"/>
      <body name="tower" pos="0 0 0.2">
        <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/><geom type="box" size="0.05 0.05 0.1"/>
      </body>
      <site name="jet_1" class="jet" pos="0 0.2 0"/>
      <site name="jet_2" class="jet" pos="0 -0.2 0"/>
      <site name="jet_3" class="jet" pos="0.2 0 0" euler="0 0 135"/>
      <site name="jet_4" class="jet" pos="0.2 0 0" euler="0 0 -135"/>
    </body>
  </worldbody>
  <actuator>
    <general class="jet" name="jet_1" site="jet_1"/>
    <general class="jet" name="jet_2" site="jet_2"/>
    <general class="jet" name="jet_3" site="jet_3"/>
    <general class="jet" name="jet_4" site="jet_4"/>
  </actuator>
</mujoco>
"""

# Thrusters of a platform: name, place [m], direction of the force on the body; the four are the least that control it.
NOZZLES = [
    ("left", (0.0, 0.2), (1, 0)),
    ("right", (0.0, -0.2), (1, 0)),
    ("astern_left", (0.2, 0.0), (-1, 1)),
    ("astern_right", (0.2, 0.0), (-1, -1)),
]


def rover_urdf() -> str:
    """The rover with its wheels."""
    places = {f"{end}_{side}_wheel": (x, y) for end, x in (("front", 0.25), ("rear", -0.25))
              for side, y in (("left", 0.28), ("right", -0.28))}  # fmt: skip
    wheels = (ROVER_WHEEL.format(name=name, x=x, y=y) for name, (x, y) in places.items())
    return ROVER.replace("{wheels}", "".join(wheels))


def write_cuboid(path: Path, size: tuple[float, float, float]) -> None:
    """A binary STL, or an OBJ by its ending, of a cuboid about the origin."""
    half = 0.5 * np.array(size)
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".obj":
        lines = [f"v {x} {y} {z}" for x, y, z in corners]
        lines += ["f " + " ".join(f"{corner + 1}//1" for corner in quad) for quad in quads]
        path.write_text("\n".join(lines), encoding="utf-8")
        return
    triangles = np.array([(a, *pair) for a, b, c, d in quads for pair in ((b, c), (c, d))])
    kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    facets = np.zeros(len(triangles), kind)
    facets["corners"] = corners[triangles]
    path.write_bytes(b"cuboid".ljust(80) + len(triangles).to_bytes(4, "little") + facets.tobytes())


def new_platform(count: int) -> list[str]:
    """Words of the command that makes the platform `with_<count>`, with the first of the nozzles."""
    nozzles = ", ".join(
        f"{{name: {name}, position: [{x}, {y}, 0], direction: [{ahead}, {left}, 0]}}"
        for name, (x, y), (ahead, left) in NOZZLES[:count]
    )
    settings = ("body.mass=6.0", "body.inertia=[0.2, 0.2, 0.22]", f"actuators.nozzles=[{nozzles}]")
    sets = [word for setting in settings for word in ("--set", setting)]
    return ["new", "robot", f"with_{count}", "--like", "floating_platform", *sets]
