"""What a planner is told in `configs/controllers/<robot>_planner.yaml`."""

from __future__ import annotations

from dataclasses import dataclass

from fulmar_core.ranges import at_least_1, positive, shares


@dataclass(frozen=True)
class PlannerSettings:
    """How plans are made and followed."""

    lead_s: float  # for how long the policy's own drive is followed while the plan is made [s]
    soon_s: float  # how much longer at most, to begin the plan where a waypoint is passed [s]
    legs: int  # waypoints of a plan
    nodes: int  # of each leg
    reach: float  # how near plans pass waypoints, as a share of what the task takes for passed [-]
    most: float  # how near where that takes too long, as such a share [-]
    sure: float  # how near they must be passed when a plan is tried, as such a share; what is not is passed nearer [-]
    caution: float  # factor on `reach` for each plan that had to be given up on a course [-]
    width: int  # ways that are kept from leg to leg
    tries: int  # in which each of them goes on
    ahead: int  # waypoints after which they are compared
    held_s: tuple[float, float]  # how long a try holds commands before the controller drives [s]
    solved: int  # of the ways found, how many optimal control makes quicker
    lost: float  # distance from the plan beyond which it is given up [m]
    believed: float  # how near a waypoint is believed to be passed, as a share of the same [-]
    late_s: float  # how late a waypoint may be passed before the plan is given up [s]
    trust: float  # share of what a reading differs by from what is expected that is believed [-]
    carried: float  # how far from where it is expected a boat is read if it was carried there [m]
    position: float  # cost of a metre beside the plan for one control step [1/m²]
    heading: float  # of a radian [1/rad²]
    motion: float  # of a metre a second, and a radian a second [s²/m²]
    change: float  # of commands that change otherwise than planned, as far as they slew [-]

    def __post_init__(self) -> None:
        """Refuse what no plan can be made with."""
        at_least_1(
            legs=self.legs,
            nodes=self.nodes,
            width=self.width,
            tries=self.tries,
            ahead=self.ahead,
            solved=self.solved,
        )
        positive(
            lead_s=self.lead_s,
            soon_s=self.soon_s,
            lost=self.lost,
            late_s=self.late_s,
            carried=self.carried,
            position=self.position,
            heading=self.heading,
            motion=self.motion,
            change=self.change,
        )
        shares(
            trust=self.trust,
            believed=self.believed,
            reach=self.reach,
            most=self.most,
            sure=self.sure,
            caution=self.caution,
        )
        if not 0.0 < self.held_s[0] <= self.held_s[1]:
            raise ValueError("'held_s' must be [low, high], 0 < low <= high.")
