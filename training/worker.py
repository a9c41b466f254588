"""A process of its own for one job: reads it from standard input, ends politely when that is closed."""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading

from fulmar_core.errors import FulmarError


def main() -> int:
    """Do the job; 0 when it is done, else the last line of standard error says why not."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    source = sys.stdin.buffer
    job = pickle.load(source)  # from our own parent, over a pipe
    threading.Thread(target=_follow, args=(source.fileno(),), daemon=True).start()
    from training.jobs import run_job

    try:
        run_job(job)
    except FulmarError as error:
        print(error, file=sys.stderr)  # noqa: T201 - it is all that the parent reads
        return 2
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)  # noqa: T201
        return 130
    return 0


def _follow(pipe: int) -> None:
    """Do as a person with Ctrl-C would once the parent closes the pipe, or dies."""
    while os.read(pipe, 1):
        pass
    os.kill(os.getpid(), signal.SIGINT)


if __name__ == "__main__":
    sys.exit(main())
