"""A recorded run as arrays of NumPy: python read_a_bag.py BAG"""

import sys
from pathlib import Path

import numpy as np

from fulmar_bags.run_record import read_run

run = read_run(Path(sys.argv[1]))
time_s = run.odom.stamp_s - run.odom.stamp_s[0]
position, speed = (
    run.odom.position,
    np.linalg.norm(run.odom.velocity_in_world, axis=1),
)  # (n, 3) [m], (n,) [m/s]
length = np.linalg.norm(np.diff(position, axis=0), axis=1).sum()

print(
    f"{run.info['robot']}, {run.info['task']}, {run.info['controller']}: {len(time_s)} states in {time_s[-1]:.1f} s"
)
print(f"path {length:.2f} m long, at most {speed.max():.2f} m/s; {len(run.goals)} goals")
for name, share in zip(run.actuation.names, np.abs(run.actuation.effort).mean(axis=0), strict=True):
    print(f"  {name}: {share:.2f} on average")
