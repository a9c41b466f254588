"""Inertia of satellites from their wheels and gyroscopes, beside thesis §6.3."""
