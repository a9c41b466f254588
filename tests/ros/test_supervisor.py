"""The operator's side of a run, against plants that do not do as they are told."""

from __future__ import annotations

import pytest
import rclpy
from lifecycle_msgs.srv import ChangeState

from fulmar_bringup.supervisor import supervisor
from fulmar_core.errors import RunFailed
from fulmar_core.tasks import load_task
from fulmar_ros.runtime import spinning
from tests.conftest import RosDomain

pytestmark = pytest.mark.real_time


@pytest.mark.parametrize(
    ("refused", "words"),
    [(1, "plant: could not be configured: no model"), (3, "plant: could not be activated: no model")],
)
def test_a_plant_that_refuses_to_start_fails_the_run_with_its_own_reason(
    refused: int, words: str, ros_domain: RosDomain
) -> None:
    """Both steps of its start, in ROS' numbers of transitions."""

    def answer(request: ChangeState.Request, response: ChangeState.Response) -> ChangeState.Response:
        response.success = request.transition.id != refused
        return response

    with supervisor("floating_platform", load_task("go_to_pose")) as overseer:
        plant = rclpy.create_node("plant", namespace="/floating_platform")
        plant.create_service(ChangeState, "plant/change_state", answer)
        with spinning(plant, overseer.fail), pytest.raises(RunFailed) as caught:
            overseer.start_plant(lambda: None, lambda: "no model")
    assert str(caught.value) == words
