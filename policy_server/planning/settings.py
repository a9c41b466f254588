"""What a planner is told in `configs/controllers/<robot>_planner.yaml`."""

from __future__ import annotations

from dataclasses import dataclass

from fulmar_core.ranges import at_least_1, positive, shares


@dataclass(frozen=True)
class PlannerSettings:
    """How plans are made and followed."""

    lead_s: float  # for how long the policy's own drive is followed while the plan is made [s]
    legs: int  # waypoints of a plan
    nodes: int  # of each leg
    reach: float  # how near plans pass waypoints, as a share of what the task takes for passed [-]
    caution: float  # factor on that for each plan that had to be given up on a course [-]
    rounds: int  # of looking for another way: a detour somewhere, then optimal control again
    detours: int  # tried in each round
    detour_s: tuple[float, float]  # how long they hold commands [s]
    lost: float  # distance from the plan beyond which it is given up [m]
    late_s: float  # how late a waypoint may be passed before the plan is given up [s]
    position: float  # cost of a metre beside the plan for one control step [1/m²]
    heading: float  # of a radian [1/rad²]
    motion: float  # of a metre a second, and a radian a second [s²/m²]
    change: float  # of commands that change otherwise than planned, as far as they slew [-]

    def __post_init__(self) -> None:
        """Refuse what no plan can be made with."""
        at_least_1(legs=self.legs, nodes=self.nodes, detours=self.detours)
        positive(
            lead_s=self.lead_s,
            lost=self.lost,
            late_s=self.late_s,
            position=self.position,
            heading=self.heading,
            motion=self.motion,
            change=self.change,
        )
        shares(reach=self.reach, caution=self.caution)
        if self.rounds < 0 or self.reach == 0.0 or not 0.0 < self.detour_s[0] <= self.detour_s[1]:
            raise ValueError(
                "'rounds' must not be negative, 'reach' not 0, 'detour_s' [low, high], 0 < low <= high."
            )
