"""A clock of one process that steps, as that of another computer may: a library that is compiled and preloaded."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
from dataclasses import dataclass
from pathlib import Path

from fulmar_core.config.errors import RunFailed

SOURCE = Path(__file__).with_name("stepped_clock.c")
COMPILERS = ("cc", "gcc", "clang")
COMPILES_S = 60.0


@dataclass(frozen=True)
class SteppedClock:
    """CLOCK_REALTIME of one node: what its code reads, and how long it waits; not that of the kernel, nor of others."""

    folder: Path
    node: str  # name of the node

    @property
    def environment(self) -> dict[str, str]:
        """What the launcher's environment needs for it.

        Raises:
            RunFailed: The library cannot be compiled.
        """
        library, file = self.folder / "stepped_clock.so", self.folder / "clock_step"
        compiler = next((found for name in COMPILERS if (found := shutil.which(name))), None)
        if compiler is None:
            raise RunFailed(why_not())
        command = [compiler, "-shared", "-fPIC", "-O1", "-o", str(library), str(SOURCE), "-ldl", "-lpthread"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=COMPILES_S, check=False)
        if done.returncode:
            raise RunFailed(f"{SOURCE.name} could not be compiled: {done.stderr.strip()}")
        file.write_bytes(struct.pack("=q", 0))
        before = os.environ.get("LD_PRELOAD", "")
        return {
            "LD_PRELOAD": f"{library}:{before}" if before else str(library),
            "FULMAR_STEPPED_NODE": f"__node:={self.node}",
            "FULMAR_CLOCK_STEP": str(file),
        }

    def step(self, by_s: float) -> None:
        """Let the clock be ahead of what it was at first by so much from now on [s]."""
        with (self.folder / "clock_step").open("r+b") as file:
            file.write(struct.pack("=q", round(1e9 * by_s)))


def why_not() -> str:
    """Why no clock can step here; empty if one can."""
    if any(shutil.which(name) for name in COMPILERS):
        return ""
    return f"a clock that steps needs a C compiler ({', '.join(COMPILERS)})"
