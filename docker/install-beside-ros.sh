#!/bin/sh -eu
# Makes /opt/fulmar on a system that has ROS from apt, in a builder stage; the environment sees the packages of the system.
#   install-beside-ros.sh wheels    what Fulmar needs beside ROS, in the versions of our lock; NumPy stays that of the system,
#                                   against which rclpy is built
#   install-beside-ros.sh fulmar    Fulmar
pip="/opt/fulmar/bin/python -m pip --disable-pip-version-check --no-cache-dir --quiet"
case "$1" in
    wheels)
        python3 -m venv --system-site-packages /opt/fulmar
        # Constraints have no hashes and no extras.
        sed -n 's/^\([a-z0-9].*==.*\) \\$/\1/p' requirements.lock | grep -vE '^(ros-|numpy==|[^ ]*\[)' > /tmp/constraints.txt
        python3 -c 'import numpy; print(f"numpy=={numpy.__version__}")' >> /tmp/constraints.txt
        python3 -c '
import tomllib
project = tomllib.load(open("pyproject.toml", "rb"))
extras = project["project"]["optional-dependencies"]
wanted = project["project"]["dependencies"] + project["dependency-groups"]["build"]
for extra in ("sim", "policy", "bags", "hardware", "view"):
    wanted += extras[extra]
print("\n".join(wanted))' > /tmp/wanted.txt
        $pip install --constraint /tmp/constraints.txt --requirement /tmp/wanted.txt
        ;;
    fulmar)
        $pip install --no-deps --no-build-isolation .
        $pip uninstall --yes pip
        find /opt/fulmar -name __pycache__ -prune -exec rm -rf {} +
        ;;
esac
