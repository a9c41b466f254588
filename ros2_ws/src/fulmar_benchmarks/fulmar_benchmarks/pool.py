"""Cells in a pool of worker processes, of this machine or of a Ray cluster: progress, and failures of single cells."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from fulmar_benchmarks.shape import HERE, POOL, ROS, Cell, Figures, Progress
from fulmar_core.config.pool import Pool, ProcessPool, report

Note = Callable[[Cell, Figures | str], None]
_cluster: list[Pool] = []  # what is used in place of this machine's processes


@contextlib.contextmanager
def on_cluster(address: str | None) -> Iterator[None]:
    """Have cells measured on a Ray cluster until the context ends; without an address on this machine.

    Raises:
        ConfigError: Nothing answers at the address.
    """
    if address is None:
        yield
        return
    from fulmar_core.config.ray_pool import RayPool

    pool = RayPool(address)
    _cluster.append(pool)
    try:
        yield
    finally:
        _cluster.remove(pool)
        pool.close()


def pool_of(jobs: int) -> Pool:
    """So many processes of this machine; on a cluster as many as it has cores."""
    return _cluster[-1] if _cluster else ProcessPool(jobs)


def measure_all(cells: Sequence[Cell], *, jobs: int, progress: Progress, on_done: Note) -> None:
    """Measure cells, the costliest first; then one after another those that use all cores themselves.

    On a cluster cells of `ROS` have a core each, and each of `ALONE` has whichever machine to itself.

    Args:
        cells: Which.
        jobs: Processes at once.
        progress: Called with how much of their cost is done.
        on_done: Called with each cell and its figures, or a sentence where it failed.

    Raises:
        RunFailed: A process was ended from outside.
    """
    ordered = sorted(cells, key=lambda cell: -cell.cost)
    pooled = [cell for cell in ordered if cell.where == POOL or (_cluster and cell.where == ROS)]
    rest = [cell for cell in ordered if cell not in pooled]
    in_a_pool(pooled, jobs, progress, on_done)
    done = sum(cell.cost for cell in pooled)
    with contextlib.ExitStack() as ending:
        pool = None
        for cell in rest:
            if cell.where == ROS and pool is None:
                from fulmar_evaluation.ros_evaluation import ros_pool

                pool = ending.enter_context(ros_pool(jobs))  # the deployed nodes, started once for all
            if _cluster and cell.where != HERE:
                in_a_pool([cell], jobs, _beyond(done, progress), on_done)
            else:
                on_done(cell, figures_of(cell, _beyond(done, progress), pool))
            done += cell.cost
            progress(done)


def figures_of(cell: Cell, progress: Progress, pool: Any = None) -> Figures | str:
    """Figures of a cell, or a sentence where it failed: its fault must not cost the others their figures."""
    try:
        return cell.measure(progress, pool)
    except Exception as error:  # noqa: BLE001 - whatever it is
        return f"{type(error).__name__}: {error}"


def _beyond(done: float, progress: Progress) -> Progress:
    """Progress of one cell as that of all, of which some is done."""
    return lambda more: progress(done + more)


def in_a_pool(cells: Sequence[Cell], jobs: int, progress: Progress, on_done: Note) -> None:
    """Measure cells in so many processes of one thread each, or on the cluster."""
    done: dict[int, float] = {}

    def note(index: int, figures: Figures | str | Exception) -> None:
        done[index] = cells[index].cost
        on_done(cells[index], str(figures) if isinstance(figures, Exception) else figures)

    def watch(reported: Mapping[int, float]) -> None:
        progress(sum((dict(reported) | done).values()))

    pool_of(jobs).run(_work, [(cell,) for cell in cells], on_done=note, watch=watch)


def _work(cell: Cell) -> Figures | str:
    if cell.where != ROS:
        return figures_of(cell, report)
    from fulmar_evaluation.ros_evaluation import ros_pool

    with ros_pool(1) as pool:
        return figures_of(cell, report, pool)
