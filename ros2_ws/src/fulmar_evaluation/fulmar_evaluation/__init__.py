"""How a controller or a run did: evaluation, re-run, plots, reports, fault suite.

May import everything but benchmarks and the command line.
"""
