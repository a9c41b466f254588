"""Gravity at the ground."""

GRAVITY = 9.81  # [m/s²]
