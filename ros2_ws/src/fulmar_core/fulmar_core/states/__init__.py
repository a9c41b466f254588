"""States of a body in the plane and in space: rotations, attitudes, arrays, and numbers drawn by counters."""
