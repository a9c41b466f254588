"""What to say when an optional part of Fulmar is not installed."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from fulmar_core.errors import ConfigError


@contextlib.contextmanager
def needs_extra(extra: str) -> Iterator[None]:
    """Turn a missing module into advice.

    Args:
        extra: Name of the extra that brings it.

    Raises:
        ConfigError: If an import in the block fails for lack of a module.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"this command needs '{error.name}', which the extra '{extra}' brings. "
            f"Run `make dev` in the checkout, or install 'fulmar[{extra}]'."
        ) from error
