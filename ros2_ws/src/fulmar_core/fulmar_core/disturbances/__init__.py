"""Disturbances: what differs from the nominal robot and world, drawn once an episode."""
