"""The control loop from measurement to command, missions, rollouts, and policy bundles."""
