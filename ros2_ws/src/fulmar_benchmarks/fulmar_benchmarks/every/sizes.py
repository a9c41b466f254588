"""What each benchmark measures at each size, as options of its command."""

from __future__ import annotations

# `smoke` shows in minutes that everything runs; `quick` has figures worth reading; `full` is what is published.
SIZES = ("smoke", "quick", "full")
_LIVE = "--flights 2 --heights 1 --through batch,lockstep"
_RANS = "--parts tasks,dead,integrator --episodes 64 --tumble-s 600"
_RANS_FEW = (
    "--robots spacecraft_16 --tasks go_to_pose_3d --controllers lqr --parts tasks --episodes 4 --no-report"
)
_FALCON = "--tasks hold,a,d --controllers lqi,lqr --scenarios exact,calm --episodes 2 --no-report"
_AVIST_FEW = "--parts tasks --tasks go_to_pose_3d --controllers lqr,pd --episodes 4 --no-report"
OPTIONS = {  # smoke, quick; full: no options
    "avist": (_AVIST_FEW, "--parts tasks,inspect --episodes 64 --rounds 4"),
    "console": ("--parts server --robots 2", "--parts server,first,stop --clicks 5 --rounds 2"),
    "descent": (_LIVE, "--flights 16 --real-time 1"),
    "drift": ("--through batch --episodes 16 --no-report", "--through batch"),
    "endurance": ("--seconds 20 --rate 5", "--seconds 600 --rate 10"),
    "estimator": ("--drives 1 --seconds 10", "--drives 1"),
    "events": ("--runs 4 --parts table --no-report", "--runs 20 --parts table,fields,sensitivity"),
    "falcon": (_FALCON, "--controllers lqi,lqr,policy --episodes 16"),
    "flights": ("--episodes 2 --real-time 0 --episode-s 10", "--episodes 16 --real-time 1"),
    "guard": ("--runs 8 --parts defects,decision --robots floating_platform", "--runs 50"),
    "hardware": ("--hardware zero_g_lab --episodes 1 --seconds 10", "--episodes 4"),
    "identify": ("--platforms 1 --robots turtlebot2 --duration 30", "--platforms 4"),
    "inertia": ("--satellites microsat --draws 1 --no-report", "--draws 1"),
    "latency": ("--rates 50 --seconds 2 --executors events", "--rates 50"),
    "network": ("--episodes 1 --seconds 10", "--episodes 8 --seconds 18"),
    "pace": ("--systems floating_platform_policy --steps 200 --seconds 2", "--steps 1000 --seconds 10"),
    "rans3d": (_RANS_FEW, _RANS),
    "recorder": ("--parts lockstep,kills --kills 2 --lockstep-s 20", "--loss-s 60 --kills 10"),
    "roboran": ("--through batch --episodes 64 --no-report", "--episodes 256"),
    "throughput": ("--robots turtlebot2,spacecraft_16 --worlds 256 --seconds 0.2", "--worlds 1024"),
    "training": ("--seeds 1 --seconds 8", "--seeds 2"),
}
# Of those that the catalogue does not have: which of our options they take.
TAKES = {
    "estimator": ("seed",),
    "hardware": ("jobs", "out"),
    "identify": ("seed", "jobs", "ray"),
    "network": ("jobs", "out"),
}
NAMES = tuple(OPTIONS)


def options(name: str, size: str) -> list[str]:
    """Options of a benchmark's command at a size."""
    return (*OPTIONS[name], "")[SIZES.index(size)].split()
