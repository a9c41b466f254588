"""The front door: the command line and the launcher.

May import everything, and nothing imports it.
"""
