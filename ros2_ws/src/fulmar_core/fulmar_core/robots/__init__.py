"""Robots as their files describe them: body, actuators, sensors, airframe, calibration, and topics."""
