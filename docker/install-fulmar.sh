#!/bin/sh -eu
# Adds Fulmar to /opt/fulmar, and removes what a running system never reads.
pip="/opt/fulmar/bin/python -m pip --disable-pip-version-check --no-cache-dir --quiet"
$pip install --no-deps --no-build-isolation .

# Headers, CMake files, tests of libraries, pip itself.
site=$(echo /opt/fulmar/lib/python3*/site-packages)
rm -rf /opt/fulmar/include /opt/fulmar/lib/cmake /opt/fulmar/share/*/cmake
find "$site/numpy" "$site/scipy" -type d -name tests -prune -exec rm -rf {} +
$pip uninstall --yes pip
find /opt/fulmar -name __pycache__ -prune -exec rm -rf {} +
