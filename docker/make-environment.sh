#!/bin/sh -eu
# Makes /opt/fulmar, in the builder stage: make-environment.sh LOCK [more arguments of pip, for what no lock has]
lock=$1
shift
pip="/opt/fulmar/bin/python -m pip --disable-pip-version-check --no-cache-dir --quiet"
python3 -m venv /opt/fulmar
$pip install --require-hashes -r "$lock"
if [ $# -gt 0 ]; then $pip install --no-deps "$@"; fi
$pip install --no-deps --no-build-isolation .
/opt/fulmar/bin/fulmar install-tf

# What a running system never reads: headers, CMake files, tests of libraries, pip itself.
site=$(echo /opt/fulmar/lib/python3*/site-packages)
rm -rf /opt/fulmar/include /opt/fulmar/lib/cmake /opt/fulmar/share/*/cmake
find "$site/numpy" "$site/scipy" -type d -name tests -prune -exec rm -rf {} +
$pip uninstall --yes pip
find /opt/fulmar -name __pycache__ -prune -exec rm -rf {} +
