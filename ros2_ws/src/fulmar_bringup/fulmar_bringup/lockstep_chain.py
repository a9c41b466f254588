"""The nodes between plant and controller: who publishes the odometry, and which measurement a plant waits with."""

from __future__ import annotations

from fulmar_bringup.camera_row import image_specs
from fulmar_bringup.estimator_row import camera_specs, estimator_specs
from fulmar_bringup.node_spec import NodeSpec
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.estimators.kinds import estimator_kind
from fulmar_core.robots.topics import ACTUATORS_STATE, MOCAP, ODOMETRY, PERIOD, Wire
from hardware_drivers.hardware import load_hardware


def between(plan: RunPlan) -> tuple[NodeSpec, ...]:
    """Cameras and estimators that Fulmar brings, each after those whose outputs are its inputs."""
    return (*camera_specs(plan), *image_specs(plan), *estimator_specs(plan))


def estimates_odometry(plan: RunPlan) -> bool:
    """Whether a node between plant and controller publishes the odometry, in the place of the plant."""
    estimator = plan.guards.estimator
    if estimator and ODOMETRY in estimator_kind(estimator).publishes:
        return True
    return any(ODOMETRY.name in node.outputs for node in plan.nodes)


def takes_poses(plan: RunPlan) -> bool:
    """Whether what estimates the odometry takes poses of motion capture; a satellite's takes a star tracker."""
    estimator = plan.guards.estimator
    return not estimator or MOCAP in estimator_kind(estimator).readings.values()


def chain_of(plan: RunPlan) -> tuple[str, ...]:
    """Nodes between plant and controller that answer each period of lock step; none by the clock."""
    if not plan.lockstep:
        return ()
    own = (node.name for node in plan.nodes if PERIOD.name in node.inputs)
    return (*(row.name for row in between(plan)), *own)


def paced_wire(plan: RunPlan) -> Wire:
    """The measurement whose subscribers a plant waits for.

    Odometry, poses in its place, or what the actuators do; in lock step with nodes between, the periods.
    """
    estimated = estimates_odometry(plan)
    if chain_of(plan):
        return PERIOD
    if plan.hardware and (estimated or not load_hardware(plan.hardware).measures_odometry):
        return ACTUATORS_STATE
    if estimated and not takes_poses(plan):
        return ACTUATORS_STATE
    return MOCAP if estimated else ODOMETRY
