"""Command lines that several tests give, and what a mistake gets."""

from __future__ import annotations

from policy_server.controllers import shipped_policy

RUN = ["run", "floating_platform"]
EVALUATE = ["evaluate", "floating_platform", "go_to_pose", "--controller", "lqr", "--through", "batch"]
SHIPPED = str(shipped_policy("floating_platform", "go_to_pose"))


def complaint(result: tuple[int, str, str]) -> str:
    """The one line that a mistake gets; exit code 2, no result, no traceback."""
    code, out, err = result
    assert code == 2
    assert out == ""
    lines = err.splitlines()
    assert len(lines) == 1, err
    assert lines[0].startswith("fulmar: ")
    return lines[0]
