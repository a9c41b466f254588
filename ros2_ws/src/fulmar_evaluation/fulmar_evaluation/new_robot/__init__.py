"""Robot files from a robot that they are like, and from URDF and MJCF; needs MuJoCo only for MJCF."""
