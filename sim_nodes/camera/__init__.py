"""A robot's camera in simulation: what it would see from a pose."""
