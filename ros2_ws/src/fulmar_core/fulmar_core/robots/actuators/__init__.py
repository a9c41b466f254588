"""Actuators: what a command means in forces, one family a file, and `families.py` with a row for each."""
