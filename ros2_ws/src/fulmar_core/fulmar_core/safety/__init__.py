"""Safety: pure state machines with injected time, the last word before anything moves."""
