"""The command `fulmar`; each of its commands is a module of `commands/`."""

from __future__ import annotations

import os
import signal
import sys
from collections import namedtuple
from importlib.metadata import version
from types import FrameType
from typing import Annotated

import typer

from fulmar_bringup.console import console, output, showing_warnings
from fulmar_cli.commands.bag import bag
from fulmar_cli.commands.benchmark import benchmark
from fulmar_cli.commands.bundle import bundle
from fulmar_cli.commands.certify import certify
from fulmar_cli.commands.check import check
from fulmar_cli.commands.commission import commission
from fulmar_cli.commands.console import console as console_page
from fulmar_cli.commands.demo import demo
from fulmar_cli.commands.doctor import doctor
from fulmar_cli.commands.estop import estop
from fulmar_cli.commands.evaluate import EPILOG as MEANINGS
from fulmar_cli.commands.evaluate import evaluate
from fulmar_cli.commands.export import export
from fulmar_cli.commands.faults import faults
from fulmar_cli.commands.goals import goals
from fulmar_cli.commands.identify import identify
from fulmar_cli.commands.import_policy import import_policy
from fulmar_cli.commands.install_actions import install_actions
from fulmar_cli.commands.install_interfaces import install_interfaces
from fulmar_cli.commands.install_px4 import install_px4
from fulmar_cli.commands.install_stars import install_stars
from fulmar_cli.commands.install_tf import install_tf
from fulmar_cli.commands.layout import layout
from fulmar_cli.commands.list import list_names
from fulmar_cli.commands.new import new
from fulmar_cli.commands.parity import parity
from fulmar_cli.commands.policies import policies
from fulmar_cli.commands.rates import rates
from fulmar_cli.commands.report import report
from fulmar_cli.commands.run import run
from fulmar_cli.commands.service import service
from fulmar_cli.commands.simulation import simulation
from fulmar_cli.commands.status import status
from fulmar_cli.commands.swap import swap
from fulmar_cli.commands.teleop import teleop
from fulmar_cli.commands.train import train
from fulmar_cli.commands.twin import twin
from fulmar_cli.commands.up import up
from fulmar_cli.commands.view import view
from fulmar_cli.installation.extras import advice_for
from fulmar_cli.process_environment import settle
from fulmar_core.config.errors import (
    BAD_USAGE,
    DONE,
    FAILED,
    BagError,
    BundleError,
    ConfigError,
    FulmarError,
    did_you_mean,
)

INTERRUPTED = 130  # what typer makes of Ctrl-C

app = typer.Typer(
    name="fulmar",
    help="Robots driven by learned and classical controllers over ROS 2: simulate, run, record, train, evaluate.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _print_version(asked: bool) -> None:
    if asked:
        output.print(f"fulmar {version('fulmar')}", markup=False)
        raise typer.Exit(DONE)


@app.callback()
def _options(
    _version: Annotated[
        bool,
        typer.Option("--version", is_eager=True, callback=_print_version, help="Print the version and exit."),
    ] = False,
) -> None:
    """Options of the whole program; its help is that of `app`."""


app.command("list")(list_names)
app.command()(run)
app.command()(up)
app.command()(goals)
app.command()(layout)
app.command()(view)
app.command()(teleop)
app.command()(status)
app.command()(estop)
app.command()(swap)
app.command()(commission)
app.command("console")(console_page)
app.command()(faults)
app.command()(train)
app.command()(policies)
app.command()(export)
app.command("import")(import_policy)
app.command(epilog=MEANINGS)(evaluate)
app.command()(certify)
app.command()(parity)
app.add_typer(benchmark, name="benchmark")
app.add_typer(bundle, name="bundle")
app.add_typer(bag, name="bag")
app.add_typer(check, name="check")
app.add_typer(new, name="new")
app.add_typer(service, name="service")
app.add_typer(simulation, name="simulation")
app.command()(report)
app.command()(identify)
app.command()(twin)
app.command()(rates)
app.command()(demo)
app.command()(doctor)
app.command()(install_tf)
app.command()(install_actions)
app.command()(install_px4)
app.command()(install_interfaces)
app.command()(install_stars)


def main() -> None:
    """Run the command line; mistakes end with one line and exit code 2, failures with 1."""
    settle()
    stops: list[str] = []

    def on_terminate(number: int, _frame: FrameType | None) -> None:
        """These stop a command as Ctrl-C does, in order; once, though `timeout` sends SIGTERM twice."""
        for each in (signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
            signal.signal(each, signal.SIG_IGN)
        stops.append(f"stopped by {signal.Signals(number).name}")
        raise KeyboardInterrupt(*stops)

    for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        if signal.getsignal(number) != signal.SIG_IGN:  # as `nohup` leaves SIGHUP
            signal.signal(number, on_terminate)
    # A shell starts its background jobs with Ctrl-C ignored, and so would everything that we start.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with showing_warnings():
            _run_and_exit(stops)
    finally:
        # Python ends by SIGINT, whatever the exit code, once Ctrl-C has come while text was run as code, as it is for
        # each named tuple or dataclass that is imported, even if it was caught; running text again takes that back
        # (CPython's pythonrun.c, `run_eval_code_obj`).
        namedtuple("Answered", ())


def _run_and_exit(stops: list[str]) -> None:
    try:
        code = app(prog_name="fulmar", standalone_mode=False)
        sys.stdout.flush()  # here, where a closed pipe is handled
    except (ConfigError, BundleError, BagError) as error:
        sys.exit(_complain(str(error), BAD_USAGE))
    except FulmarError as error:
        sys.exit(_complain(str(error), FAILED))
    except typer.Exit as exit_request:
        code = exit_request.exit_code
    except (typer.Abort, KeyboardInterrupt):
        code = INTERRUPTED
    except BrokenPipeError:  # the reader of our output has ended, as in `fulmar list | head -1`
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())  # Python flushes the rest when it exits
        sys.exit(FAILED)
    except OSError as error:  # a folder that cannot be written, a full disk
        sys.exit(_complain(f"{error.filename or 'the system'}: {error.strerror or error}.", FAILED))
    except MemoryError:
        sys.exit(
            _complain("the memory of this computer, or of its limit (`ulimit -v`), does not suffice.", FAILED)
        )
    except ImportError as error:
        advice = advice_for(error)
        if advice is None:
            raise
        sys.exit(_complain(advice, BAD_USAGE))
    except Exception as error:
        if type(error).__name__ == "NoArgsIsHelpError":  # its message is the whole help
            console.print(error.format_message(), markup=False)  # type: ignore[attr-defined]
            sys.exit(BAD_USAGE)
        if hasattr(error, "format_message"):  # what typer raises for bad usage, whichever click is behind it
            sys.exit(_complain(f"{error.format_message()}{_hint(error)}", BAD_USAGE))
        raise
    if code == INTERRUPTED:
        sys.exit(_complain(stops[0] if stops else "stopped by the user", FAILED))
    sys.exit(code if isinstance(code, int) else DONE)


def _complain(message: str, code: int) -> int:
    console.print(f"fulmar: {message}", markup=False, soft_wrap=True)
    return code


def _hint(error: Exception) -> str:
    context = getattr(error, "ctx", None)
    if context is None:
        return ""
    commands = getattr(context.command, "commands", None)
    if commands and context.args:
        return did_you_mean(context.args[0], commands)
    return f" Try `{context.command_path} --help`."


if __name__ == "__main__":
    main()
