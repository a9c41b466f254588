"""Which actuator each wire of a robot drives, identified from the motion that short pulses cause."""
