"""The state estimator beside the mean of 30 poses that RoboRAN deploys, on the same noisy data."""
