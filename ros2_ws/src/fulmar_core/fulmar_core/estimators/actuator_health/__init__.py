"""Fault awareness: what the actuators really do, estimated from commands and motion."""
