"""The plots of the benchmark."""
