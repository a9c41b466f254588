"""Devices that are not there: they speak a real device's protocol, and a simulator stands behind them.

Each is written from the protocol and shares no code with the driver that it is to prove: one mistake cannot hide
another.
"""
