"""The table of processes: which nodes a system is made of, with their parameters. Pure, starts nothing.

Both `fulmar run` and `launch/system.launch.py` start exactly what this lists.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

from fulmar_bringup.bag_origin import attachments, run_info
from fulmar_bringup.emulation import Emulation
from fulmar_bringup.external import adapter_path, check_external
from fulmar_bringup.goal_plan import checked_goals, goal_path, is_path_of_places
from fulmar_bringup.system import NONE, Guards, default_hardware, varied_system
from fulmar_core.estimation.settings import load_estimator
from fulmar_core.recording import Recording
from fulmar_core.robot import load_robot
from fulmar_core.safety.area import NO_AREA
from fulmar_core.tasks import load_task
from hardware_drivers.own_driver import check_own_driver
from hardware_drivers.settings import load_hardware
from policy_server.controllers import controller_entry

Parameter = bool | int | float | str | list[float] | list[int] | list[str]


@dataclass(frozen=True)
class NodeSpec:
    """One process with one node."""

    name: str  # of the node
    package: str  # ament package
    executable: str  # script that the package installs
    module: str  # the same as a Python module
    namespace: str
    parameters: dict[str, Parameter] = field(default_factory=dict)
    quiet: bool = False  # says only what is wrong
    remappings: dict[str, str] = field(default_factory=dict)  # topics under other names
    network: str = ""  # namespace of Linux that it runs in; empty: ours


@dataclass(frozen=True)
class RunPlan:
    """Everything that one run is started with."""

    robot: str
    task: str
    controller: str
    backend: str
    control_hz: float  # [Hz]
    policy: str = ""  # folder of a bundle; empty: the shipped one
    scenario: str = "nominal"
    seed: int = 0
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)  # x [m], y [m], heading [deg]
    duration_s: float = 0.0  # 0: until stopped [s]
    lockstep: bool = False
    rate: float = 1.0  # simulated seconds a wall-clock second
    goals: str = ""  # goal file that a node of its own tells; empty: somebody else gives the goal
    guards: Guards = NONE
    supervised: bool = False  # somebody else activates the plant when all are ready
    hardware: str = ""  # file of `configs/hardware`, where the backend is hardware
    emulated: bool = False  # an emulator stands in for the device
    arm: bool = False  # an autopilot may be armed, whatever the hardware file says
    recording: Recording = Recording()
    copies: int = 1  # of each command on the wire
    controller_network: str = ""  # namespace of Linux, as another computer; empty: ours
    mocap_hz: float = 0.0  # simulated motion capture beside the odometry; 0: only for an estimator [Hz]
    remappings: tuple[tuple[str, str], ...] = ()  # topics and their other names, for every node
    adapter: str = (
        ""  # hardware file of an adapter, whose commands an external controller speaks; empty: none
    )
    adapter_topic: str = ""  # topic that it takes them from; empty: the file's


def controller_spec(plan: RunPlan, *, subscribers: int = 0) -> NodeSpec:
    """The node that controls.

    Args:
        plan: What to run.
        subscribers: Subscriptions of the command to wait for, in lock step.
    """
    parameters: dict[str, Parameter] = {
        "controller": plan.controller,
        "robot": plan.robot,
        "task": plan.task,
        "control_hz": plan.control_hz,
        "lockstep": plan.lockstep,
        "rate": plan.rate,
        "goals_streamed": bool(plan.goals),
        "wait_for_subscribers": subscribers,
    }
    guards = plan.guards
    if controller_entry(plan.controller).runs_bundle:
        texts = {
            "policy": plan.policy,
            "fallback": guards.fallback or "",
            "trusted_keys": "" if guards.trusted_keys is None else str(Path(guards.trusted_keys).absolute()),
        }
        parameters |= {key: text for key, text in texts.items() if text}
    if guards.max_run_time_s:
        parameters["max_run_time_s"] = guards.max_run_time_s
    if guards.area != NO_AREA:
        parameters["area"] = list(guards.area)
    if guards.estop:
        parameters["estop"] = True
    if plan.backend == "hardware" and load_hardware(plan.hardware).has_bearing:
        parameters["air_bearing"] = True
    on_hardware = plan.backend == "hardware" and not guards.estimator
    if on_hardware and not load_hardware(plan.hardware).seen_from_outside:
        parameters["odometry_may_repeat"] = True  # encoders of a base at rest do; motion capture never does
    if plan.copies > 1:
        parameters["copies"] = plan.copies
    return NodeSpec(
        "controller",
        "policy_server",
        "controller_node",
        "policy_server.controller_node",
        f"/{plan.robot}",
        parameters,
        network=plan.controller_network,
        remappings=dict(plan.remappings),
    )


def adapter_spec(plan: RunPlan) -> NodeSpec:
    """The node that passes the commands of another stack on to the plant."""
    parameters: dict[str, Parameter] = {"hardware": plan.adapter}
    if plan.adapter_topic:
        parameters["topic"] = plan.adapter_topic
    return NodeSpec(
        "adapter",
        "hardware_drivers",
        "adapter_node",
        "hardware_drivers.adapter_node",
        f"/{plan.robot}",
        parameters,
        remappings=dict(plan.remappings),
    )


def commander_specs(plan: RunPlan, *, subscribers: int = 0) -> tuple[NodeSpec, ...]:
    """The node that commands the plant; none where an external controller does so without an adapter.

    Args:
        plan: What to run.
        subscribers: As of `controller_spec`.
    """
    if not controller_entry(plan.controller).is_external:
        return (controller_spec(plan, subscribers=subscribers),)
    return (adapter_spec(plan),) if plan.adapter else ()


def plant_spec(plan: RunPlan, *, subscribers: int = 0, port: str = "") -> NodeSpec:
    """The node that simulates, or that drives a device.

    Args:
        plan: What to run.
        subscribers: Subscriptions of the odometry to wait for before the first step.
        port: Where the device is, in the place of what the hardware file says.
    """
    parameters: dict[str, Parameter] = {
        "robot": plan.robot,
        "task": plan.task,
        "backend": plan.backend,
        "scenario": plan.scenario,
        "seed": plan.seed,
        "start": list(plan.start),
        "control_hz": plan.control_hz,
        "lockstep": plan.lockstep,
        "rate": plan.rate,
        "duration_s": plan.duration_s,
        "wait_for_subscribers": subscribers,
        "autostart": not plan.supervised,
    }
    if plan.guards.estop:
        parameters["estop"] = True
    if plan.guards.estimator:
        parameters["estimated"] = True
    if plan.backend == "hardware":
        parameters["hardware"] = plan.hardware
        if plan.arm:
            parameters["arm"] = True
        if port:
            parameters["port"] = port
        return NodeSpec(
            "plant",
            "hardware_drivers",
            "driver_node",
            "hardware_drivers.driver_node",
            f"/{plan.robot}",
            parameters,
            remappings=dict(plan.remappings),
        )
    parameters |= _motion_capture(plan)
    return NodeSpec(
        "plant",
        "sim_nodes",
        "sim_node",
        "sim_nodes.sim_node",
        f"/{plan.robot}",
        parameters,
        remappings=dict(plan.remappings),
    )


def _motion_capture(plan: RunPlan) -> dict[str, Parameter]:
    """Parameters of the simulated motion capture."""
    late: dict[str, Parameter] = {}
    if plan.guards.estimator:
        late["mocap_late_s"] = load_estimator(plan.guards.estimator).latency_s
    return late | ({"mocap_hz": plan.mocap_hz} if plan.mocap_hz else {})


def emulator_spec(plan: RunPlan, emulation: Emulation) -> NodeSpec:
    """The node that stands in for a device."""
    parameters: dict[str, Parameter] = {
        "robot": plan.robot,
        "task": plan.task,
        "scenario": plan.scenario,
        "seed": plan.seed,
        "start": list(plan.start),
        "device": emulation.device,
        "link": emulation.link,
        **emulation.more,
    }
    parameters |= _motion_capture(plan)
    return NodeSpec(
        "emulator",
        "sim_nodes",
        "emulator_node",
        "sim_nodes.emulator_node",
        f"/{plan.robot}",
        parameters,
        remappings=dict(plan.remappings),
    )


def recorder_spec(plan: RunPlan, *, directory: str = "", info: str = "", files: str = "") -> NodeSpec:
    """The node that records.

    Args:
        plan: What to run.
        directory: The bag folder; empty: the node makes one under `runs/`.
        info: As `bag_origin.run_info` gives it.
        files: As `bag_origin.attachments` gives it.
    """
    texts = {"directory": directory, "run_info": info, "attachments": files}
    usual = asdict(Recording())
    unusual = {key: value for key, value in asdict(plan.recording).items() if value != usual[key]}
    return NodeSpec(
        "recorder",
        "fulmar_ros",
        "recorder_node",
        "fulmar_ros.recorder_node",
        f"/{plan.robot}",
        {key: text for key, text in texts.items() if text} | unusual,
        remappings=dict(plan.remappings),
    )


def goals_spec(
    robot: str, goals: str, *, as_path: bool = False, control_hz: float = 10.0, give_up_s: float = 0.0
) -> NodeSpec:
    """The node that tells goals from a file; no system has it by itself.

    Args:
        robot: Who is to do it.
        goals: Name of a file in `configs/goals`, or a path that ends in `.yaml`.
        as_path: Tell all positions or poses at once.
        control_hz: Velocities come so often along a path [Hz].
        give_up_s: Ends with exit code 1 where robot or controller are not there after so long; 0: waits [s].
    """
    parameters: dict[str, Parameter] = {
        "goals": goals,
        "robot": robot,
        "control_hz": control_hz,
        "as_path": as_path,
    }
    if give_up_s:
        parameters["give_up_s"] = give_up_s
    return NodeSpec("goals", "fulmar_ros", "goal_node", "fulmar_ros.goal_node", f"/{robot}", parameters)


def run_goals_spec(plan: RunPlan) -> NodeSpec:
    """The node that tells the goals of a run, for as long as the run lasts."""
    spec = goals_spec(
        plan.robot,
        plan.goals,
        as_path=is_path_of_places(load_task(plan.task)),
        control_hz=min(plan.control_hz, 10.0),
    )
    more: dict[str, Parameter] = {"stay": True, "lockstep": plan.lockstep, "rate": plan.rate}
    return replace(spec, parameters=spec.parameters | more, remappings=dict(plan.remappings))


def guard_specs(plan: RunPlan) -> tuple[NodeSpec, ...]:
    """The nodes that a plan's guards ask for."""
    space, parameters = f"/{plan.robot}", {"robot": plan.robot}
    nodes = []
    if plan.guards.estop:
        nodes.append(
            NodeSpec(
                "estop",
                "fulmar_ros",
                "estop_node",
                "fulmar_ros.estop_node",
                space,
                dict(parameters),
                remappings=dict(plan.remappings),
            )
        )
    if plan.guards.estimator:
        chosen: dict[str, Parameter] = {**parameters, "estimator": plan.guards.estimator}
        nodes.append(
            NodeSpec(
                "estimator",
                "fulmar_ros",
                "estimator_node",
                "fulmar_ros.estimator_node",
                space,
                chosen,
                remappings=dict(plan.remappings),
            )
        )
    return tuple(nodes)


