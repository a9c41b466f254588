"""UDP ports of the middleware."""

from __future__ import annotations

FIRST, EACH = 7400, 250  # domain d has the ports from 7400 + 250 d on (OMG DDSI-RTPS 2.5, 9.6.2.3)
LOWEST = 7000  # where Fast DDS begins to look for one, for an address that a profile gives without a port


def ports_of_domain(domain: int) -> frozenset[int]:
    """Ports on which nodes of a ROS domain may listen; those below 7400 are of every domain."""
    begin = FIRST + EACH * domain
    return frozenset((*range(LOWEST, FIRST), *range(begin, begin + EACH)))
