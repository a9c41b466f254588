"""What the loss of a node of a system means: the one definition for every launcher."""

from __future__ import annotations

RESTARTS = "restarts"  # it takes no robot's control away: it is started again, and that is reported
ENDS = "ends"  # the robot ends: its refuge comes first, then every process is stopped
LOSSES = (RESTARTS, ENDS)
