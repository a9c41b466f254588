"""Estimators of pose, velocity and attitude from the readings of sensors."""
