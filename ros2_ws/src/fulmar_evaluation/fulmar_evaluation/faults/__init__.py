"""Faults done to a live system, and what it makes of them."""
