"""The same flights through ROS: a controller in a process of its own, killed in flight, and the plant that flies on.

Lock step cannot go on without a controller: its plant would wait for an answer that never comes. So it is flown to the
kill in lock step, and from there on the plant goes by its own simulated time. In real time nothing changes at the kill.
"""

from __future__ import annotations

import gc
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import rclpy
from nav_msgs.msg import Odometry
from rclpy.lifecycle import TransitionCallbackReturn

from fulmar_benchmarks.descent.flights import TASK, Descent, DescentLog, Flights
from fulmar_bringup.domains import own_domain
from fulmar_bringup.processes import ProcessGroup, command_line
from fulmar_bringup.readiness import while_starting
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.supervisor import Supervisor, supervisor
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.topics import SIMULATION_START_NS, TRUTH
from fulmar_core.safety.input_gate import Measurement
from fulmar_core.simulation.backend import Sample
from fulmar_core.simulation.episode import Episode
from fulmar_core.states.spatial import SpatialState
from fulmar_ros.convert import OdometryReader
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.qos import subscriber_qos
from fulmar_ros.runtime import spinning
from sim_nodes.sim_node import make_backend


def fly_in_lockstep(flights: Flights, number: int) -> Descent:
    """One flight, in lock step up to the kill, then by the plant's own time.

    Raises:
        RunFailed: A node did not come up, or ended before it was killed.
        LockstepError: The controller did not answer in time.
    """
    # Plants of earlier flights, exempt from collection by `settle_memory`, stay in the graph of their domain until it.
    gc.unfreeze()
    gc.collect()
    plan, episode = _plan(flights, number, lockstep=True), flights.drawn(np.array([number]))[0]
    with _controller_of(plan) as (group, overseer):
        plant = PlantNode(
            make_backend, lambda _code: None, cli_args=command_line(system_rows(plan)["plant"])[3:]
        )
        with spinning(plant, overseer.fail):
            try:
                if plant.trigger_configure() != TransitionCallbackReturn.SUCCESS:
                    raise RunFailed(f"the plant could not be configured: {plant.health.reason}")
                return _killed_in_lockstep(flights, number, plant, group, overseer, episode)
            finally:
                plant.stop()


def _killed_in_lockstep(
    flights: Flights,
    number: int,
    plant: PlantNode,
    group: ProcessGroup,
    overseer: Supervisor,
    episode: Episode,
) -> Descent:
    robot, over, log = flights.craft, threading.Event(), DescentLog(flights.craft, number)
    dt, newest, ticks = robot.timing.physics_dt, list[Sample](), [0]
    overseer.give_goal(episode.goal, time_ns=plant.clock.now_ns, alive=while_starting(group, overseer))
    steps = round(flights.killed_s(number) * flights.control_hz)
    plant.run_episode(
        episode,
        number=number,
        seed=flights.seed,
        steps=steps,
        on_step=lambda sample, _command: newest.__setitem__(slice(None), [sample]),
    )
    _kill(group)

    def on_step(sample: Sample, _command: np.ndarray) -> None:
        ticks[0] += 1
        assert sample.truth is not None
        log.add(SpatialState.from_rigid(sample.truth), dt * ticks[0])
        if log.down:
            over.set()

    plant.fly_on(newest[0], ticks=round(flights.longest_s / dt), stop=over, on_step=on_step)
    return log.descent()


def fly_in_real_time(flights: Flights, number: int) -> Descent:
    """One flight in real time, plant and controller in processes of their own.

    Raises:
        RunFailed: A node did not come up, or ended before it was killed.
    """
    plan, episode = _plan(flights, number, lockstep=False), flights.drawn(np.array([number]))[0]
    plan = replace(plan, start=SpatialState.written(episode.start.pose))
    with _controller_of(plan) as (group, overseer):
        group.start(system_rows(plan)["plant"])
        track = _Track(plan)
        with spinning(track.node, overseer.fail):
            alive = while_starting(group, overseer)
            overseer.give_goal(episode.goal, time_ns=SIMULATION_START_NS, alive=alive)
            overseer.start_plant(alive, lambda: group.last_words("plant"))
            track.wait_until(SIMULATION_START_NS + round(1e9 * flights.killed_s(number)), alive)
            killed_ns = track.newest_ns
            _kill(group)
            return track.descent(DescentLog(flights.craft, number), killed_ns, flights.longest_s)


class _Track:
    """The true states that a plant publishes."""

    def __init__(self, plan: RunPlan) -> None:
        self.node = rclpy.create_node("track", namespace=plan.namespace)
        self._read = OdometryReader(plan.frames)
        self._states: list[Measurement] = []
        self.node.create_subscription(
            Odometry, TRUTH.name, self._on_truth, subscriber_qos(TRUTH, reliable=True, depth=1000), raw=True
        )

    def _on_truth(self, data: bytes) -> None:
        read = self._read.read(data)
        if read is not None:
            self._states.append(read)

    @property
    def newest_ns(self) -> int:
        """Stamp of the newest state, 0 before the first [ns]."""
        return self._states[-1].stamp_ns if self._states else 0

    def wait_until(self, stamp_ns: int, alive: object) -> None:
        """Wait for a state of a time [ns].

        Raises:
            RunFailed: It does not come; `alive` says why where it can.
        """
        until = time.monotonic() + 60.0
        while self.newest_ns < stamp_ns:
            if callable(alive):
                alive()
            if time.monotonic() > until:
                raise RunFailed("the plant published no true state of the time of the kill within 60 s")
            time.sleep(0.002)

    def descent(self, log: DescentLog, killed_ns: int, longest_s: float) -> Descent:
        """What came of a flight after the kill."""
        taken = 0
        until = time.monotonic() + 2.0 * longest_s
        while not log.down and time.monotonic() < until:
            for state in self._states[taken:]:
                taken += 1
                seconds = (state.stamp_ns - killed_ns) / 1e9
                if seconds > longest_s:
                    return log.descent()
                if seconds > 0.0:
                    log.add(SpatialState.from_rigid(state.state), seconds)
            time.sleep(0.02)
        return log.descent()


def _plan(flights: Flights, number: int, *, lockstep: bool) -> RunPlan:
    return RunPlan(
        robot=flights.robot,
        task=TASK,
        controller=flights.controller,
        backend="mujoco",
        control_hz=flights.control_hz,
        policy=flights.policy,
        scenario=flights.scenario,
        seed=flights.seed if lockstep else flights.seed + number,
        lockstep=lockstep,
        supervised=True,
    )


@contextmanager
def _controller_of(plan: RunPlan) -> Iterator[tuple[ProcessGroup, Supervisor]]:
    """The controller's process in a ROS domain of its own, and who watches it; all ended in the end."""
    with own_domain():
        group = ProcessGroup()
        try:
            group.start(system_rows(plan)["controller"])
            with supervisor(plan) as overseer:
                yield group, overseer
        finally:
            group.stop_all()


def _kill(group: ProcessGroup) -> None:
    """SIGKILL, and wait until the process is gone: nothing answers after that."""
    process = group.process("controller")
    process.kill()
    process.wait()
