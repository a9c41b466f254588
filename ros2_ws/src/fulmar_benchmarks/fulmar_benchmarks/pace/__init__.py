"""Pace of lock step, beside a pair of nodes that compute nothing."""
