"""`fulmar commission`: pulses each wire of a real robot and identifies the actuator behind it."""
