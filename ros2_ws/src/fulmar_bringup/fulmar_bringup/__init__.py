"""Starts what others run: systems, node rows, supervisor, launch file, one run, commissioning."""
