"""Wires: names of robots and topics, readings, and the period of lock step."""
