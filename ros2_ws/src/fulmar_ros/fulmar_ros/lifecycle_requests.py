"""Requests of a lifecycle node's transitions that it cannot make now."""

from __future__ import annotations

from lifecycle_msgs.srv import ChangeState
from rclpy.lifecycle import LifecycleNode


def refuse_impossible_transitions(node: LifecycleNode) -> None:
    """Answer requests that do not fit the node's state with a refusal, and log them.

    rclpy raises from the service's callback instead, which ends the process: a second `configure`, from whomever, would
    stop a robot that moves. To be called before the node spins.
    """
    name = f"{node.get_fully_qualified_name()}/change_state"
    service = next(service for service in node.services if service.service_name == name)
    obey = service.callback

    def answer(request: ChangeState.Request, response: ChangeState.Response) -> ChangeState.Response:
        machine, asked = node._state_machine, request.transition
        possible = {number: label for number, label, *_ in machine.available_transitions}
        if asked.label in possible.values() or (not asked.label and asked.id in possible):
            return obey(request, response)
        node.get_logger().warning(
            f"asked for the transition {asked.label or asked.id}, which the state '{machine.current_state[1]}' does "
            "not have: refused. Does another run of this name begin in this ROS domain?"
        )
        response.success = False
        return response

    service.callback = answer
