"""`fulmar benchmark network`: goals reached although the controller is behind a cable that loses and delays."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fulmar_bringup.console import output, print_json
from fulmar_bringup.progress import work_bar
from fulmar_cli.commands.arguments import JsonOption
from fulmar_core.config.errors import FAILED, ConfigError
from tests.benchmarks.closed_loops import Command

if TYPE_CHECKING:
    from fulmar_evaluation.faults.two_hosts import Quality


@dataclass(frozen=True)
class NetworkCase:
    """A robot, what it is asked to do, and the cable to its controller."""

    name: str
    robot: str
    task: str
    quality: Quality
    copies: int  # of each command

    @contextlib.contextmanager
    def prepared(self, seed: int) -> Iterator[Command]:
        """Two hosts; the run is on one of them, its controller on the other."""
        from fulmar_evaluation.faults.two_hosts import ACROSS, two_hosts

        with two_hosts(seed=seed) as hosts:
            hosts.cable.quality = self.quality
            controller = ("--controller-in", hosts.other, "--copies", str(self.copies))
            yield Command(("ip", "netns", "exec", hosts.robot), controller, ACROSS)

    def about(self) -> dict[str, Any]:
        """The cable."""
        return {**asdict(self.quality), "copies": self.copies}


def network(
    robot: Annotated[
        str, typer.Option(metavar="R", help="A name from `fulmar list robots`.")
    ] = "floating_platform",
    task: Annotated[str, typer.Option(metavar="T", help="A name from `fulmar list tasks`.")] = "go_to_pose",
    episodes: Annotated[int, typer.Option(metavar="N", min=1)] = 40,
    seconds: Annotated[
        float | None,
        typer.Option(metavar="S", min=5.0, help="Length of an episode; the task's own by default."),
    ] = None,
    loss: Annotated[float, typer.Option(metavar="SHARE", min=0.0, max=1.0, help="Of all frames.")] = 0.1,
    delay_ms: Annotated[float, typer.Option(metavar="MS", min=0.0, help="Of each frame.")] = 20.0,
    jitter_ms: Annotated[float, typer.Option(metavar="MS", min=0.0, help="More or less than that.")] = 10.0,
    copies: Annotated[int, typer.Option(metavar="N", min=1, max=3, help="Of each command.")] = 3,
    jobs: Annotated[
        int, typer.Option(metavar="N", min=1, max=16, help="Systems beside each other, three processes each.")
    ] = 2,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Keep what came of each episode, and do not repeat what is there."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Drive a robot in MuJoCo, in real time, by a controller on another host, over a cable that loses and delays.

    The hosts are network namespaces, which needs root. Each episode is `fulmar run` with a seed of its own, also for
    the fate of frames, in both directions and from discovery on. A pause that trips the watchdog fails the episode.
    The exit code is 1 where fewer than 95 % reach their goal.

    Try:

    fulmar benchmark network --episodes 4 --seconds 20
    """
    from fulmar_bringup.system import modules_of
    from fulmar_cli.installation.extras import require
    from fulmar_evaluation.faults.two_hosts import Quality, why_not
    from tests.benchmarks.closed_loops import Campaign, measure

    if why_not():
        raise ConfigError(f"{why_not()}.")
    require(*modules_of("policy", "mujoco"))
    name = f"{robot}_{task}_{loss:g}_{delay_ms:g}_{jitter_ms:g}_x{copies}"
    case = NetworkCase(name, robot, task, Quality(loss, delay_ms / 1e3, jitter_ms / 1e3), copies)
    with work_bar("driving") as moved:
        campaign = Campaign(episodes, seconds, jobs, out)
        (figures,) = measure([case], campaign, lambda done: moved(done, episodes))
    if as_json:
        print_json(figures)
    else:
        output.print(
            f"{figures['succeeded']} of {figures['episodes']} episodes reached their goal "
            f"({figures['share']:.3f}, required {figures['required']:.2f})"
        )
        for missed in figures["missed"]:
            output.print(f"  seed {missed['seed']}: {missed['failure'] or 'missed the goal'}", markup=False)
    if not figures["passed"]:
        raise typer.Exit(FAILED)
