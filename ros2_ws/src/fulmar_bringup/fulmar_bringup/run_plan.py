"""What one system or run is started with."""

from __future__ import annotations

from dataclasses import dataclass

from fulmar_bringup.node_spec import ENDS, RESTARTS, NodeSpec
from fulmar_bringup.system import NONE, Guards
from fulmar_core.config.recording import Recording
from fulmar_core.wires.robot_name import Frames, frames_of, namespace_of


@dataclass(frozen=True)
class RunPlan:
    """Everything that one run is started with."""

    robot: str
    task: str
    controller: str
    backend: str
    control_hz: float  # [Hz]
    name: str = ""  # what the robot is called; empty: as its type
    policy: str = ""  # folder of a bundle; empty: the shipped one
    scenario: str = "nominal"
    seed: int = 0
    start: tuple[float, ...] = (0.0, 0.0, 0.0)  # as `State.NUMBERS`, or a place alone [m, deg]
    duration_s: float = 0.0  # 0: until stopped [s]
    lockstep: bool = False
    rate: float = 1.0  # simulated seconds a wall-clock second
    goals: str = ""  # goal file that a node of its own publishes; empty: somebody else gives the goal
    excitation: str = ""  # goal file of torques that the controller plays; empty: none
    guards: Guards = NONE
    supervised: bool = False  # somebody else activates the plant when all are ready
    hardware: str = ""  # file of `configs/hardware`, where the backend is hardware
    emulated: bool = False  # an emulator stands in for the device
    arm: bool = False  # an autopilot may be armed, whatever the hardware file says
    unattended: bool = False  # begun by a service: the e-stop is pressed, and nothing is armed
    recording: Recording = Recording()
    copies: int = 1  # of each command on the wire
    controller_network: str = ""  # namespace of Linux, as another computer; empty: ours
    mocap_hz: float = 0.0  # simulated motion capture beside the odometry; 0: only for an estimator [Hz]
    remappings: tuple[tuple[str, str], ...] = ()  # topics and their other names, for every node
    # Outputs of a node that another process takes and passes on: node, topic, and what it is called instead.
    intercepted: tuple[tuple[str, str, str], ...] = ()
    adapter: str = (
        ""  # hardware file of an adapter, whose commands an external controller speaks; empty: none
    )
    adapter_topic: str = ""  # topic that it takes them from; empty: the file's
    only: str = ""  # plant or controller: the other one runs in another place; empty: both
    nodes: tuple[NodeSpec, ...] = ()  # of the system's own, beside those that every system has
    extras: tuple[str, ...] = ()  # nodes of the table with an option that run, by name: `node_table.OPTIONS`

    @property
    def loss_of_helpers(self) -> str:
        """What the loss of a node means that takes no robot's control away; lock step waits for nobody's return."""
        return ENDS if self.lockstep else RESTARTS

    @property
    def robot_name(self) -> str:
        """What the robot is called."""
        return self.name or self.robot

    @property
    def namespace(self) -> str:
        """Namespace of every node and topic of the robot."""
        return namespace_of(self.robot_name)

    @property
    def frames(self) -> Frames:
        """Names of the robot's frames."""
        return frames_of(self.robot_name, self.robot)
