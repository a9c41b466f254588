"""Rows of the catalogue: what measures Fulmar's own nodes, real time, pace and training."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from fulmar_benchmarks.selectors import Row, Selector

if TYPE_CHECKING:
    from fulmar_benchmarks.shape import Choice

POLICY = Selector("policy", "DIR", "A policy bundle; the shipped one by default.", None, Path)

SCENARIO = Selector("scenario", "NAME", "Disturbances: a name from configs/scenarios.", "nominal")

DEPLOYED = ("rclpy", "mcap", "rosbags", "onnxruntime", "mujoco")  # modules of a whole system with a policy

NEEDED = {"policy": ("onnxruntime",)}  # modules of controllers


def _modules(campaign: str, choice: Choice) -> Sequence[str]:
    """What a benchmark needs that has to look at more than its choice."""
    needs: Callable[[Choice], Sequence[str]] = import_module(f"fulmar_benchmarks.{campaign}").needs
    return needs(choice)


DESCENT = Row(
    "descent",
    "fulmar_benchmarks.descent.campaign:Descents",
    """Kill the controller of an aircraft in flight, and measure how the safe controller brings it down.

    Each flight holds its height for 4 to 6 s. Then its controller's process gets SIGKILL; until its hull touches the
    ground the plant's guard flies it, by the state that the plant measures. `lockstep`: plant and controller are the
    nodes of `fulmar run`, in lock step up to the kill; after it no command answers, and the plant steps through
    simulated time on its own. `realtime`: each node is a process, by the clock. `batch`: the same guard in the core's
    own dynamics, without ROS. A flight is good if its bank stays within 10 degrees until touch-down and it sinks by at
    most 1 m/s then. The exit code is 1 unless 60 of 64 are.

    Try:

    fulmar benchmark descent --flights 8 --through batch,lockstep
    """,
    (
        Selector("robot", "NAME", "An aircraft.", "airship_v7"),
        Selector("controller", "C", "What flies until it is killed: lqi, lqr, mppi, pid or policy.", "lqi"),
        POLICY,
        Selector("heights", "M,...", "Heights at which it is killed [m].", "1,5", numbers=(0.01, 100.0)),
        Selector("flights", "N", "Flights at each height.", 64, int, 1, names=("--flights", "--episodes")),
        Selector("through", "W,...", "Out of batch, lockstep and realtime, or all.", "all",
                 family="way", known="fulmar_benchmarks.descent.campaign:WAYS"),
        Selector("real_time", "N", "Flights in real time at each height.", 4, int, 1),
        SCENARIO,
    ),
    always_checked=True,
    measures="flights",
)  # fmt: skip

FLIGHTS = Row(
    "flights",
    "fulmar_benchmarks.falcon.live:LiveFlights",
    """Fly an aircraft through ROS nodes, in lock step and in real time, beside the same flights in the batch.

    The flights in lock step are those of the batch, by seed and number; each in real time has a twin in the batch that
    begins alike. A policy runs at the rate that it was trained at. Altitude RMSE is over all flights of a way that
    survive, other figures are their medians. The exit code is 1 unless the altitude's RMSE differs by 0.02 m at most
    and the 99th percentile of the control period's error stays below 3 ms in each real-time flight; nothing else should
    run meanwhile.

    Try:

    fulmar benchmark flights --controller lqi --episodes 8 --episode-s 20
    """,
    (
        Selector("robot", "NAME", "An aircraft.", "airship_v7"),
        Selector("task", "T", "fly_hold, or fly_a to fly_f.", "fly_hold"),
        Selector("controller", "C", "lqi, lqr, mppi, pid or policy.", "policy"),
        POLICY,
        Selector("episodes", "N", "Flights in lock step.", 64, int, 1),
        Selector("real_time", "N", "Flights in real time.", 4, int, 0),
        Selector("episode_s", "S", "Length of each [s].", 60.0, float, 5.0),
        SCENARIO,
        Selector("control_hz", "HZ", "Command rate; the robot's own by default.", None, float, 0.01),
    ),
    needs=lambda choice: ("rclpy", "mcap", "rosbags", "mujoco", *NEEDED.get(choice.controller, ())),
    always_checked=True,
    measures="flights",
)  # fmt: skip

GUARD = Row(
    "guard",
    "fulmar_benchmarks.guard.campaign:GuardRuns",
    """Let defective controllers drive robots in an area or above the water, with and without the envelope guard.

    Starts and goals lie within 76 % of an area of 2.5 m to each side of the middle, 6 m of boats, whose goals are at
    most 5 m away. The body differs from its file as one that was identified does: mass by 5 %, inertia by 18 %, thrust
    down to 90 %, pushes of 10 % of its force and 5 % of its torque, commands late by up to 60 ms. Mass, inertia and
    drag of boats, wheels and wings lie in the spans of their files; aircraft hold 1 m above the water, without pushes,
    commands late by up to 20 ms. Each run lasts 60 s, of aircraft 20 s. `defects`: an adversary that drives out, a
    drift, a reversed sign, a stuck actuator, an untrained network, and none. `beliefs`: the adversary where the body
    differs by more than the guard believes. `mujoco`: the defects there, with half of the runs; both of robots that
    float. `decision`: processor time of one for one robot. At most 2 % of the runs of a defect may leave, none by more
    than 0.3 m.

    Try:

    fulmar benchmark guard --parts defects --robots floating_platform --runs 50
    """,
    (
        Selector("robots", "R,...", "Robots with an envelope guard and a policy: for poses, positions or a height.",
                 "floating_platform,spacecraft_16,kingfisher,turtlebot2,airship_v7", family="robot",
                 known="configs/robots"),
        Selector("parts", "P,...", "Out of defects, beliefs, mujoco and decision, or all.", "all",
                 family="part", known="fulmar_benchmarks.guard.campaign:PARTS"),
        Selector("defects", "D,...", "Out of none, adversary, drift, sign, stuck and untrained, or all.", "all",
                 family="defect", known="fulmar_benchmarks.guard.defects:DEFECTS"),
        Selector("controller", "C", "What has the defect: policy or a law.", "policy"),
        Selector("runs", "N", "Runs of each defect.", 200, int, 1, names=("--runs", "--episodes")),
    ),
    needs=lambda choice: (*NEEDED.get(choice.controller, ()), *(("mujoco",) if "mujoco" in choice.parts else ())),
    measures="runs",
)  # fmt: skip

LATENCY = Row(
    "latency",
    "fulmar_benchmarks.latency.cells:Latency",
    """Measure the latency from a state through the controller to the actuators, at several rates.

    Plant (MuJoCo), controller (the shipped policy of go_to_pose) and recorder are processes, as `fulmar run` has them.
    Latency goes from where the plant publishes its state to where it has taken the command that answers it. Each rate
    is measured on an idle computer, and with a busy process for each core; with rclpy's EventsExecutor,
    which Fulmar uses, and with its default one. Nothing else should run meanwhile. The exit code is 1 unless at 50 Hz
    the 99th percentile is below 3 ms when idle and no watchdog trips under load.

    Try:

    fulmar benchmark latency --rates 50 --executors events
    """,
    (
        Selector("rates", "HZ,...", "Commands a second, 5 to 500, with commas between.", "5,10,20,50,100,200",
                 numbers=(5.0, 500.0)),
        Selector("seconds", "S", "Seconds of each measurement.", 6.0, float, 1.0),
        Selector("executors", "E,...", "Executors of the nodes: events, default.", "events,default",
                 family="executor", known="fulmar_benchmarks.latency:EXECUTORS", as_given=True),
    ),
    needs=lambda choice: DEPLOYED,
    shared=("ray", "resume", "check"),
    always_checked=True,
    timed=True,
)  # fmt: skip

CONSOLE = Row(
    "console",
    "fulmar_benchmarks.console.campaign:Console",
    """Measure the operator's page in a real browser: cost, first image, latency, e-stop and bags.

    server: processor time and bytes a second of a console that receives ten robots from a bag at 50 Hz over ROS and
    serves one page. first: from `fulmar up --console` to the first image, in a browser that is there. latency: the
    control loop's p99 with a client that receives everything beside without, in turn. stop: clicks on the e-stop while
    a valve is open, until `actuators/state` stays zero. unconfirmed: clicks while the console's process stands still.
    bag: until five minutes of three robots are open, and requests while scrubbing. Nothing else should run meanwhile.

    Try:

    fulmar benchmark console --parts server,first

    fulmar benchmark console --parts stop --clicks 5
    """,
    (
        Selector("parts", "P,...", "Out of server, first, latency, stop, unconfirmed and bag, or all.", "all",
                 family="part", known="fulmar_benchmarks.console.campaign:PARTS"),
        Selector("clicks", "N", "On the e-stop, each way.", 50, int, 1),
        Selector("robots", "N", "That the server shows.", 10, int, 1),
        Selector("rounds", "N", "Starts for the first image.", 5, int, 1),
        Selector("pairs", "N", "Of runs for the latency.", 5, int, 1),
    ),
    needs=lambda choice: (*DEPLOYED, "websockets", "playwright"),
    shared=("resume", "check"),
    always_checked=True,
    timed=True,
)  # fmt: skip

ENDURANCE = Row(
    "endurance",
    "fulmar_benchmarks.latency.endurance:Endurance",
    """Run a system at 50 Hz of its own time for an hour: memory must not grow, and the bag must hold every command.

    The exit code is 1 if a node grows by 5 MB or more after a tenth of the time, or if the bag lacks a command that
    the plant has taken.

    Try:

    fulmar benchmark endurance --seconds 600 --rate 4
    """,
    (
        Selector("simulated_s", "S", "Length, in the robot's own time.", 3600.0, float, 10.0, names=("--seconds",)),
        Selector("rate", "F", "Simulated seconds per second of wall-clock time.", 1.0, float, 0.1, 10.0),
    ),
    needs=lambda choice: DEPLOYED,
    shared=("ray", "resume", "check"),
    always_checked=True,
    timed=True,
    dated=True,
    measures="running",
)  # fmt: skip

PACE = Row(
    "pace",
    "fulmar_benchmarks.pace.systems:Pace",
    """Measure steps a second in lock step, beside the same messages between two nodes that compute nothing.

    Each system runs as `fulmar run --lockstep` has it, with its recorder; its pace is read from its bag. Then two bare
    processes publish the messages of one of its steps and wait for each other: once as messages of rclpy, once as raw
    CDR. An estimator counts to the plant there. An LQR at 50 Hz in real time follows: latency from state to command,
    and errors of the period. Nothing else should run meanwhile.

    Try:

    fulmar benchmark pace --systems floating_platform_lqr,floating_platform_policy --json
    """,
    (
        Selector("systems", "S,...", "Robots with their controller and estimator; all by default.", "all",
                 family="system", known="fulmar_benchmarks.pace.systems:SYSTEMS"),
        Selector("steps", "N", "Steps of each system and of each bare pair.", 3000, int, 100),
        Selector("seconds", "S", "Length of the run in real time; 0: none [s].", 20.0, float, 0.0),
    ),
    needs=lambda choice: DEPLOYED,
    shared=("resume", "check"),
    timed=True,
)  # fmt: skip

THROUGHPUT = Row(
    "throughput",
    "fulmar_benchmarks.throughput_campaign:Throughput",
    """Measure environment steps a second of the core's batch, of MuJoCo's batch rollout and of JSBSim.

    A step of the batch has all that training needs: disturbances, odometry, observation, reward and new episodes.
    MuJoCo's is physics alone, with its own drag for water. Both are measured in turns in this run, on the same cores;
    the medians are printed. MuJoCo also rolls out ("otherwise") robots on water in the water of the plant, and robots
    in space by Euler's method; the plant has Runge-Kutta's of fourth order. Aircraft fly in JSBSim instead, one in a
    process for each core, in turbulence of its own where the scenario has any.
    Before that a step of each robot is compiled, which takes 10 to 30 s.

    Try:

    fulmar benchmark throughput --robots kingfisher,turtlebot2 --json
    """,
    (
        Selector("robots", "R,...", "Names with commas between; all by default.", family="robot",
                 known="configs/robots"),
        Selector("device", "cpu|cuda", "Where the batch is computed; cuda needs torch.", "cpu"),
        Selector("library", "compiled|numpy|torch",
                 "What computes the batch: on cpu a compiled kernel (which takes torch and g++) or else numpy, on cuda "
                 "torch."),
        Selector("worlds", "N", "Worlds of the batch.", 4096, int, 1),
        Selector("task", "T",
                 "Task of the batch; go_to_pose by default, in space go_to_pose_3d, of aircraft fly_hold."),
        replace(SCENARIO, default="randomised"),
        Selector("cores", "N", "Processes of the batch and of JSBSim, and threads of MuJoCo's.", 2, int, 1),
        Selector("seconds", "S", "Time of each of the measurements [s].", 1.0, float, 0.05),
    ),
    needs=lambda choice: _modules("throughput_campaign", choice),
    shared=("ray", "resume", "check"),
    timed=True,
)  # fmt: skip

TRAINING = Row(
    "training",
    "fulmar_benchmarks.training_campaign:Training",
    """Train with both, the same seeds side by side; print speed, and success over time.

    Success is the mean of the training scenario and the nominal one, on episodes that are held out.
    """,
    (
        Selector("robot", "[ROBOT]", "A name from `fulmar list robots`.", "floating_platform", positional=True),
        Selector("task", "[TASK]", "A name from `fulmar list tasks`.", "go_to_pose", positional=True),
        Selector("seeds", "N", "Seeds 1 to N.", 5, int, 1),
        Selector("seconds", "S", "Wall-clock of each run.", 40.0, float, 1.0),
        Selector("check_every", "S", "Wall-clock between checks on held-out episodes.", 4.0, float, 0.5),
        Selector("at_once", "N", "Runs side by side.", 2, int, 1),
    ),
    needs=lambda choice: ("torch", "stable_baselines3"),
    shared=("ray", "resume", "check"),
    always_checked=True,
    timed=True,
    dated=True,
    measures="",
)  # fmt: skip

EVERY = Row(
    "all",
    "fulmar_benchmarks.every.campaign:Every",
    """Run every benchmark at a chosen size, and write one page: published figure, ours, met or not, and the command.

    `smoke` takes minutes and shows that everything runs; `quick` takes an hour or two; `full` is what
    docs/benchmarks.md has. DIR keeps the document of each benchmark for the same command and code, so an interrupted
    run continues where it stopped. DIR/all.json has all figures, DIR/page.md is the page.

    Try:

    fulmar benchmark all --size smoke --only inertia,drift
    """,
    (
        Selector("size", "S", "smoke, quick or full.", "quick"),
        Selector("only", "NAME,...", "Names of benchmarks, or all.", "all",
                 family="benchmark", known="fulmar_benchmarks.every.sizes:NAMES"),
    ),
    measures="benchmarks",
)  # fmt: skip
