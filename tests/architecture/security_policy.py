"""Sensor topics of configs/security/policy.xml, made of the table: `python -m tests.architecture.security_policy`."""

from __future__ import annotations

import re
from pathlib import Path

from fulmar_core.robots.topics import SENSOR_WIRES

POLICY = Path(__file__).resolve().parents[2] / "configs/security/policy.xml"
BEGIN = "<!-- sensors: python -m tests.architecture.security_policy -->"
END = "<!-- end of sensors -->"
_BLOCK = re.compile(rf"( *){re.escape(BEGIN)}\n.*?{re.escape(END)}\n", re.DOTALL)


def with_sensors(policy: str) -> str:
    """A policy file whose marked blocks name the topic of every sensor."""

    def block(found: re.Match[str]) -> str:
        lines = (BEGIN, *(f"<topic>{wire.name}</topic>" for wire in SENSOR_WIRES.values()), END)
        return "".join(f"{found[1]}{line}\n" for line in lines)

    return _BLOCK.sub(block, policy)


if __name__ == "__main__":
    POLICY.write_text(with_sensors(POLICY.read_text(encoding="utf-8")), encoding="utf-8")
