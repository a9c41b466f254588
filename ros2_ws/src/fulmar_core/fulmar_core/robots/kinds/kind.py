"""What all robots of a kind have in common."""

from __future__ import annotations

from dataclasses import dataclass

from fulmar_core.robots.kinds.envelope_axis import EnvelopeAxis
from fulmar_core.states.state import State

FAR_M = 6.0  # robots in the plane are under way for seconds [m]


@dataclass(frozen=True)
class Kind:
    """One kind of vehicle. Poses are as people write them, see `State.NUMBERS` [m, deg]."""

    name: str
    plural: str  # its robots, in words
    state_type: type[State]
    usual_robot: str  # that a task of this kind is tried with
    usual_task: str  # what it does where nothing else is asked for
    usual_estimator: str  # file of configs/estimators that says where it is
    far_goal: tuple[float, ...]  # that it does not reach while a fault is done to it
    # Goals and starts on the command line: the names of their numbers, of `State.NUMBERS`, beside all of these.
    goal_forms: tuple[tuple[str, ...], ...]
    start_forms: tuple[tuple[str, ...], ...]
    other_task: str = ""  # what it does where it cannot do the usual task
    velocity_form: tuple[
        str, ...
    ] = ()  # names of the numbers of --velocity [m/s, deg/s]; empty: it takes none
    velocity_task: str = ""  # the task of --velocity
    height_task: str = ""  # the task of --height; empty: it takes none
    # Goals of so many numbers that are asked back where no task is named, since they could be meant otherwise, and why.
    asked_back: tuple[tuple[int, ...], str] = ((), "")
    # The one task of a goal; empty where a place is a position and with angles a pose.
    goal_task: str = ""
    # What drives it where no policy is shipped; empty where one has to be.
    usual_law: str = ""
    # Training settings of all its robots, a file of `configs/training`; empty: those of the family of actuators.
    recipe: str = ""
    usual_scenario: str = "randomised"  # that it is trained in
    always_estimated: bool = False  # no simulator or driver says where it is: an estimator has to
    goes_anywhere: bool = True  # it has places to go to, and may leave an area
    weighs: bool = True  # gravity pulls it
    drifts: bool = False  # at rest its actuators let it go on; water slows it all the same
    calibrated: tuple[str, ...] = ()  # quantities of its body that identification measures, of `Calibration`
    stays: bool = True  # it can stay where it is; else it flies on for ever
    rests: bool = True  # it comes to no harm at its safe command; else its safe state is a flight down
    tilt_deg: float = 180.0  # largest of the attitudes that it can hold, which tasks draw and ask for [deg]
    obstacle: str = "an obstacle"  # what it runs into, in words
    outdoors: bool = False  # satellite navigation is in its loop
    room: str = (
        "plane"  # where it moves, as pages draw it: plane (water for what swims), space, attitude or flight
    )
    pose_form: str = "pose"  # what of a pose is its goal: pose, pose3 or attitude
    stops: str = ""  # what a stop does beyond its actuators, in words; empty: as it drifts
    # What a certified set of its controllers spans; see `fulmar certify`.
    envelope: tuple[EnvelopeAxis, ...] = ()
    # Of a wrench's six, those along and about which its actuators move it.
    axes: tuple[int, ...] = (0, 1, 2, 3, 4, 5)

    @property
    def lifted(self) -> bool:
        """Whether nothing but what moves it carries its weight."""
        return self.weighs and 2 in self.axes
