# Fulmar on ROS 2 Lyrical from apt (Ubuntu 26.04, Python 3.14), for amd64 and arm64: docker build -f docker/lyrical.Dockerfile -t fulmar:lyrical .
# rclpy, the messages and tf2_msgs are those of the base image; other libraries come from wheels, in an environment that
# sees the packages of the system.
ARG BASE=docker.io/library/ros:lyrical
FROM ${BASE} AS builder
RUN apt-get update \
    && apt-get install --yes --no-install-recommends python3-venv python3-numpy g++ python3-dev \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /src
COPY docker/install-beside-ros.sh docker/
COPY requirements.lock pyproject.toml ./
RUN docker/install-beside-ros.sh wheels
COPY . .
RUN docker/install-beside-ros.sh fulmar

FROM ${BASE}
# Ubuntu's images have a user `ubuntu` with the number 1000.
RUN apt-get update \
    && apt-get install --yes --no-install-recommends tini python3-numpy \
    && rm -rf /var/lib/apt/lists/* \
    && if id ubuntu > /dev/null 2>&1; then userdel --remove ubuntu; fi \
    && useradd --uid 1000 --create-home --shell /usr/sbin/nologin fulmar \
    && install --directory --owner=fulmar --group=fulmar /runs
ENV PATH=/opt/fulmar/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    PYTHONDONTWRITEBYTECODE=1 \
    MPLCONFIGDIR=/tmp/matplotlib \
    ROS_HOME=/tmp/ros
LABEL org.opencontainers.image.title="Fulmar" \
    org.opencontainers.image.description="Simulated and real robots, controllers and recorder, on ROS 2 Lyrical" \
    org.opencontainers.image.licenses="Apache-2.0"
COPY --from=builder /opt/fulmar /opt/fulmar
WORKDIR /
USER 1000:1000
STOPSIGNAL SIGTERM
# The base image's own entry point sources ROS.
ENTRYPOINT ["tini", "-s", "--", "/ros_entrypoint.sh", "fulmar"]
CMD ["--help"]
