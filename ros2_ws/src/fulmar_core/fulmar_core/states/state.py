"""States of bodies: the rigid-body state that wires and simulators speak, and the forms that batches compute with."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from fulmar_core.states.rotation import Array, yaw_of

if TYPE_CHECKING:
    # Without a parameter, `Task` and its like stand for any state type: most code only passes states on.
    from typing_extensions import TypeVar

    S = TypeVar("S", bound="State", default=Any)
else:
    from typing import TypeVar

    S = TypeVar("S")

POSE, TWIST = (
    7,
    6,
)  # numbers of a target in the world: x, y, z, quaternion (x, y, z, w); or of a velocity and a turn rate


@dataclass(frozen=True, slots=True)
class RigidBodyState:
    """Pose and motion of one body, or of many at once, in six degrees of freedom.

    A planar robot uses the same state: z, roll and pitch and their rates stay zero.
    """

    position_in_world: Array  # (..., 3) [m]
    quat_xyzw: Array  # (..., 4) attitude of the body in the world [-]
    velocity_in_world: Array  # (..., 3) [m/s]
    angular_velocity_in_body: Array  # (..., 3) [rad/s]

    @property
    def yaw(self) -> Array:
        """Heading, shape (...,) [rad]."""
        return yaw_of(self.quat_xyzw)


class State(ABC):
    """The form in which dynamics and tasks of one kind compute: one array for each quantity, all of one shape (...,).

    Thousands of worlds then lie side by side in memory. Outside of the batch every robot speaks `RigidBodyState`, poses
    of seven numbers and twists of six; a state type says what of them its tasks take.

    Attributes:
        COLUMNS: Names of the arrays, in the order of the constructor.
        WORLD: What bodies of this form move in, in words.
        NUMBERS: A pose as people write it, in m and degrees; of a place they leave the angles out.
        AXES: Coordinates of a place.
        SUFFIX: Ends the names of shipped tasks of this form.
    """

    __slots__ = ()
    COLUMNS: ClassVar[tuple[str, ...]]
    WORLD: ClassVar[str]
    NUMBERS: ClassVar[tuple[str, ...]]
    AXES: ClassVar[int]
    SUFFIX: ClassVar[str]

    @abstractmethod
    def columns(self) -> tuple[Array, ...]:
        """Every array, in the order of `COLUMNS`."""

    @classmethod
    @abstractmethod
    def from_rigid(cls, state: RigidBodyState) -> Self:
        """What this form keeps of a rigid-body state, of the same leading shape."""

    @classmethod
    def columns_of(cls, state: RigidBodyState) -> np.ndarray:
        """The arrays of one body, one a row, shape (columns, 1)."""
        return np.stack(cls.from_rigid(state)[None].columns())

    @abstractmethod
    def to_rigid(self) -> RigidBodyState:
        """The rigid-body state that this form describes, of the same leading shape."""

    @classmethod
    @abstractmethod
    def targets_of(cls, rigid: Array) -> Array:
        """What tasks take of poses, shape (..., 7), or of twists in the body's frame, shape (..., 6)."""

    @classmethod
    @abstractmethod
    def rigid_targets(cls, targets: Array, *, twists: bool) -> Array:
        """Poses, shape (..., 7), or twists, shape (..., 6), of such targets; the inverse of `targets_of`."""

    @classmethod
    @abstractmethod
    def target_at(cls, numbers: Sequence[float]) -> np.ndarray:
        """The target that people write as `NUMBERS`, or as a place alone, which has no angles [m, deg].

        Raises:
            ValueError: There are more or fewer numbers.
        """

    @classmethod
    @abstractmethod
    def written(cls, target: Array) -> tuple[float, ...]:
        """The numbers of a target of one robot, as people write them; the inverse of `target_at` [m, deg]."""

    @classmethod
    @abstractmethod
    def resting(cls, target: Array) -> Self:
        """A body that stands still at a target, shapes (...,)."""

    @property
    @abstractmethod
    def pose(self) -> Array:
        """Where it is, as a target of its tasks."""

    @abstractmethod
    def stopped(self) -> Self:
        """The same pose at rest."""

    @abstractmethod
    def distance_to(self, target: Array) -> Array:
        """Distance from a target that is a place, shape (...,) [m]."""

    @abstractmethod
    def logged(self) -> dict[str, Array]:
        """What `Trajectories` keep of it, by the names of their columns, shapes (...,)."""

    def __getitem__(self, index: Any) -> Self:
        """Pick worlds out of a batch."""
        return self.mapped(lambda column: column[index])

    def mapped(self, change: Callable[[Array], Array]) -> Self:
        """The state with every array changed."""
        return type(self)(*map(change, self.columns()))

    def in_numbers(self) -> Self:
        """The same of a batch of one, shapes (1,), in plain numbers, of which arrays of one cost ten times as much."""
        return self.mapped(_number)

    def in_arrays(self) -> Self:
        """The same of plain numbers as a batch of one, shapes (1,)."""
        return self.mapped(_array)

    def write(self, index: Any, other: Self) -> None:
        """Overwrite some worlds of a batch in place, as a reset does."""
        for mine, theirs in zip(self.columns(), other.columns(), strict=True):
            mine[index] = theirs

    @property
    def like(self) -> Array:
        """An array of the leading shape, in the library and floating type of all."""
        return self.columns()[0]

    def in_float64(self) -> Self:
        """The same as NumPy arrays of float64."""
        return self.mapped(_float64)

    @classmethod
    def stack(cls, states: Sequence[Self], axis: int = 0) -> Self:
        """Join states of one shape along a new axis, as NumPy."""
        return cls(
            *(np.stack(parts, axis=axis) for parts in zip(*(s.columns() for s in states), strict=True))
        )

    @classmethod
    def unknown(cls) -> Self:
        """State of one robot of which nothing is known: NaN, shapes (1,)."""
        return cls(*(np.full(1, np.nan) for _ in cls.COLUMNS))


def _number(values: np.ndarray) -> float:
    return float(values[0])


def _array(number: float) -> np.ndarray:
    return np.array([number])


def _float64(values: Any) -> np.ndarray:
    return np.asarray(values, dtype=float)
