"""Airframes: coefficients, ground effect, propulsion, and the air."""
