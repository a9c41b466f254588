"""The node `simulation_interfaces`: serves ROS's standard services for simulators, for the plant of one robot.

It asks the plant as `fulmar simulation` does: what is done stands in bags, and the same rules hold.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from rclpy.action import ActionServer, CancelResponse
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.state_requests import MOST_STEPS, PLACE, RESET, state_fields
from fulmar_core.tasks import load_task
from fulmar_ros.action_messages import execute_goal
from fulmar_ros.health import Health
from fulmar_ros.parameters import name_of, own_frames, read_parameters
from fulmar_ros.runtime import RequestExit, run_node
from fulmar_ros.simulation_messages import (
    DONE,
    Entity,
    Outcome,
    asked_state,
    failed,
    features_message,
    interface,
    matching,
    unsupported,
)
from fulmar_ros.simulation_plant import SimulationPlant

HEALTH_S = 0.5
SILENT_S = 2.0  # without a state of a plant that is not paused [s]
SPAWNING = "a plant simulates the bodies that it was started with: start another robot by `fulmar up`."
NOT_PAUSED = "the simulation is not paused: call set_simulation_state with STATE_PAUSED first."
DEFAULT, TIME, STATE, ALL = 0, 1, 2, 255  # scopes of a reset
Answer = Callable[[Any, Any], Outcome]  # fills the response to a request, all but its `result`


@dataclass(frozen=True)
class SimulationSettings:
    """ROS parameters of the node."""

    robot: str = "floating_platform"
    task: str = "go_to_pose"
    thing: str = ""  # in space, in the place of that of the task; empty: as the task has it
    control_hz: float = 0.0  # 0: the robot's own [Hz]
    places: bool = True  # whether the simulator can put the body elsewhere


class SimulationInterfacesNode(Node):
    """Serves the standard's services in the robot's namespace."""

    def __init__(self, _request_exit: RequestExit, *, cli_args: list[str] | None = None) -> None:
        """Read the parameters, and serve.

        Args:
            cli_args: ROS arguments of this node alone, where it shares a process.

        Raises:
            FulmarError: If a parameter or a file is wrong, or the messages are not installed.
        """
        super().__init__("simulation_interfaces", cli_args=cli_args)
        settings = read_parameters(self, SimulationSettings)
        robot, task = load_robot(settings.robot), load_task(settings.task, settings.thing)
        self._name, self._frames = name_of(self, robot), own_frames(self, robot)
        self._places, self._stopped = settings.places, False
        control_hz = settings.control_hz or robot.timing.control_hz
        self._plant = SimulationPlant(self, robot, task, self._frames, control_hz=control_hz)
        self.companions = [self._plant]  # in a thread of its own, which takes messages while a service waits
        self._served = 0
        self._health = Health(self._plant, f"{self._name}: simulation_interfaces")
        for name, answer in self._answers().items():
            kind = interface("srv", "".join(word.capitalize() for word in name.split("_")))
            self.create_service(kind, name, self._counting(answer))
        self._steps = ActionServer(
            self,
            interface("action", "SimulateSteps"),
            "simulate_steps",
            execute_callback=lambda _handle: None,  # each goal has its own, once it has ended
            handle_accepted_callback=self._begin_steps,
            cancel_callback=lambda _handle: CancelResponse.ACCEPT,
        )
        # By the thread that never waits: steps may take long.
        self._plant.create_timer(HEALTH_S, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _answers(self) -> dict[str, Answer]:
        """What answers each service."""
        return {
            "get_simulator_features": self._features,
            "get_simulation_state": self._state,
            "set_simulation_state": self._change,
            "step_simulation": self._step,
            "reset_simulation": self._reset,
            "get_entities": self._entities,
            "get_entities_states": self._entities_states,
            "get_entity_state": self._entity_state,
            "set_entity_state": self._set_entity_state,
            "spawn_entity": self._spawn,
            "delete_entity": self._delete,
            "get_spawnables": self._spawn,
        }

    def _counting(self, answer: Answer) -> Callable[[Any, Any], Any]:
        def respond(request: Any, response: Any) -> Any:
            self._served += 1
            outcome = answer(request, response)
            if hasattr(response, "result"):
                response.result = outcome.message()
            return response

        return respond

    def _features(self, _request: Any, response: Any) -> Outcome:
        response.features = features_message(places=self._places)
        return DONE

    def _state(self, _request: Any, response: Any) -> Outcome:
        state = response.state
        now = state.STATE_PAUSED if self._plant.paused else state.STATE_PLAYING
        response.state.state = state.STATE_STOPPED if self._plant.paused and self._stopped else now
        return DONE

    def _change(self, request: Any, response: Any) -> Outcome:
        """Play, pause, or stop: pause and begin anew."""
        kind, asked = request.state, request.state.state
        if asked == kind.STATE_QUITTING:
            return unsupported("a simulation ends as it was started: end `fulmar up`, or `fulmar run`.")
        if asked not in (kind.STATE_PLAYING, kind.STATE_PAUSED, kind.STATE_STOPPED):
            return failed(f"state {asked} is none of the standard's.")
        stopped = self._plant.paused and self._stopped
        now = {(False, False): kind.STATE_PLAYING, (True, True): kind.STATE_STOPPED}
        if asked == now.get((self._plant.paused, stopped), kind.STATE_PAUSED):
            return Outcome(words="the simulation is in this state.", code=response.ALREADY_IN_TARGET_STATE)
        outcome = self._plant.pause(asked != kind.STATE_PLAYING)
        if outcome.good and asked == kind.STATE_STOPPED:
            outcome = self._plant.change({"what": RESET})
        self._stopped = outcome.good and asked == kind.STATE_STOPPED
        return outcome

    def _step(self, request: Any, _response: Any) -> Outcome:
        if not self._plant.paused:
            return failed(NOT_PAUSED)
        steps, self._stopped = int(request.steps), False
        for done in range(0, steps, MOST_STEPS):
            outcome = self._plant.steps(min(MOST_STEPS, steps - done))
            if not outcome.good:
                return failed(outcome.words)
        return DONE

    def _begin_steps(self, handle: Any) -> None:
        """Take steps in a thread of their own: the goal can be cancelled meanwhile."""
        threading.Thread(target=self._simulate_steps, args=(handle,), name="steps", daemon=True).start()

    def _simulate_steps(self, handle: Any) -> None:
        """Take steps one by one, with feedback after each."""
        kind, steps, done = interface("action", "SimulateSteps"), int(handle.request.steps), 0
        execute_goal(handle)
        outcome = DONE if self._plant.paused else failed(NOT_PAUSED)
        while outcome.good and done < steps and not handle.is_cancel_requested:
            self._stopped = False
            outcome = self._plant.steps(1)
            done += outcome.good
            handle.publish_feedback(kind.Feedback(completed_steps=done, remaining_steps=steps - done))
        cancelled = outcome.good and done < steps
        (handle.canceled if cancelled else handle.succeed if outcome.good else handle.abort)()
        words = f"{done} of {steps} steps are done. {outcome.words}".strip() if done < steps else ""
        result = kind.Result(result=replace(outcome, words=words).message())
        self._steps.notify_execute(handle, lambda _handle: result)

    def _reset(self, request: Any, _response: Any) -> Outcome:
        scope = request.scope
        if scope not in (DEFAULT, ALL) and scope & TIME:
            return unsupported(
                "simulated time never goes back, for controllers and bags: reset SCOPE_STATE, or by default."
            )
        if scope not in (DEFAULT, ALL) and not scope & STATE:
            return Outcome(words="nothing was spawned.")
        outcome = self._plant.change({"what": RESET})
        return Outcome(words="simulated time goes on.") if outcome.good and scope != STATE else outcome

    def _entities(self, request: Any, response: Any) -> Outcome:
        response.entities, outcome = self._matching(request)
        return outcome

    def _entities_states(self, request: Any, response: Any) -> Outcome:
        response.entities, outcome = self._matching(request)
        found = self._plant.entities(self._name)
        response.states = [found[name].message(self._frames) for name in response.entities]
        return outcome

    def _matching(self, request: Any) -> tuple[list[str], Outcome]:
        names, outcome = matching(request.filters, self._plant.entities(self._name))
        return list(names), outcome

    def _entity_state(self, request: Any, response: Any) -> Outcome:
        entity, outcome = self._found(request.entity)
        if entity is not None:
            response.state = entity.message(self._frames)
        return outcome

    def _found(self, name: str) -> tuple[Entity | None, Outcome]:
        found = self._plant.entities(self._name)
        if name in found:
            return found[name], DONE
        if name == self._name:
            return None, failed("the plant has published no state yet.")
        names = ", ".join(found) or self._name
        return None, Outcome("NOT_FOUND", f"there is no entity '{name}'. There are: {names}.")

    def _set_entity_state(self, request: Any, response: Any) -> Outcome:
        entity, outcome = self._found(request.entity)
        if entity is None:
            return outcome
        if request.entity != self._name or not self._places:
            return unsupported(
                f"this simulator cannot put '{request.entity}' elsewhere, but a robot in MuJoCo or the mock."
            )
        try:
            state = asked_state(request, entity.state, self._frames, self._plant.origin)
        except ConfigError as error:
            return failed(str(error))
        outcome = self._plant.change({"what": PLACE, **state_fields(state)})
        refused = not outcome.good and outcome.name == "INCORRECT_STATE"
        return Outcome(words=outcome.words, code=response.INVALID_POSE) if refused else outcome

    def _spawn(self, _request: Any, _response: Any) -> Outcome:
        return unsupported(SPAWNING)

    def _delete(self, request: Any, _response: Any) -> Outcome:
        entity, outcome = self._found(request.entity)
        return outcome if entity is None else unsupported("the bodies of a plant are there until it ends.")

    def _report(self) -> None:
        paused = self._plant.paused
        silent = not paused and time.monotonic() - self._plant.seen_s > SILENT_S
        words = "the plant publishes no state" if silent else "paused" if paused else "serving"
        values = {"served": str(self._served), "paused": str(paused).lower()}
        self._health.publish("warn" if silent else "ok", words, values)

    def stop(self) -> None:
        """Let no client wait for a plant."""
        self._plant.stop()


def main() -> None:
    """Serve until stopped."""
    sys.exit(run_node(SimulationInterfacesNode))


if __name__ == "__main__":
    main()
