"""Parts of a robot that stick or die while it moves, and a supply that falls; the plant knows nothing of it."""

from __future__ import annotations

from collections.abc import Callable

from fulmar_core.config.errors import ConfigError
from fulmar_core.estimators.actuator_health.supply_check import EMPTY
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import SIMULATION_START_NS
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from fulmar_core.worlds.stuck import candidates_of
from fulmar_evaluation.faults.endurance import AFTER_S, DistanceWatch, complaint, endured, resting
from fulmar_evaluation.faults.fault import Fault, Outcome
from fulmar_evaluation.faults.fault_environment import FaultEnvironment
from fulmar_evaluation.faults.live_system import LiveSystem, NothingShown
from fulmar_evaluation.faults.observer import HealthStatus, wait_for

MEASURED_S = 5.0  # until a part is named whose motion is measured
BELIEVED_S = 15.0  # until it is stopped or at its goal, where only the motion of the robot shows it
HIGH_M = 15.0  # for an aircraft to come back to level flight
EMPTIES_S = 90.0  # until a tank of the scenario is empty
COMES_S = 30.0  # by then the scenario has begun to do it


def valve_stuck_open(live: LiveSystem) -> Outcome:
    """A valve or fan stays open, whatever is commanded."""
    return _stuck(live, BELIEVED_S)


def valve_stuck_closed(live: LiveSystem) -> Outcome:
    """A valve or fan stays closed."""
    return _stuck(live, BELIEVED_S)


def surface_stuck(live: LiveSystem) -> Outcome:
    """A control surface runs to half its travel and stays there; its position is measured."""
    return _stuck(live, MEASURED_S, named=True)


def wheel_dead(live: LiveSystem) -> Outcome:
    """The motor of a wheel dies; the speed of wheels, or the motion of the base, is measured."""
    return _stuck(live, MEASURED_S, named=True)


def propeller_lost(live: LiveSystem) -> Outcome:
    """A propeller gives no thrust any more."""
    return _stuck(live, BELIEVED_S, named=True)


def supply_pressure_falls(live: LiveSystem) -> Outcome:
    """The thrust of all valves falls to a tenth within seconds, as from an empty tank."""
    supply = load_scenario(live.plan.scenario).actuation.supply
    distance = DistanceWatch(live)
    since_s = _when(live, supply.from_s)
    return endured(live, since_s, supply.over_s + BELIEVED_S, distance, drifts=True)


def tank_empty(live: LiveSystem) -> Outcome:
    """The tank runs empty: a failure that the plant announces, with how the robot drifts on, and no watchdog trips."""
    since_s = live.until_it_moves()

    def said() -> HealthStatus | None:
        return complaint(live, since_s, lambda words: words.startswith(EMPTY))

    wait_for(lambda: said() is not None, EMPTIES_S)
    status = said()
    if status is None:
        return Outcome("", "no node reported that the tank is empty", False)
    wait_for(lambda: resting(live, status.received_s)[0], AFTER_S)
    closed, closed_s = resting(live, status.received_s)
    trips = max(int(each.values.get("watchdog_trips", 0)) for each in live.observer.statuses_since(since_s))
    words = (
        f"{status.text}; {'the valves are closed' if closed else 'valves open still'}, {trips} watchdog trips"
    )
    return Outcome(status.who, words, closed and trips == 0, closed_s, AFTER_S if closed else None)


def _stuck(live: LiveSystem, limit_s: float, *, named: bool = False) -> Outcome:
    """It is said in time, where it is measured by the name of the part, and the robot is safe.

    Args:
        live: The system.
        limit_s: Until it is said [s].
        named: The words have to name the part.
    """
    task, scenario = load_task(live.plan.task, live.plan.thing), load_scenario(live.plan.scenario)
    world = draw_episode(live.robot, task, scenario, seed=live.plan.seed, number=0).world
    part = live.robot.actuators.parts.names[int(world.stuck_part)]
    distance = None if live.flight is not None else DistanceWatch(live)
    since_s = _when(live, float(world.stuck_from))
    return endured(live, since_s, limit_s, distance, (lambda words: part in words) if named else bool)


def _when(live: LiveSystem, from_s: float) -> float:
    """When a plant applied its first command after a time of its episode, on the monotonic clock [s].

    Raises:
        NothingShown: It did not.
    """
    if live.flight is None:  # an aircraft begins in level flight, and may be out of it by then
        live.until_it_moves()
    due_ns = SIMULATION_START_NS + int(1e9 * from_s)
    if not wait_for(lambda: bool((live.observer.received()[1] >= due_ns).any()), COMES_S):
        raise NothingShown(f"the plant's clock did not reach {from_s:.1f} s, so the fault would show nothing")
    received_s, stamps = live.observer.received()
    return float(received_s[stamps >= due_ns][0])


def _without_parts(scenario: str) -> Callable[[Robot], str]:
    def why_not(robot: Robot) -> str:
        try:
            candidates_of(robot, load_scenario(scenario).actuation.stuck)
        except ConfigError:
            return "it has no such part"
        return ""

    return why_not


def _without_valves(robot: Robot) -> str:
    return "" if robot.actuators.opens_late else "no valves feed it from one supply"


def _without_gauge(robot: Robot) -> str:
    gauged = robot.actuators.tank is not None and robot.sensors.specs.get("supply") is not None
    return "" if gauged else "it has no tank with a gauge"


def _fault(do: Callable[[LiveSystem], Outcome]) -> Fault:
    return Fault(do, FaultEnvironment(scenario=do.__name__, height_m=HIGH_M), _without_parts(do.__name__))


ACTUATOR_FAULTS = (
    *map(_fault, (valve_stuck_open, valve_stuck_closed, surface_stuck, wheel_dead, propeller_lost)),
    Fault(supply_pressure_falls, FaultEnvironment(scenario="supply_falls"), _without_valves),
    Fault(tank_empty, FaultEnvironment(scenario="tank_empty"), _without_gauge),
)
