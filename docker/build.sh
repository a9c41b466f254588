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
# Stages and images [MiB] with overlay file systems; vfs copies each layer.
NEEDED_MIB=8000
NEEDED_VFS_MIB=20000

fail() {
    echo "docker/build.sh: $1" >&2
    exit "${2:-1}"
}

find_engine() {
    for each in ${ENGINE:-docker podman buildah}; do
        if command -v "$each" > /dev/null && "$each" info > /dev/null 2>&1; then
            echo "$each"
            return
        fi
    done
    fail "no engine works (${ENGINE:-docker, podman, buildah}). On Debian and Ubuntu: apt install buildah debootstrap" 2
}

# Where the engine keeps its images.
storage() {
    case "$engine" in
        docker) docker info --format '{{.DockerRootDir}}' ;;
        podman) podman info --format '{{.Store.GraphRoot}}' ;;
        buildah) buildah info --format '{{index .store "GraphRoot"}}' ;;
    esac
}

check_space() {
    local folder needed=$NEEDED_MIB free
    [ "${STORAGE_DRIVER:-}" != vfs ] || needed=$NEEDED_VFS_MIB
    folder=$(storage) || fail "$engine does not name the folder of its images"
    [ -d "$folder" ] || return 0 # on another machine, as Docker Desktop has it
    free=$(df -BM --output=avail "$folder" | tail -n 1 | tr -dc 0-9)
    [ "$free" -ge "$needed" ] || fail "$folder has $free MiB free, and a build takes $needed: make room there"
}

# Makes Debian as an image on this machine. Each step needs its own `|| fail`: errexit does not reach into $(...) of a condition.
make_base() {
    [ "$engine" = buildah ] || fail "$REGISTRY_BASE cannot be pulled. Name another image of Debian: BASE=NAME $0" 2
    command -v debootstrap > /dev/null || fail "debootstrap is missing: apt install debootstrap" 2
    echo "no registry: making $LOCAL_BASE by debootstrap" >&2
    local folder container
    folder=$(mktemp -d) || fail "no temporary folder can be made"
    # shellcheck disable=SC2064 # the folder of now
    trap "rm -rf '$folder'" EXIT
    debootstrap --variant=minbase --include=ca-certificates "$SUITE" "$folder/debian" > "$folder/log" 2>&1 || {
        tail -n 3 "$folder/log" >&2
        fail "debootstrap failed, see above"
    }
    # debootstrap copies the resolver and the name of this machine.
    rm -rf "$folder"/debian/var/cache/apt/archives/*.deb "$folder"/debian/var/lib/apt/lists/* || fail "debootstrap's archives cannot be removed"
    : > "$folder/debian/etc/resolv.conf" || fail "etc/resolv.conf of the base cannot be written"
    echo localhost > "$folder/debian/etc/hostname" || fail "etc/hostname of the base cannot be written"
    container=$(buildah from scratch) || fail "buildah cannot make an empty container, see above"
    buildah add --quiet "$container" "$folder/debian" / > /dev/null || fail "buildah cannot copy the base, see above"
    buildah commit --quiet "$container" "$LOCAL_BASE" > /dev/null || fail "buildah cannot commit $LOCAL_BASE, see above"
    buildah rm "$container" > /dev/null || fail "buildah cannot remove its container, see above"
}

find_base() {
    if [ -n "${BASE:-}" ]; then
        echo "$BASE"
        return
    fi
    if "$engine" pull --quiet "$REGISTRY_BASE" > /dev/null 2>&1; then
        echo "$REGISTRY_BASE"
        return
    fi
    "$engine" inspect "$LOCAL_BASE" > /dev/null 2>&1 || make_base || exit
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
engine=$(find_engine)
check_space
base=$(find_base)
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' pyproject.toml)
revision=$(git rev-parse HEAD 2> /dev/null || true)

build=("$engine" build)
[ "$engine" != buildah ] || build=(buildah build --layers)
for target in "${targets[@]}"; do
    echo "fulmar:$target, by $engine on $base" >&2
    # shellcheck disable=SC2086 # several options
    "${build[@]}" ${MOUNTS:-} --build-arg "BASE=$base" --build-arg "VERSION=$version" --build-arg "REVISION=$revision" \
        ${CUDA:+--build-arg "CUDA=$CUDA"} ${TORCH_INDEX:+--build-arg "TORCH_INDEX=$TORCH_INDEX"} \
        --target "$target" --tag "fulmar:$target" --file docker/Dockerfile .
done
"$engine" images | grep -E "REPOSITORY|fulmar"
