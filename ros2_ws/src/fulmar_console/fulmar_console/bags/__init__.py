"""Bags on the page: read and sampled once, sent once, played there."""
