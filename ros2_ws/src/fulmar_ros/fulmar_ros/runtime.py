"""Life cycle of every node process: start, spin, orderly stop, and exit code.

The only home of `rclpy.init` and of spinning. The executor spins in a thread of its own, so that the main
thread is free for signals and for the last messages of a control loop.
"""

from __future__ import annotations

import contextlib
import faulthandler
import gc
import os
import queue
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from types import FrameType
from typing import Any

import rclpy
from rclpy.exceptions import InvalidHandle
from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from fulmar_core.config.errors import BAD_USAGE, DONE, FAILED, FulmarError
from fulmar_core.config.process import LAUNCHER_PID, end_with
from fulmar_core.config.yielding import take_place
from fulmar_ros.middleware import range_for_rclpy, set_up_middleware, static_peers, strangers_can_send
from fulmar_ros.peer_filter import PeerFilter
from fulmar_ros.ros_check import check_log_folder

PRIVATE = 0o077  # rights that group and others do not get
# A thread that waits for the interpreter gets it after this long; Python's own 5 ms is a lot of 20 ms.
SWITCH_INTERVAL_S = 0.0005

# A second request by one of these ends a flight at once. SIGTERM does not, which systemd and a launcher may send both,
# nor does the death of the launcher.
CUTS_SHORT = (signal.SIGINT, signal.SIGQUIT)
ORPHANED = signal.SIGUSR1  # from the kernel, when the launcher that started us has died
ENDS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
DESTROYED_S = 20.0  # for a node, or the middleware, to be destroyed; sound ones take less than a second
STANDARD_ERROR = 2
SPIN_S = 60.0
LOOK_S = 0.1  # by which an orderly end may be late whose signal another thread has taken [s]
RCLPY = os.path.dirname(rclpy.__file__) + os.sep
EXECUTOR = "FULMAR_EXECUTOR"  # environment variable: default, or events

RequestExit = Callable[[int], None]
"""Ends the process in order, with an exit code; from any thread, returns at once, the first call counts."""


def run_node(make_node: Callable[[RequestExit], Node], argv: Sequence[str] | None = None) -> int:
    """Build one node, spin it until it is stopped, and stop it in order.

    SIGINT, SIGTERM, SIGQUIT and, unless `nohup` had it ignored, SIGHUP (the terminal or the ssh connection is gone) ask
    for an orderly end with exit code 0, and so does the death of the launcher. A node may have a method
    `bring_down(cut_short)`, which ends a flight, and a method `stop()`: both are called in the main thread while
    messages still flow (publish zeros, flush, close). What `stop` returns, if anything, is the exit code of a run that
    would otherwise end with 0. Nodes that share its process are in an attribute `companions`.

    Args:
        make_node: Builds the node. It is given a function that ends the process with an exit code.
        argv: Command line with the ROS arguments; that of the process by default.

    Returns:
        0 after an orderly end, 1 if a callback or `stop` failed, 2 if the node could not be built, or the
        code that the node asked for.
    """
    # A SimpleQueue may be filled from a signal handler; an Event may not, its lock is not reentrant.
    exit_codes: queue.SimpleQueue[int] = queue.SimpleQueue()

    asked: list[int] = []

    def on_signal(number: int, _frame: FrameType | None) -> None:
        if not asked or number in CUTS_SHORT:
            exit_codes.put(DONE)
        asked.append(number)

    signal.signal(ORPHANED, on_signal)
    for number in ENDS:
        if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, on_signal)
    end_with_parent()
    keep_private()
    sys.setswitchinterval(SWITCH_INTERVAL_S)

    try:
        init_ros(argv)
    except FulmarError as error:
        sys.stderr.write(f"{error}\n")
        return BAD_USAGE
    except RuntimeError as error:  # what rclpy raises for ROS arguments that it cannot read
        sys.stderr.write(f"the ROS arguments on the command line are wrong: {str(error).splitlines()[0]}\n")
        return BAD_USAGE
    try:
        return _spin(make_node(exit_codes.put), exit_codes)
    except FulmarError as error:
        sys.stderr.write(f"{error}\n")
    finally:
        with _within(DESTROYED_S):
            rclpy.try_shutdown()
    _collect_refused_node()
    return BAD_USAGE


