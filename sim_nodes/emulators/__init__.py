"""Emulated devices: they speak a real device's protocol, with a simulator behind them.

Each is written from the protocol and shares no code with its driver, so that one mistake cannot hide another.
"""
