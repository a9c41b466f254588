"""Profile of one control step of the live controller node, and the lock-step rate of a plant and a controller.

`make profile-step` runs it. With `--against DIR` it measures another checkout too, with that checkout's own `.venv`, in
turns with this one, and prints the ratio. This file therefore runs under both, and imports only what both have.

A step is profiled in lock step in the thread of the executor: `answer` from the callback of the odometry to the publish
of the command, `cycle` from one command to the next, with everything that the thread receives and reports in between.
Python calls and the files that they enter are counted; calls of C functions are not.
"""

from __future__ import annotations

import argparse
import json
import os
import runpy
import signal
import statistics
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

WARM_UP_STEPS = 300  # not counted: discovery, first calls, caches
# Steps that are timed together; of all blocks the median counts, so that one in which a pair was held does not.
BLOCK_STEPS = 25
TURN_S = 0.5
CONTROLLERS = ("lqr", "policy")
ROOT = Path(__file__).resolve().parents[2]


@dataclass
class Calls:
    """Python calls, and where they go."""

    count: int = 0
    files: set[str] = field(default_factory=set)

    def figures(self) -> dict[str, object]:
        return {"calls": self.count, "files": len(self.files), "names": sorted(self.files)}


class Profiler:
    """Counts what the thread of the executor does; call `begin` at each odometry and `end` after each command."""

    def __init__(self) -> None:
        self.answers: list[Calls] = []
        self.cycles: list[Calls] = []
        self._answer: Calls | None = None
        self._cycle = Calls()

    def begin(self) -> None:
        self._answer = self._answer or Calls()  # an odometry that waits for another message begins once
        sys.setprofile(self._note)

    def end(self) -> None:
        if self._answer is not None:
            self.answers.append(self._answer)
            self.cycles.append(self._cycle)
        self._answer, self._cycle = None, Calls()

    def _note(self, frame: object, event: str, _argument: object) -> None:
        if event != "call":
            return
        file = frame.f_code.co_filename
        if file == __file__:
            return
        for calls in (self._answer, self._cycle):
            if calls is not None:
                calls.count += 1
                calls.files.add(file)


class Stopwatch:
    """Notes how long each block of steps takes."""

    def __init__(self) -> None:
        self.blocks_s: list[float] = []
        self._steps, self._began_s = 0, time.perf_counter()

    def begin(self) -> None:
        pass

    def end(self) -> None:
        self._steps += 1
        if self._steps % BLOCK_STEPS == 0:
            now_s = time.perf_counter()
            self.blocks_s.append(now_s - self._began_s)
            self._began_s = now_s


def serve(arguments: argparse.Namespace) -> None:
    """Start a plant, run the controller node in this process for some steps, and print the figures."""
    from fulmar_bringup.processes import command_line
    from fulmar_bringup.run_plan import RunPlan
    from fulmar_bringup.system_rows import system_rows
    from fulmar_core.robots.robot_file import load_robot
    from fulmar_core.tasks import load_task
    from fulmar_core.tasks.goal import goal_at
    from fulmar_ros.controller_node import ControllerNode
    from fulmar_ros.controller_wires import ControllerWires
    from fulmar_ros.goal_messages import goal_message
    from policy_server.controllers import policies_directory

    policy = policies_directory() / f"{arguments.robot}_{arguments.task}"
    plan = RunPlan(
        arguments.robot,
        arguments.task,
        arguments.controller,
        arguments.backend,
        control_hz=load_robot(arguments.robot).timing.control_hz,
        policy=str(policy) if arguments.controller == "policy" else "",
        lockstep=True,
    )
    watch = Profiler() if arguments.mode == "profile" else Stopwatch()
    on_odometry, publish_command = ControllerNode._on_odometry, ControllerWires.publish_command
    topic = load_task(arguments.task).goal_topic
    steps, given = 0, False

    def begin(node: ControllerNode, message: object) -> None:
        nonlocal given
        if not given:
            given = True
            node._on_goal(goal_message(goal_at((2.0, 1.0, 0.5)), topic, 1), {})
        if steps >= WARM_UP_STEPS:
            watch.begin()
        on_odometry(node, message)

    def end(wires: ControllerWires, *command: object) -> None:
        nonlocal steps
        publish_command(wires, *command)
        steps += 1
        if steps == WARM_UP_STEPS:
            say("warm")
        if steps > WARM_UP_STEPS:
            watch.end()
        if steps == WARM_UP_STEPS + arguments.steps:
            sys.setprofile(None)
            say(json.dumps(_figures(watch)))
            os._exit(0)  # the last words of a node would wait for the plant

    ControllerNode._on_odometry, ControllerWires.publish_command = begin, end
    rows = system_rows(plan)
    subprocess.Popen(command_line(rows["plant"]), stdout=subprocess.DEVNULL)
    _, _, module, *sys.argv = command_line(rows["controller"])
    sys.argv.insert(0, module)
    runpy.run_module(module, run_name="__main__", alter_sys=True)


