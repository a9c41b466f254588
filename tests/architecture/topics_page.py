"""The page docs/topics.md, made of the topic table: `python -m tests.architecture.topics_page > docs/topics.md`."""

from __future__ import annotations

from fulmar_core.robots.topics import ESTOP_RESET, ESTOP_TRIGGER, GIVE_BACK, WIRES, Wire

UNRECORDED = ", ".join(f"`{wire.name}`" for wire in WIRES if not wire.recorded)

INTRODUCTION = f"""\
# Topics

<!-- Generated from fulmar_core/robots/topics.py: python -m tests.architecture.topics_page > docs/topics.md -->

Topic names are relative to the robot's namespace, such as `/turtlebot2/odom`, unless they begin with a slash. The
namespace is the robot's type or its `--name` ([systems.md](systems.md#several-robots-of-one-type)). Frames follow REP
103 and REP 105; with a `--name` they have it as a prefix. Units are SI; orientations are quaternions (x, y, z, w).
Every topic is recorded in the bag of a run, except {UNRECORDED}.

| Unit of `effort` | Actuators |
|---|---|
| 0 (closed) to 1 (open) | valves |
| -1 to 1, share of full command | propellers |
| N·m | reaction wheels: torque of the motor on its wheel; unloading: torque on the body |
| rad, then 0 to 1 | aircraft: deflections of surfaces, throttles |
| m/s, then rad/s | differential drive: speed, turn rate |
| m/s, then rad | Ackermann steering: speed, steering angle |

| QoS of the publisher | Meaning |
|---|---|
| stream | reliable, volatile, keeps the last 50; in lock step all that a reliable subscriber has not received |
| latched | reliable, transient local, keeps the last message, or as many as stated |
| best_effort | best effort, volatile, keeps the last 50; in lock step with estimators as stream |

Subscribers of Fulmar receive every topic from publishers of each quality of service, reliable and best effort, volatile
and latched: readings of a usual driver (best effort), goals of a plain rclpy node (volatile). A node subscribes twice
where one subscription does not match, and each message counts once. For each subscription that does not match, ROS logs
in the publisher "requesting incompatible QoS. No messages will be sent to it": harmless where the subscribers are
Fulmar's. Plain publishers of goals, obstacles and e-stops see it only where a latched publisher of the topic is there,
too, as beside `fulmar goals`, `fulmar run` and an e-stop node; best-effort publishers always do.

A publisher that sends one message as soon as it has one subscriber, as `ros2 topic pub --once` does, may have found the
recorder and not yet the controller or the plant. Nodes that receive the first hundred messages of a publisher of goals,
obstacles and e-stops therefore pass them on (`relay`): a press counts at once, anything else after 0.3 s in which it
does not come by itself and no newer one does. Resets and swaps are not passed on; `fulmar estop --reset` and
`fulmar swap` wait for the answer.

Only in lock step, which counts messages, odometry, commands and readings have to be reliable; a publisher that is not
is named in `warnings` of the node that refuses it. There `fulmar run --goals` publishes a goal with each odometry; but
for `goal_path`, its publisher keeps, beyond what is stated, all that a reliable subscriber has not received, and up to
5000 earlier ones: the stamps tell them apart.

Services: `{ESTOP_TRIGGER}`, `{ESTOP_RESET}` and `{GIVE_BACK}` (std_srvs/Trigger); `air_bearing/enable`
(std_srvs/SetBool).
"""

DIRECTIONS = {
    "plant": "From the plant to controller and recorder",
    "estimator": "From estimators to the plant",
    "controller": "From the controller to plant and recorder",
    "operator": "From the operator to plant and controller",
    "every node": "From every node to the operator",
    "display": "From the node that draws to viewers",
    "camera": "From simulated cameras",
}

HEAD = "| Topic | Type | QoS | Rate | Unit | Frame | Content |\n|---|---|---|---|---|---|---|"

GOALS = """\
## How long goals are valid

Goals and obstacles are latched: a controller that starts later still receives them. A goal is valid until the next one
arrives. That includes a velocity whose publisher has died: the robot keeps driving. `fulmar goals` therefore ends with
a standstill, also when it is interrupted, and commands one when the robot's odometry stops. A node of yours that
publishes velocities must do the same: watchdogs supervise commands, not goals.
"""


def row(wire: Wire) -> str:
    """The table row of one topic."""
    qos = f"latched, last {wire.latest}" if wire.latest > 1 else wire.delivery
    message = wire.type.replace("/msg/", "/")
    return (
        f"| `{wire.name}` | {message} | {qos} | {wire.rate} | {wire.unit} | {wire.frame} | {wire.content} |"
    )


def page() -> str:
    """The whole page, with one table for each direction."""
    tables = [
        "\n".join((f"## {title}\n", HEAD, *(row(wire) for wire in WIRES if wire.source == source), ""))
        for source, title in DIRECTIONS.items()
    ]
    return "\n".join((INTRODUCTION, *tables, GOALS))


if __name__ == "__main__":
    print(page(), end="")  # noqa: T201
