"""Torques of wheels that make the inertia of a satellite observable."""
