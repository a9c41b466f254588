#!/usr/bin/env bash
# Builds the images that need no ROS from apt, with docker, podman or buildah: docker/build.sh [robot] [sim] [train]
#
# BASE     image of Debian; without it, and where no registry can be reached, debootstrap makes one
# ENGINE   docker, podman or buildah; the first that works by default
# MOUNTS   more options of the build, such as -v of certificates
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

SUITE=bookworm
REGISTRY_BASE=docker.io/library/debian:$SUITE-slim
LOCAL_BASE=localhost/fulmar-debian:$SUITE
NEEDED_MIB=6000 # stages of an image and their layers; without overlay file systems twice as much

fail() { echo "docker/build.sh: $1" >&2; exit "${2:-1}"; }

engine() {
    for each in ${ENGINE:-docker podman buildah}; do
        if command -v "$each" > /dev/null && "$each" info > /dev/null 2>&1; then echo "$each"; return; fi
    done
    fail "no engine works (${ENGINE:-docker, podman, buildah}). On Debian and Ubuntu: apt install buildah debootstrap" 2
}

# Debian as an image, made on this machine.
make_base() {
    [ "$engine" = buildah ] || fail "$REGISTRY_BASE cannot be pulled. Name another image of Debian: BASE=NAME $0"
    command -v debootstrap > /dev/null || fail "debootstrap is missing: apt install debootstrap" 2
    echo "no registry: making $LOCAL_BASE by debootstrap" >&2
    local root
    root=$(mktemp -d)
    debootstrap --variant=minbase --include=ca-certificates "$SUITE" "$root" > "$root.log" 2>&1 || {
        tail -n 3 "$root.log" >&2
        rm -rf "$root" "$root.log"
        fail "debootstrap failed, see above"
    }
    rm -rf "$root"/var/cache/apt/archives/*.deb "$root"/var/lib/apt/lists/* "$root.log"
    local container
    container=$(buildah from scratch)
    buildah add --quiet "$container" "$root" / > /dev/null
    buildah commit --quiet "$container" "$LOCAL_BASE" > /dev/null
    buildah rm "$container" > /dev/null
    rm -rf "$root"
}

base() {
    if [ -n "${BASE:-}" ]; then echo "$BASE"; return; fi
    if "$engine" pull --quiet "$REGISTRY_BASE" > /dev/null 2>&1; then echo "$REGISTRY_BASE"; return; fi
    "$engine" inspect "$LOCAL_BASE" > /dev/null 2>&1 || make_base
    echo "$LOCAL_BASE"
}

targets=("$@")
[ ${#targets[@]} -gt 0 ] || targets=(robot sim)
for target in "${targets[@]}"; do
    case "$target" in
        robot | sim | train) ;;
        *) fail "'$target' is no target. There are: robot, sim, train" 2 ;;
    esac
done

# Without a runtime for containers, buildah runs the steps in a chroot; without overlay file systems, it copies layers.
if ! command -v crun > /dev/null && ! command -v runc > /dev/null; then export BUILDAH_ISOLATION=${BUILDAH_ISOLATION:-chroot}; fi
if ! buildah info > /dev/null 2>&1; then export STORAGE_DRIVER=${STORAGE_DRIVER:-vfs}; fi
engine=$(engine)
free=$(df -BM --output=avail . | tail -n 1 | tr -dc 0-9)
[ "$free" -ge $NEEDED_MIB ] || echo "docker/build.sh: $free MiB are free; images take up to $NEEDED_MIB MiB" >&2
base=$(base)

build=("$engine" build)
[ "$engine" != buildah ] || build=(buildah build --layers)
for target in "${targets[@]}"; do
    echo "fulmar:$target, by $engine on $base" >&2
    # shellcheck disable=SC2086 # several options
    "${build[@]}" ${MOUNTS:-} --build-arg "BASE=$base" \
        ${CUDA:+--build-arg "CUDA=$CUDA"} ${TORCH_INDEX:+--build-arg "TORCH_INDEX=$TORCH_INDEX"} \
        --target "$target" --tag "fulmar:$target" --file docker/Dockerfile .
done
"$engine" images | grep -E "REPOSITORY|fulmar"
