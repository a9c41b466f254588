"""What one system or run is started with: its plan, and the rows of its processes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from fulmar_bringup.node_loss import ENDS, RESTARTS
from fulmar_bringup.system import NONE, Guards
from fulmar_core.config.recording import Recording
from fulmar_core.estimators.kinds import KINDS
from fulmar_core.wires.robot_name import Frames, frames_of, namespace_of

Parameter = bool | int | float | str | list[float] | list[int] | list[str]
PLANT, CONTROLLER = PARTS = ("plant", "controller")  # values of `RunPlan.only`
# Nodes of a system by name: those that publish diagnostics, and all.
ESTIMATORS = tuple(dict.fromkeys(kind.node for kind in KINDS.values()))
REPORTING = (*PARTS, "recorder", "estop", *ESTIMATORS, "markers")
NODES = (*REPORTING, "event_camera", "emulator")


@dataclass(frozen=True)
class NodeSpec:
    """One process with one node."""

    name: str  # of the node
    package: str  # ament package
    executable: str  # script that the package installs
    module: str  # the same as a Python module
    namespace: str
    parameters: dict[str, Parameter] = field(default_factory=dict)
    quiet: bool = False  # prints only warnings and errors
    remappings: dict[str, str] = field(default_factory=dict)  # topics under other names
    network: str = ""  # namespace of Linux that it runs in; empty: ours
    inputs: tuple[str, ...] = ()  # topics without which it is of no use
    outputs: tuple[str, ...] = ()  # topics that it publishes
    observed: tuple[str, ...] = ()  # topics that it receives if they are there
    optional: bool = False  # no node waits for it
    loss: str = ENDS  # what its loss means: one of `node_loss.LOSSES`
    ends_within_s: float = 0.0  # that an orderly end may take; 0: as any node's [s]


def node_row(
    namespace: str, name: str, module: str, parameters: Mapping[str, Parameter], **more: Any
) -> NodeSpec:
    """A row of a Python module: its first part is the package, its last part the executable."""
    package, executable = module.partition(".")[0], module.rpartition(".")[2]
    return NodeSpec(name, package, executable, module, namespace, dict(parameters), **more)


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
    markers: bool = False  # a node draws goal, limits and thrust for viewers

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
