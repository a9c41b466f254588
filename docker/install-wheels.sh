#!/bin/sh -eu
# Makes /opt/fulmar with everything but Fulmar, in a builder stage: install-wheels.sh LOCK [more arguments of pip, for what no lock has]
# A layer of its own: it is made again only when a lock, this script or tf2_msgs changes.
lock=$1
shift
pip="/opt/fulmar/bin/python -m pip --disable-pip-version-check --no-cache-dir --quiet"
python3 -m venv /opt/fulmar
$pip install --require-hashes -r "$lock"
if [ $# -gt 0 ]; then $pip install --no-deps "$@"; fi
# What `fulmar install-tf` does, which is not here yet.
PYTHONPATH=ros2_ws/src/fulmar_core:ros2_ws/src/fulmar_bringup /opt/fulmar/bin/python -c \
    'from fulmar_bringup.message_build import install_messages; install_messages("tf2_msgs", print)'
