"""Actuation: what of an actuator changes while an episode runs."""
