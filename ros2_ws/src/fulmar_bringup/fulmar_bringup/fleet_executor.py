"""Runs a fleet: one world, one recorder, and for each robot its nodes, its operator and its own end."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from fulmar_bringup.console import log_line
from fulmar_bringup.domains import claimed_domain
from fulmar_bringup.fleet_plan import FleetPlan, fleet_rows, formation_of
from fulmar_bringup.node_keeper import NodeKeeper
from fulmar_bringup.node_spec import CONTROLLER, NodeSpec
from fulmar_bringup.processes import Ended, ProcessGroup
from fulmar_bringup.progress import time_bar
from fulmar_bringup.readiness import CONTROLLER_AND_RECORDER, while_starting
from fulmar_bringup.run_executor import (
    LAST_WORDS_S,
    STOPPED,
    EndWatch,
    Execution,
    passed_s,
    with_ends,
    with_plant_reaction,
)
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.standing_system import report_newest
from fulmar_bringup.supervisor import Supervisor
from fulmar_bringup.system_events import Emit, SystemEvents
from fulmar_core.config.errors import RunFailed
from fulmar_core.robots.topics import SIMULATION_START_NS
from fulmar_ros.runtime import ros_nodes

MORE_S = 15.0  # for each further robot to start: all share the processors of one computer
LOOK_S = 0.05  # between two looks at the robots


@dataclass
class Crew:
    """One robot of a fleet that runs: its plan, its operator and its processes.

    Attributes:
        failure: Why it does not go on; empty while it does.
        finished: Whether it has come to its planned end.
    """

    plan: RunPlan
    overseer: Supervisor
    group: ProcessGroup
    failure: str = ""
    finished: bool = False
    keeper: NodeKeeper = field(init=False)

    def __post_init__(self) -> None:
        self.keeper = NodeKeeper(self.group, self.overseer)

    @property
    def over(self) -> bool:
        """Whether there is nothing more to wait for."""
        return self.finished or bool(self.failure)

    def fail(self, reason: str) -> None:
        """Let this robot rest, and the others go on; in lock step the world waits for it no more."""
        time.sleep(LAST_WORDS_S)
        self.failure = with_plant_reaction(reason, self.overseer)
        log_line(f"{self.plan.robot_name}: {self.failure}")
        if self.plan.lockstep:
            self.overseer.stop_plant()


@dataclass(frozen=True)
class FleetExecution:
    """How the robots of a fleet ended."""

    robots: dict[str, Execution]  # by name
    failure: str  # of what all share; empty if there was none


Watch = Callable[[FleetPlan, list[Crew], NodeKeeper], None]


def execute_fleet(plan: FleetPlan) -> FleetExecution:
    """Run a fleet once; the bag then lies at `plan.record`.

    Raises:
        ConfigError: Another run of one of these names goes on in this ROS domain.
    """
    return run_fleet(plan, _watch_run)


def run_fleet(plan: FleetPlan, watch: Watch) -> FleetExecution:
    """Start every process of a fleet, watch the robots, and stop all in order.

    Args:
        plan: What to run.
        watch: Gets the robots ready and waits for the end; RunFailed ends all.

    Raises:
        ConfigError: As in `execute_fleet`.
    """
    shared_rows, robot_rows = fleet_rows(plan)
    shared, failure, crews, ends = ProcessGroup(), "", list[Crew](), list[Ended]()
    groups = {name: ProcessGroup(label=f"{name}/") for name in robot_rows}
    with contextlib.ExitStack() as claims:
        for one in plan.robots:
            claims.enter_context(claimed_domain(one.robot_name))
        try:
            with _operators(plan, groups) as crews:
                _refuse_living(crews)
                _start(shared, shared_rows, groups, robot_rows)
                try:
                    watch(plan, crews, NodeKeeper(shared, crews[0].overseer))
                except RunFailed as error:
                    failure = str(error)
                except KeyboardInterrupt as stop:
                    failure = str(stop) or STOPPED
                    for crew in crews:
                        crew.overseer.stop_plant()
                for crew in crews:
                    ends += crew.group.stop(CONTROLLER)
        except KeyboardInterrupt as stop:
            failure = str(stop) or STOPPED
        finally:
            every = {name: group.stop_all() for name, group in groups.items()}
            ends += shared.stop_all()
    failure = with_ends(failure, ends)
    return FleetExecution({crew.plan.robot_name: _execution(crew, every) for crew in crews}, failure)


def _execution(crew: Crew, every: dict[str, list[Ended]]) -> Execution:
    failure = with_ends(crew.failure, every[crew.plan.robot_name])
    steps = int(crew.overseer.plant.values.get("steps", 0))
    return Execution(failure, steps, tuple(restart.warning for restart in crew.keeper.restarts))


@contextlib.contextmanager
def _operators(plan: FleetPlan, groups: dict[str, ProcessGroup]) -> Iterator[list[Crew]]:
    errors: list[Exception] = []
    spaces = [one.namespace for one in plan.robots]
    with ros_nodes("supervisor", errors.append, namespaces=spaces) as nodes:
        yield [
            Crew(one, Supervisor(node, one, errors), groups[one.robot_name])
            for node, one in zip(nodes, plan.robots, strict=True)
        ]


def _refuse_living(crews: list[Crew]) -> None:
    for crew in crews:
        crew.overseer.refuse_living_plant()


def _start(
    shared: ProcessGroup,
    shared_rows: list[NodeSpec],
    groups: dict[str, ProcessGroup],
    robot_rows: dict[str, list[NodeSpec]],
) -> None:
    for spec in shared_rows:
        shared.start(spec)
    for name, rows in robot_rows.items():
        for spec in rows:
            groups[name].start(spec)


def get_ready(plan: FleetPlan, crews: list[Crew], keeper: NodeKeeper, *, goals: bool) -> None:
    """Wait for every controller, give each robot its goal, and start the plants.

    Args:
        plan: Of all; a robot of a formation always has a goal, its place.
        crews: The robots.
        keeper: Of what all share.
        goals: Whether each has a goal of its own to be given.

    Raises:
        RunFailed: A node ended, or the nodes did not get ready in time.
    """
    more_s = MORE_S * (len(crews) - 1)
    checks = {crew.plan.robot_name: while_starting(crew.group, crew.overseer, more_s) for crew in crews}

    def starting(crew: Crew) -> Callable[[], None]:
        def alive() -> None:
            keeper.look()
            checks[crew.plan.robot_name]()

        return alive

    for crew in crews:
        controller = crew.overseer.controller
        crew.overseer.wait_until(
            lambda controller=controller: controller.values.get("mode") == "armed",  # type: ignore[misc]
            starting(crew),
        )
        if (goals and not crew.plan.goals) or formation_of(plan, crew.plan):
            assert crew.plan.mission is not None
            crew.overseer.give_goal(
                crew.plan.mission,
                time_ns=SIMULATION_START_NS,
                alive=starting(crew),
                listeners=CONTROLLER_AND_RECORDER,
            )
    for crew in crews:
        crew.overseer.start_plant(starting(crew))


def _watch_run(plan: FleetPlan, crews: list[Crew], keeper: NodeKeeper) -> None:
    """Wait until every robot has come to its planned end, or has failed; one that fails leaves the others alone."""
    get_ready(plan, crews, keeper, goals=True)
    watches = {
        crew.plan.robot_name: EndWatch(
            crew.plan, crew.overseer, crew.keeper, end_on_estop=False, patience=len(crews)
        )
        for crew in crews
    }
    with time_bar("running", plan.duration_s) as moved:
        while not all(crew.over for crew in crews):
            keeper.look()
            for crew in crews:
                if not crew.over:
                    _look(crew, watches[crew.plan.robot_name])
            moved(max(passed_s(crew.plan, crew.overseer.plant) for crew in crews), "")
            time.sleep(LOOK_S)


def _look(crew: Crew, watch: EndWatch) -> None:
    try:
        if watch.finished():
            if watch.errors:
                raise RunFailed(f"plant: {watch.errors[0]}")
            crew.finished = True
            return
        watch.look()
    except RunFailed as error:
        crew.fail(str(error))


def keep_fleet_up(plan: FleetPlan, emit: Emit) -> FleetExecution:
    """Run a fleet until Ctrl-C or SIGTERM; events are as in `SystemEvents`, each with `name`, that of the robot.

    A robot whose node ends rests, and the others stay up; the end of the world, or of every robot, ends all.

    Raises:
        ConfigError: As in `execute_fleet`.
    """

    def watch(plan: FleetPlan, crews: list[Crew], keeper: NodeKeeper) -> None:
        try:
            get_ready(plan, crews, keeper, goals=False)
            _follow(plan, crews, keeper, emit)
        except KeyboardInterrupt as stop:
            emit("stopping", reason=str(stop) or STOPPED)
            raise

    return run_fleet(plan, watch)


def _follow(plan: FleetPlan, crews: list[Crew], keeper: NodeKeeper, emit: Emit) -> None:
    events: dict[str, SystemEvents] = {}
    for crew in crews:
        name, one = crew.plan.robot_name, crew.plan

        def say(event: str, *, name: str = name, **fields: object) -> None:
            emit(event, name=name, **fields)

        events[name] = SystemEvents(say)
        say("started", robot=one.robot, task=one.task, controller=one.controller, bag=plan.record)
    while not all(crew.failure for crew in crews):
        keeper.look()
        for crew in crews:
            report_newest(crew.plan, crew.overseer, events[crew.plan.robot_name], lambda *_: None)
            if crew.failure:
                continue
            try:
                crew.keeper.look()
            except RunFailed as error:
                crew.fail(str(error))
                emit("lost", name=crew.plan.robot_name, reason=crew.failure)
        time.sleep(LOOK_S)
    raise RunFailed("no robot of the fleet is left")