def list_nodes(
    *,
    system: str | None = None,
    robot: str | None = None,
    task: str | None = None,
    controller: str | None = None,
    backend: str | None = None,
    policy: str | None = None,
    goals: str | None = None,
    hardware: str | None = None,
    adapter: str | None = None,
    topic: str | None = None,
) -> tuple[NodeSpec, ...]:
    """Nodes of a system, each of its choices replaced by what is given.

    Args:
        system: Name of a file in `configs/systems`; `mujoco_policy` by default.
        robot: Another robot.
        task: Another task.
        controller: Another controller.
        backend: Another backend.
        policy: Folder of a bundle; the shipped one by default.
        goals: Name of a file in `configs/goals`, or a path that ends in `.yaml`; without it somebody else gives goals.
        hardware: Name of a file in `configs/hardware`, or a path that ends in `.yaml`; the robot's own by default.
        adapter: With controller `external`, name or path of the hardware file whose commands it speaks.
        topic: Topic that the adapter takes them from; the file's by default.

    Returns:
        Recorder, plant, controller and, with `goals`, the node that tells them. The row of an external controller is
        not there, or is that of its adapter.

    Raises:
        ConfigError: Unknown name, or a mistake in a file.
    """
    chosen = varied_system(
        system or "mujoco_policy",
        robot=robot,
        task=task,
        controller=controller,
        backend=backend,
        hardware=hardware,
    )
    load_robot(chosen.robot).timing.substeps(chosen.control_hz)
    plan = RunPlan(
        chosen.robot,
        chosen.task,
        chosen.controller,
        chosen.backend,
        control_hz=chosen.control_hz,
        policy=policy or "",
        guards=chosen.guards,
        recording=chosen.recorder,
    )
    if plan.backend == "hardware":
        plan = replace(plan, hardware=default_hardware(plan.robot, hardware))
        check_own_driver(load_hardware(plan.hardware).driver)
    check_external(plan.controller, plan.guards, adapter=adapter, topic=topic, lockstep=False)
    plan = replace(plan, adapter=adapter_path(plan.robot, adapter), adapter_topic=topic or "")
    recorder = recorder_spec(plan, info=run_info(plan), files=attachments(plan))
    nodes = recorder, plant_spec(plan), *guard_specs(plan), *commander_specs(plan)
    if not goals:
        return nodes
    checked_goals(goals, load_robot(plan.robot), load_task(plan.task))
    plan = replace(plan, goals=str(goal_path(goals)))
    return *nodes, run_goals_spec(plan)
