"""Plans are made beside the control loop: CasADi lets go of the interpreter while IPOPT works."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor

from policy_server.planning.program import Drive, Program
from policy_server.planning.reference import Reference
from policy_server.planning.search import Guess, Order, Search
from policy_server.planning.trial import Trial

_TRIALS = (
    3  # of a plan at most; waypoints missed in one are passed nearer in the next, and in the last are missed
)


class Solvers:
    """Threads that make guesses quick; each has programs of its own, written when they are first needed."""

    def __init__(self, make: Callable[[int], Program], count: int | None = None) -> None:
        """Begin none yet.

        Args:
            make: Writes the program for a number of legs; takes a second.
            count: Threads at most; one for each core that we may use by default.
        """
        self._make, self._own = make, threading.local()
        self._pool = ThreadPoolExecutor(count or len(os.sched_getaffinity(0)), thread_name_prefix="solver")

    def warm_up(self, lengths: Iterable[int]) -> None:
        """Have one thread ready for drives of so many legs, so that the first plan does not wait for it."""
        self._pool.submit(lambda: [self._program(legs) for legs in lengths]).result()

    def take_work(self) -> bool:
        """Whether there will be anybody to solve what is asked for; not in a process that ends."""
        try:
            self._pool.submit(bool)
        except RuntimeError:
            return False
        return True

    def __call__(self, guesses: Iterable[Guess]) -> Iterable[Drive | None]:
        """As `search.Solve`."""
        return self._pool.map(self._solve, guesses)

    def _solve(self, guess: Guess) -> Drive | None:
        later, legs = guess.drive.since(guess.kept), slice(guess.kept, len(guess.drive.leg_s))
        found = self._program(len(later.leg_s)).solve(
            later,
            guess.course[legs],
            wanted=guess.wanted - guess.kept,
            reach=guess.reach[legs],
            most=guess.most[legs],
        )
        return found if found is None else guess.drive.before(guess.kept).then(found)

    def _program(self, legs: int) -> Program:
        programs: dict[int, Program] = self._own.__dict__.setdefault("programs", {})
        if legs not in programs:
            programs[legs] = self._make(legs)
        return programs[legs]


class Planning:
    """One thread that searches while the robot drives."""

    def __init__(self, search: Search, trial: Trial) -> None:
        """What it works with; nobody else's."""
        self._search, self._trial = search, trial
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="planner")

    def begin(self, orders: list[Order]) -> Future[list[Reference | None]]:
        """Have plans made.

        Returns:
            What to follow for each order; None where there is no plan.
        """
        return self._pool.submit(self._work, orders)

    def _work(self, orders: list[Order]) -> list[Reference | None]:
        courses = self._search.plans(orders)
        found: dict[int, Reference] = {}
        on_trial = [number for number, course in enumerate(courses) if course.best is not None]
        for left in reversed(range(_TRIALS)):
            if not on_trial:
                break
            tried = self._trial.drive([courses[number] for number in on_trial])
            found |= {number: one.reference for number, one in zip(on_trial, tried, strict=True)}
            failed = {
                number: one.missed for number, one in zip(on_trial, tried, strict=True) if one.missed.any()
            }
            if not left:
                break
            changed = self._search.nearer([(courses[number], missed) for number, missed in failed.items()])
            on_trial = [number for number, better in zip(failed, changed, strict=True) if better]
        return [found.get(number) for number in range(len(courses))]
