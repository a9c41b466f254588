"""Worlds: what differs from the nominal robot and its surroundings, drawn once an episode."""
