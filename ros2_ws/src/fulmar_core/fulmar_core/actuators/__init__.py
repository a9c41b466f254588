"""Actuators: what a command means in forces, one kind a file."""
