# Fulmar on ROS 2 Lyrical from apt (Ubuntu 26.04, Python 3.14), for amd64 and arm64: docker build -f docker/lyrical.Dockerfile -t fulmar:lyrical .
# rclpy, the messages and tf2_msgs are those of the base image; other libraries come from wheels, in an environment that
# sees the packages of the system.
ARG BASE=docker.io/library/ros:lyrical
FROM ${BASE} AS builder
RUN apt-get update \
    && apt-get install --yes --no-install-recommends python3-venv g++ python3-dev \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /src
COPY . .
RUN python3 -m venv --system-site-packages /opt/fulmar \
    && /opt/fulmar/bin/pip install --no-cache-dir ".[sim,policy,bags,hardware,view]"

FROM ${BASE}
COPY --from=builder /opt/fulmar /opt/fulmar
RUN useradd --create-home --shell /usr/sbin/nologin fulmar \
    && install --directory --owner=fulmar --group=fulmar /runs
ENV PATH=/opt/fulmar/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    PYTHONDONTWRITEBYTECODE=1 \
    MPLCONFIGDIR=/tmp/matplotlib \
    ROS_HOME=/tmp/ros
WORKDIR /
USER fulmar
STOPSIGNAL SIGTERM
# The base image's own entry point sources ROS.
ENTRYPOINT ["/ros_entrypoint.sh", "fulmar"]
CMD ["--help"]