def keep_private() -> None:
    """Let other users read nothing that this process writes, such as bags and logs."""
    os.umask(os.umask(PRIVATE) | PRIVATE)


def _collect_refused_node() -> None:
    """Free a node whose constructor raised: nobody holds it, and it keeps its DDS participant alive; see `_destroy`."""
    gc.unfreeze()
    gc.collect()


def init_ros(argv: Sequence[str] | None = (), *, context: rclpy.Context | None = None) -> None:
    """Start rclpy with the middleware's settings of Fulmar; every process starts it here.

    Args:
        argv: Command line with the ROS arguments; None: that of the process.
        context: By default the global one.

    Raises:
        ConfigError: ROS_STATIC_PEERS cannot be resolved, packets of others cannot be kept out, or logs cannot be
            written.
        RuntimeError: The arguments cannot be read.
    """
    set_up_middleware()
    check_log_folder(os.environ)
    with range_for_rclpy():
        arguments = None if argv is None else list(argv)
        rclpy.init(args=arguments, context=context, signal_handler_options=SignalHandlerOptions.NO)
    if strangers_can_send(os.environ):
        number = (context or rclpy.get_default_context()).get_domain_id()
        PeerFilter(static_peers(os.environ), number)


def end_with_parent() -> None:
    """Ask the kernel for a signal when the launcher that started us dies, so that no node is left behind.

    Only for children with their launcher's id in the environment; a node that a person started outlives the shell.
    """
    parent = os.environ.get(LAUNCHER_PID, "")
    if parent.isdecimal():
        end_with(int(parent), ORPHANED)


def _spin(node: Node, exit_codes: queue.SimpleQueue[int]) -> int:
    def on_error(error: Exception) -> None:
        node.get_logger().error(_one_line(error))
        exit_codes.put(FAILED)

    with contextlib.ExitStack() as spun:
        for each in (node, *getattr(node, "companions", ())):  # a thread for each: none holds up another
            spun.enter_context(spinning(each, on_error))
        settle_memory()
        take_place()
        asked = next_code(exit_codes)
        _bring_down(node, exit_codes)
        stopped = _stop(node)
    return asked or stopped


def next_code(exit_codes: queue.SimpleQueue[int]) -> int:
    """Wait in the main thread for a request to end; returns the exit code.

    A signal goes to any thread that next enters the kernel's signal code, as one does that starts a thread. Python's
    handler waits for the main thread then, which no signal wakes: in a wait without a limit it would never run, and
    the node would go on until it is killed (CPython 3.11, Modules/signalmodule.c; Linux, kernel/signal.c).
    """
    while True:
        with contextlib.suppress(queue.Empty):
            return exit_codes.get(timeout=LOOK_S)


def settle_memory() -> None:
    """Collect garbage once and exempt what is left, which lives to the end, from every later collection.

    The first call takes a third of a second and holds up every thread: nodes make it before their loops start.
    """
    gc.collect()
    gc.freeze()


