"""Sensors: how a true state becomes a measured one, the same in training and in simulation."""
