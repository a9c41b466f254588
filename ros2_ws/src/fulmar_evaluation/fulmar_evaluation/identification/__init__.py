"""From driven runs back to models: mass, inertia, thrust, delay, drag and wheel scale, with intervals.

`docs/identification.md` has the theory: what can be known from which runs, and why.
"""