@contextlib.contextmanager
def spinning(node: Node, on_error: Callable[[Exception], None]) -> Iterator[None]:
    """Serve a node's callbacks in a thread of its own; destroys the node at the end.

    Args:
        node: The node.
        on_error: Called in that thread with what a callback raised; no further callback is served then.
    """
    executor, over = _executor(), Future()
    executor.add_node(node)

    def spin() -> None:
        try:
            # Not spin(): the EventsExecutor of the wheels then waits for a deadline beyond the clock's range,
            # which burns a core and starves the timers. A finite wait in a loop does what spin() should.
            while not over.done():
                _spin_for_a_while(executor, over)
        except Exception as error:  # noqa: BLE001 - whatever a callback raises, the owner decides
            # The node may have been destroyed below a callback that took too long to end.
            if not (over.done() and isinstance(error, InvalidHandle)):
                on_error(error)

    thread = threading.Thread(target=spin, name=f"{node.get_name()} executor", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set_result(None)
        thread.join(timeout=2.0)
        executor.shutdown()
        with _within(DESTROYED_S):
            _destroy(node)


@contextlib.contextmanager
def _within(seconds: float) -> Iterator[None]:
    """End the process, and print its stacks, where something takes longer, such as a middleware that hangs [s].

    It may hang with Python's lock, so that no signal handler and no other thread of Python could end the process.
    """
    faulthandler.dump_traceback_later(seconds, exit=True, file=STANDARD_ERROR)
    try:
        yield
    finally:
        faulthandler.cancel_dump_traceback_later()


def _destroy(node: Node) -> None:
    """Destroy a node with everything that keeps its DDS participant alive.

    `LifecycleNode.destroy_node` leaves the state machine, with its services, to the garbage collector, which
    `settle_memory` has exempted it from. The participant would live on, and its threads would run while the process
    tears down what they use: heap corruption, on a busy computer.
    """
    node.destroy_node()
    state_machine = getattr(node, "_state_machine", None)
    if state_machine is not None:
        state_machine.destroy_when_not_in_use()


def _spin_for_a_while(executor: Executor, over: Future) -> None:
    """Spin until a future is done, for a while, or until an entity vanishes.

    rclpy raises where another thread has destroyed an entity (a publisher, say) whose event it is about to take.
    Nothing is wrong then: what is gone has no callback to serve.
    """
    try:
        executor.spin_until_future_complete(over, timeout_sec=SPIN_S)
    except InvalidHandle as error:
        _, *frames = traceback.extract_tb(error.__traceback__)
        if any(not frame.filename.startswith(RCLPY) for frame in frames):
            raise  # a callback used what is destroyed


@contextlib.contextmanager
def ros_node(name: str, on_error: Callable[[Exception], None], *, namespace: str = "") -> Iterator[Node]:
    """A node of a process that is no node itself: rclpy starts, the node spins, and both end with the context."""
    with ros_nodes(name, on_error, namespaces=(namespace,)) as (node,):
        yield node


@contextlib.contextmanager
def ros_nodes(
    name: str, on_error: Callable[[Exception], None], *, namespaces: Sequence[str]
) -> Iterator[list[Node]]:
    """As `ros_node`, a node of this name in each namespace."""
    init_ros()
    try:
        with contextlib.ExitStack() as spun:
            nodes = [rclpy.create_node(name, namespace=space or None) for space in namespaces]
            for node in nodes:
                spun.enter_context(spinning(node, on_error))
            yield nodes
    finally:
        with _within(DESTROYED_S):
            rclpy.try_shutdown()


def _bring_down(node: Any, exit_codes: queue.SimpleQueue[int]) -> None:
    """Let a node whose robot cannot stop bring it to the ground first; a second request to end cuts that short."""
    bring_down = getattr(node, "bring_down", None)
    if bring_down is None:
        return

    def asked_again() -> bool:
        while not exit_codes.empty():
            if exit_codes.get() == DONE:  # a callback that failed is no request
                return True
        return False

    try:
        bring_down(asked_again)
    except Exception as error:  # noqa: BLE001 - the rest of the shutdown must still happen
        node.get_logger().error(_one_line(error))


def _stop(node: Any) -> int:
    stop = getattr(node, "stop", None)
    if stop is None:
        return DONE
    try:
        return stop() or DONE
    except Exception as error:  # noqa: BLE001 - the rest of the shutdown must still happen
        node.get_logger().error(_one_line(error))
        return FAILED


def _executor() -> Executor:
    """The EventsExecutor; rclpy's default one where there is none, or where the environment asks for it."""
    if os.environ.get(EXECUTOR) == "default":
        from rclpy.executors import SingleThreadedExecutor

        return SingleThreadedExecutor()
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:  # rclpy before Jazzy's 7.1.2
        from rclpy.executors import SingleThreadedExecutor

        return SingleThreadedExecutor()
    return EventsExecutor()


def _one_line(error: Exception) -> str:
    if isinstance(error, FulmarError):
        return str(error)
    place = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({place.filename}:{place.lineno})"
