"""Safety: pure state machines with injected time, the last check before anything moves."""