def say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def _figures(watch: Profiler | Stopwatch) -> dict[str, object]:
    if isinstance(watch, Stopwatch):
        return {"steps_per_s": BLOCK_STEPS / statistics.median(watch.blocks_s)}
    return {"answer": _median(watch.answers), "cycle": _median(watch.cycles)}


def _median(steps: list[Calls]) -> dict[str, object]:
    """The step in the middle, by the number of its calls."""
    return sorted(steps, key=lambda step: step.count)[len(steps) // 2].figures()


class Pair:
    """A plant and a controller of one checkout, in processes and a ROS domain of their own."""

    def __init__(
        self, root: Path, controller: str, mode: str, domain: int, arguments: argparse.Namespace
    ) -> None:
        steps = arguments.steps if mode == "profile" else arguments.rate_steps
        command = [root / ".venv" / "bin" / "python", __file__, "--serve", "--mode", mode]
        command += ["--steps", str(steps)]
        command += ["--controller", controller, "--robot", arguments.robot, "--task", arguments.task]
        own = {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        self.root = root
        self._process = subprocess.Popen(
            [*command, "--backend", arguments.backend],
            cwd=root,
            env={**os.environ, **own},
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def wait_until_warm(self) -> None:
        """Wait for the steps that are not counted."""
        self._line()

    @property
    def over(self) -> bool:
        """Whether the controller made all its steps."""
        return self._process.poll() is not None

    def send(self, number: int) -> None:
        """Send a signal to plant and controller."""
        os.killpg(self._process.pid, number)

    def figures(self) -> dict:
        """What the pair measured, once it is over."""
        return json.loads(self._line())

    def end(self) -> None:
        """Leave no process behind."""
        self.send(signal.SIGKILL)
        self._process.wait()

    def _line(self) -> str:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self.end()
            sys.exit(f"{self.root}: the controller ended before its steps were made; its output is above.")
        return line


def profiled(root: Path, controller: str, domain: int, arguments: argparse.Namespace) -> dict:
    """Files and calls of a step."""
    pair = Pair(root, controller, "profile", domain, arguments)
    try:
        pair.wait_until_warm()
        return pair.figures()
    finally:
        pair.end()


def timed(
    roots: list[Path], controller: str, domains: list[int], arguments: argparse.Namespace
) -> list[float]:
    """Steps a second of every checkout's pair, all alive at once but running in turns of a moment."""
    pairs: list[Pair] = []
    try:
        for root, domain in zip(roots, domains, strict=True):
            pairs.append(Pair(root, controller, "rate", domain, arguments))
        for pair in pairs:
            pair.wait_until_warm()
        for pair in pairs:
            pair.send(signal.SIGSTOP)
        while not all(pair.over for pair in pairs):
            for pair in pairs:
                if not pair.over:
                    pair.send(signal.SIGCONT)
                    time.sleep(TURN_S)
                    pair.send(signal.SIGSTOP)
        return [pair.figures()["steps_per_s"] for pair in pairs]
    finally:
        for pair in pairs:
            pair.end()


def compare(arguments: argparse.Namespace) -> None:
    """Profile every checkout, measure their rates in turns, and print both."""
    from fulmar_bringup.domains import reserved_domains

    roots = [ROOT, *([Path(arguments.against).resolve()] if arguments.against else [])]
    with reserved_domains(len(roots)) as domains:
        for controller in CONTROLLERS:
            for root in roots:
                found = profiled(root, controller, domains[0], arguments)
                for part, figures in found.items():
                    say(
                        f"{controller} {part}: {figures['files']} files, {figures['calls']} calls  {root.name}"
                    )
                    if arguments.names:
                        say("   " + "\n   ".join(figures["names"]))
            rates = timed(roots, controller, list(domains), arguments)
            for root, rate in zip(roots, rates, strict=True):
                say(f"{controller} lock step: {rate:.0f} steps/s  {root.name}")
            if len(roots) == 2:
                say(f"{controller} lock step: {rates[0] / rates[1]:.2f} times {roots[1].name}")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--against", metavar="DIR", help="another checkout, with a .venv of its own")
    parser.add_argument("--robot", default="floating_platform")
    parser.add_argument("--task", default="go_to_pose")
    parser.add_argument(
        "--backend", default="mujoco", help="of the plant: mujoco, or mock for no physics at all"
    )
    parser.add_argument("--steps", type=int, default=300, help="profiled steps")
    parser.add_argument("--rate-steps", type=int, default=6000, help="timed steps of each pair")
    parser.add_argument("--names", action="store_true", help="list the files")
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--controller", help=argparse.SUPPRESS)
    parser.add_argument("--mode", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    serve(arguments) if arguments.serve else compare(arguments)


if __name__ == "__main__":
    main()
