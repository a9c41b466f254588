"""What pages ask for, done by topics and services that any other client has too."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from fulmar_bringup.estop_robots import release_without_node
from fulmar_console.live.fleet import Fleet
from fulmar_console.live.goals import GoalGiver, targets_of, topic_of
from fulmar_console.live.hands import Hand, HandMapping, mapping_or_problem, wish_of
from fulmar_console.live.pending import Call, InThread, Pending, Requests, Steps
from fulmar_console.live.robot_state import RobotState
from fulmar_console.live.stopping import Stop, StopButton
from fulmar_console.protocol import EVERY
from fulmar_console.source import Answer
from fulmar_core.robots import topics
from fulmar_core.wires.robot_name import check_robot_name, namespace_of

LOOK_S = 0.02  # between two looks at what is under way [s]
LATE_S = 1.0  # after which a command that the ROS side could not take is not done any more [s]
SWAP_S = 25.0  # for another controller to take over [s]
RESET_S = 4.0  # for an e-stop node to answer: it watches the commands first [s]
MOST_STEPS = 1000
MOST_BUTTONS = 256

Do = Callable[[RobotState, Mapping[str, Any], Answer, str], Pending | None]


class Orders:
    """Does what pages ask for, in the thread of the node's executor; presses e-stops in that of the server."""

    def __init__(self, node: Node, fleet: Fleet) -> None:
        """Begin."""
        self._node, self._fleet = node, fleet
        self._asked: deque[tuple[float, Callable[[], Pending | None], Answer]] = deque()
        self._pending: list[tuple[Pending, Answer]] = []
        self._buttons: dict[str, StopButton] = {}
        self._givers: dict[str, GoalGiver] = {}
        self._clients: dict[str, Any] = {}
        self._hands: dict[str, Hand] = {}
        self._mappings: dict[str, HandMapping | str] = {}  # by type; a text: why there is none
        self._requests = Requests(node)
        self._ways: dict[str, Do] = {
            "reset": self._reset, "goal": self._goal, "start": self._start, "stop": self._end, "pause": self._pause,
            "step": self._step, "rate": self._rate, "disturb": self._disturb, "controller": self._controller,
            "teleop": self._teleop, "give_back": self._give_back,
        }  # fmt: skip
        self._noted = ("reset", "start", "stop", "pause", "step", "rate", "controller", "give_back")
        node.create_timer(LOOK_S, self._work, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def do(self, command: Mapping[str, Any], answer: Answer, client: str) -> None:
        """Do what a page asks, from any thread."""
        if command["do"] == "estop":
            self._stop(str(command.get("robot") or EVERY), answer, client)
            return
        robot = self._fleet.robots.get(str(command.get("robot")))
        if robot is None and command["do"] == "reset" and command.get("robot") == EVERY:
            self._reset_all(answer, client)
        elif robot is None:
            answer(False, "that robot is not known")
        else:
            answer = self._noting(robot, command, answer, client)
            self._queue(partial(self._ways[command["do"]], robot, command, answer, client), answer)

    def soon(self, work: Callable[[], None]) -> None:
        """Call something in the thread of the executor."""
        self._queue(work, lambda _done, _words: None)

    def forget(self, client: str) -> None:
        """A page has gone, from any thread."""
        now_s = time.monotonic()
        for hand in list(self._hands.values()):
            hand.forget(client, now_s)

    def close(self) -> None:
        """Let go of every robot."""
        for hand in list(self._hands.values()):
            if hand.owner:
                hand.forget(hand.owner, time.monotonic())
                hand.send(time.monotonic())

    def _noting(self, robot: RobotState, command: Mapping[str, Any], answer: Answer, client: str) -> Answer:
        """An answer that notes what was done, for other pages."""
        if command["do"] not in self._noted:
            return answer

        def note(done: bool, words: str) -> None:
            if done:
                with self._fleet.lock:
                    robot.note_command(client, f"{command['do']}: {words}" if words else command["do"])
            answer(done, words)

        return note

    def _queue(self, work: Callable[[], Any], answer: Answer) -> None:
        self._asked.append((time.monotonic(), work, answer))

    def _work(self) -> None:
        now_s = time.monotonic()
        for name, robot in list(self._fleet.robots.items()):
            self._button(name).see(robot.estopped)
            self._give_ready(robot, now_s)
        while self._asked:
            asked_s, work, answer = self._asked.popleft()
            waited_s = time.monotonic() - asked_s
            if waited_s > LATE_S:
                answer(False, f"not done: the console's ROS side hung for {waited_s:.1f} s. Ask again.")
            else:
                self._begin(work, answer)
        now_s = time.monotonic()
        self._pending = [
            (each, answer) for each, answer in self._pending if not self._over(each, answer, now_s)
        ]
        for hand in list(self._hands.values()):
            hand.send(now_s)

    def _begin(self, work: Callable[[], Any], answer: Answer) -> None:
        """Do something; a mistake in it is the asker's to know, and ends nothing else."""
        try:
            begun = work()
        except Exception as error:  # noqa: BLE001 - whatever it is
            self._fail(answer, error)
        else:
            if begun is not None:
                self._pending.append((begun, answer))

    def _over(self, pending: Pending, answer: Answer, now_s: float) -> bool:
        try:
            return pending.step(now_s)
        except Exception as error:  # noqa: BLE001 - as above
            self._fail(answer, error)
            return True

    def _fail(self, answer: Answer, error: Exception) -> None:
        words = f"{type(error).__name__}: {error}"
        self._node.get_logger().error(f"a command failed: {words}")
        answer(False, words)

    def _client(self, kind: type, service: str) -> Any:
        if service not in self._clients:
            self._clients[service] = self._node.create_client(kind, service)
        return self._clients[service]

    def _button(self, name: str) -> StopButton:
        with self._fleet.lock:
            if name not in self._buttons:
                self._buttons[name] = StopButton(self._node, name)
            return self._buttons[name]

    def _give_ready(self, robot: RobotState, now_s: float) -> None:
        """A publisher for goals of a robot that runs, before the first goal, and another where its task changed."""
        giver = self._givers.get(robot.name)
        if giver is not None and giver.topic != topic_of(robot):
            giver.destroy()
            giver = self._givers.pop(robot.name)
            giver = None
        if giver is None and robot.info is not None and robot.running:
            self._givers[robot.name] = GoalGiver(self._node, robot)
        elif giver is not None:
            giver.look(now_s)

    def _stop(self, robot: str, answer: Answer, client: str) -> None:
        """Press at once, in the caller's thread: the executor may hang, or be late."""
        began_s = time.monotonic()
        names = [robot]
        if robot == EVERY:
            names = list(self._fleet.robots)
        elif robot not in self._fleet.robots:  # a page may know it from before this console began
            try:
                check_robot_name(robot)
            except ValueError as error:
                answer(False, str(error))
                return
            if len(self._buttons) >= MOST_BUTTONS:
                answer(False, "that robot is not known")
                return
        for name in names:
            self._button(name).press(client)
        self._node.get_logger().warning(f"{client} stops {', '.join(names) or 'all robots: none is known'}")
        now = (lambda: list(self._fleet.robots)) if robot == EVERY else (lambda: names)
        stop = Stop(now, lambda name: self._button(name).press(client), self._fleet.robots, answer, began_s)
        self._asked.append((float("inf"), lambda: stop, answer))

    def _reset_all(self, answer: Answer, client: str) -> None:
        """Reset every robot that is stopped, and answer once all have."""
        stopped = [robot for robot in self._fleet.robots.values() if robot.estopped]
        came: dict[str, tuple[bool, str]] = {}

        def take(name: str, done: bool, words: str) -> None:
            came[name] = done, words
            if len(came) == len(stopped):
                text = "; ".join(f"{name}: {words}" for name, (_, words) in sorted(came.items()))
                answer(all(done for done, _ in came.values()), text)

        if not stopped:
            answer(False, "no robot is stopped")
        for robot in stopped:
            command = {"do": "reset", "robot": robot.name}
            own = self._noting(robot, command, partial(take, robot.name), client)
            self._queue(partial(self._reset, robot, command, own, client), own)

    def _reset(self, robot: RobotState, _command: Mapping[str, Any], answer: Answer, _by: str) -> Pending:
        space = namespace_of(robot.name)
        client = self._client(Trigger, f"{space}/{topics.ESTOP_RESET}")
        if client.service_is_ready():
            return Call(client, Trigger.Request(), answer, "released", answer_s=RESET_S)
        return InThread(release_without_node, (self._node, space), answer)

    def _goal(self, robot: RobotState, command: Mapping[str, Any], answer: Answer, by: str) -> Pending | None:
        targets = targets_of(command)
        if isinstance(targets, str):
            answer(False, targets)
            return None
        giver = self._givers.get(robot.name)
        if giver is None:
            giver = self._givers[robot.name] = GoalGiver(self._node, robot)
        return giver.give(targets, answer, by)

    def _start(self, robot: RobotState, _command: Mapping[str, Any], answer: Answer, _by: str) -> Pending:
        return self._change(robot, Transition.TRANSITION_ACTIVATE, "the plant runs", answer)

    def _end(self, robot: RobotState, _command: Mapping[str, Any], answer: Answer, _by: str) -> Pending:
        return self._change(robot, Transition.TRANSITION_DEACTIVATE, "the plant has stopped", answer)

    def _change(self, robot: RobotState, transition: int, words: str, answer: Answer) -> Pending:
        client = self._client(ChangeState, f"{namespace_of(robot.name)}/plant/change_state")
        return Call(client, ChangeState.Request(transition=Transition(id=transition)), answer, words)

    def _pause(self, robot: RobotState, command: Mapping[str, Any], answer: Answer, _by: str) -> Pending:
        paused = command["paused"] is True
        client = self._client(SetBool, f"{namespace_of(robot.name)}/{topics.SIMULATION_PAUSE}")
        return Call(client, SetBool.Request(data=paused), answer, "paused" if paused else "goes on")

    def _step(
        self, robot: RobotState, command: Mapping[str, Any], answer: Answer, _by: str
    ) -> Pending | None:
        steps = command.get("steps", 1)
        if type(steps) is not int or not 0 < steps <= MOST_STEPS:
            answer(False, f"'steps' is {steps!r}, must be a whole number from 1 to {MOST_STEPS}")
            return None
        client = self._client(Trigger, f"{namespace_of(robot.name)}/{topics.SIMULATION_STEP}")
        words = "one control step on" if steps == 1 else f"{steps} control steps on"

        def say(done: bool, said: str) -> None:
            answer(done, words if done else said)

        return Steps(lambda take: Call(client, Trigger.Request(), take, words), steps, say)

    def _rate(self, robot: RobotState, command: Mapping[str, Any], answer: Answer, by: str) -> Pending:
        content = {"rate": command["rate"], "by": by}
        return self._ask(robot, (topics.SIMULATION_RATE, topics.SIMULATION_RESULT), content, answer)

    def _disturb(
        self, robot: RobotState, command: Mapping[str, Any], answer: Answer, by: str
    ) -> Pending | None:
        if not isinstance(command["what"], dict):
            answer(False, "a disturbance is an object with 'what' and its fields")
            return None
        content = {**command["what"], "by": by}
        return self._ask(robot, (topics.SIMULATION_DISTURB, topics.SIMULATION_RESULT), content, answer)

    def _controller(self, robot: RobotState, command: Mapping[str, Any], answer: Answer, by: str) -> Pending:
        content = {"controller": str(command["controller"]), "by": by}
        return self._ask(robot, (topics.SWAP, topics.SWAP_RESULT), content, answer, SWAP_S)

    def _ask(
        self,
        robot: RobotState,
        wires: tuple[topics.Wire, topics.Wire],
        content: Mapping[str, Any],
        answer: Answer,
        within_s: float = 5.0,
    ) -> Pending:
        return self._requests.ask(namespace_of(robot.name), wires, content, answer, within_s)

    def _teleop(
        self, robot: RobotState, command: Mapping[str, Any], answer: Answer, by: str
    ) -> Pending | None:
        wish = wish_of(command)
        if isinstance(wish, str):
            answer(False, wish)
            return None
        mapping = self._mappings.get(robot.type)
        if robot.type not in self._mappings:
            self._mappings[robot.type] = "not yet: the robot's file is being read"
            return InThread(self._make_mapping, (robot.type,), answer)
        if not isinstance(mapping, HandMapping):
            answer(False, mapping or "a person cannot drive it")
            return None
        hand = self._hands.get(robot.name)
        if hand is None:
            hand = self._hands[robot.name] = Hand(self._node, robot, mapping)
        refused = hand.drive(by, wish, time.monotonic())
        answer(not refused, refused)
        return None

    def _make_mapping(self, kind: str) -> tuple[bool, str]:
        mapping, problem = mapping_or_problem(kind)
        self._mappings[kind] = mapping or problem
        return mapping is not None, problem

    def _give_back(self, robot: RobotState, _command: Mapping[str, Any], answer: Answer, _by: str) -> Pending:
        hand = self._hands.get(robot.name)

        def take(done: bool, words: str) -> None:
            if done and hand is not None:
                hand.give_back()
            answer(done, words)

        client = self._client(Trigger, f"{namespace_of(robot.name)}/{topics.GIVE_BACK}")
        return Call(client, Trigger.Request(), take, "given back")
