"""Options of the console, for its own command and for commands that start it beside a robot."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from fulmar_bringup.console import log_line, print_json
from fulmar_cli.commands.arguments import flag, option
from fulmar_cli.installation.extras import require
from fulmar_console import PORT
from fulmar_core.config.errors import ConfigError

if TYPE_CHECKING:
    from fulmar_console.source import Expected

MOST_TOKEN = 4096  # characters of its file
LEAST_TOKEN = 16
PortOption = Annotated[int, option("PORT", "Port of the page; 0 takes one that is free.", min=0, max=65535)]
ListenOption = Annotated[
    str,
    option("ADDRESS", "Address to listen on, such as 0.0.0.0; any but this computer's own needs a token."),
]
TokenOption = Annotated[
    Path | None,
    option("FILE", "File with the token for --listen; by default a new one, in the printed address."),
]
ConsoleFlag = Annotated[bool, flag("--console", "Show it on a page in the browser. See `fulmar console`.")]
ConsolePort = Annotated[int, option("PORT", "Port of --console; 0 takes one that is free.", min=0, max=65535)]


def token_of(file: Path | None) -> str:
    """The token of a file; empty without one.

    Raises:
        ConfigError: It cannot be read, or is too short.
    """
    if file is None:
        return ""
    try:
        token = file.read_text(encoding="ascii")[:MOST_TOKEN].strip()
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(
            f"--token {file}: {getattr(error, 'strerror', None) or 'it is no plain text'}."
        ) from None
    if len(token) < LEAST_TOKEN or not token.isprintable() or any(each in token for each in ' ";,\\'):
        raise ConfigError(
            f"--token {file}: a token has at least {LEAST_TOKEN} characters, none of them a space, a quote, a comma or "
            'a semicolon. Make one: python -c "import secrets; print(secrets.token_urlsafe())"'
        )
    return token


def with_console(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command that starts a robot `--console` and `--console-port`; the page is there before all else."""

    @functools.wraps(command)
    def shown(**given: Any) -> None:
        console, port = given.pop("console"), given.pop("console_port")
        if not console or given.get("dry_run"):
            command(**given)
            return
        require("websockets")
        from fulmar_console.beside import console_beside
        from fulmar_console.process import ConsoleRequest

        def say(address: str) -> None:
            if given.get("as_json") and "dry_run" in given:  # events come one a line
                print_json({"event": "console", "url": address}, indent=None)
            else:
                log_line(f"console: {address}")

        with console_beside(ConsoleRequest(expected=_expected(given), port=port), say):
            command(**given)

    signature = inspect.signature(command, eval_str=True)
    *own, last = signature.parameters.values()
    more = [
        last.replace(name="console", default=False, annotation=ConsoleFlag),
        last.replace(name="console_port", default=PORT, annotation=ConsolePort),
    ]
    vars(shown)["__signature__"] = signature.replace(parameters=[*own, *more, last])
    return shown


def _expected(given: dict[str, Any]) -> Expected:
    """What a command line asks for, unchecked."""
    from fulmar_console.source import Expected

    return Expected(*(str(given.get(key) or "") for key in ("system", "robot", "name", "task")))
