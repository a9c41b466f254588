"""Fault awareness: what the actuators really do, told from what was commanded and how the body moved."""
