"""Simulation in batches: episodes, trajectories, metrics, and the seam to other simulators."""
