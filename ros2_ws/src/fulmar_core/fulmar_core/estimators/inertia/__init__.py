"""Estimators of the inertia of a satellite from its gyroscope and the speeds of its wheels."""
