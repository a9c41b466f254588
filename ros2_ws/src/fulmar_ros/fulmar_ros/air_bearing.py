"""Service and latched state of the air bearing, independent of thrust commands."""

from __future__ import annotations

from rclpy.node import Node
from std_msgs.msg import Bool
from std_srvs.srv import SetBool

from fulmar_core.robots.topics import AIR_BEARING
from fulmar_core.simulation.backend import AirBearing
from fulmar_ros.qos import FLUSH_S, flush, publisher_qos

SERVICE = "air_bearing/enable"
LOOK_S, AT_LEAST_S = 0.1, 1.0


class AirBearingWires:
    """Serves `air_bearing/enable` and publishes `air_bearing/state`."""

    def __init__(self, node: Node, bearing: AirBearing, *, watched: bool = True) -> None:
        """Create every endpoint; requests switch `bearing`.

        Args:
            node: Owner of the endpoints.
            bearing: The bearing.
            watched: Publish its state by the wall clock, too; if not, its owner publishes each change.
        """
        self._bearing = bearing
        self._said: bool | None = None
        self._silent_s = 0.0
        self._publisher = node.create_publisher(Bool, AIR_BEARING.name, publisher_qos(AIR_BEARING))
        self._service = node.create_service(SetBool, SERVICE, self._switch)
        self._timer = node.create_timer(LOOK_S, self._look) if watched else None
        self.publish()

    def publish(self) -> None:
        """Publish the state now."""
        self._said, self._silent_s = self._bearing.bearing_on, 0.0
        self._publisher.publish(Bool(data=self._said))

    def publish_and_wait(self) -> None:
        """Publish the state now, and wait at most `FLUSH_S` until every subscriber has it."""
        self.publish()
        flush([self._publisher], FLUSH_S)

    def destroy(self, node: Node) -> None:
        """Destroy every endpoint."""
        if self._timer is not None:
            node.destroy_timer(self._timer)
        node.destroy_service(self._service)
        node.destroy_publisher(self._publisher)

    def _look(self) -> None:
        self._silent_s += LOOK_S
        if self._bearing.bearing_on is not self._said or self._silent_s >= AT_LEAST_S:
            self.publish()

    def _switch(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        refusal = self._bearing.set_bearing(bool(request.data))
        response.success = not refusal
        response.message = refusal or f"the air bearing is {'on' if request.data else 'off'}"
        self.publish()
        return response
