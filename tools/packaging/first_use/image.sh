#!/usr/bin/env bash
# First use of the container image of the service: its entry point, its health check, a job.
# Usage: image.sh ARCHIVE.tar.gz NAME WORK     NAME: the image in the archive
# By podman in a container; without podman, or if the kernel lets it make none, by buildah in a chroot of the image. In
# both it has the network of this process, in which port 8080 must be free.
set -euo pipefail
archive=$1 name=$2 work=$3
rm -rf "$work"
mkdir -p "$work/shots" "$work/state"
storage=(--root "$work/containers" --runroot "$work/containers.run" --storage-driver vfs)
token=0123456789abcdef0123456789abcdef
volumes=(-v "$work/shots:/srv/postchain" -v "$work/state:/var/lib/postchain"
    -v "$work/users.yaml:/etc/postchain/users.yaml:ro")
chown nobody:nogroup "$work/shots" "$work/state"
pid=
stop() {
    [[ -z $pid ]] || kill "$pid" 2>/dev/null || true
    [[ -z $pid ]] || wait "$pid" || true
    rm -rf "$work/containers" "$work/containers.run" "$work/image.tar"
}
trap stop EXIT

gzip -dc "$archive" >"$work/image.tar"
podman=(podman "${storage[@]}" --cgroup-manager cgroupfs --events-backend file)
# crun knows no hybrid hierarchy of control groups.
! command -v runc >/dev/null || podman+=(--runtime runc)
container=
if command -v podman >/dev/null; then
    "${podman[@]}" load -q -i "$work/image.tar"
    # podman's own limits are above those that this process may set, and its timer of the health check needs systemd.
    run=("${podman[@]}" run --rm --network host --no-healthcheck --ulimit "nofile=$(ulimit -n):$(ulimit -n)"
        --ulimit "nproc=10000:10000")
    if "${run[@]}" --entrypoint postchain "$name" --version; then
        container=podman
    else
        echo "podman can run no container here"
    fi
fi
if [[ -z $container ]]; then
    container=$(buildah "${storage[@]}" from "docker-archive:$work/image.tar")
    run=(buildah "${storage[@]}" run --isolation chroot)
    "${run[@]}" "$container" -- postchain --version
fi
in_image() { # COMMAND...: in the image, as its user; with start=exec in place of this process
    if [[ $container == podman ]]; then
        ${start:-} "${run[@]}" "${volumes[@]}" --entrypoint "$1" "$name" "${@:2}"
    else
        ${start:-} "${run[@]}" "${volumes[@]}" "$container" -- "$@"
    fi
}
echo -n "$token" >"$work/shots/token"
touch "$work/users.yaml"
hash=$(in_image postchain serve --hash-token /srv/postchain/token)
printf 'postchain_users: 1\nusers: {admin: {admin: true, tokens: [%s]}}\n' "$hash" >"$work/users.yaml"
in_image postchain scene wheels -o /srv/postchain/shots --frames 1-2 --size 160x90 --device software

# words PATH: the words of a list in the image's configuration, a line each.
words() {
    buildah "${storage[@]}" inspect --type image "$name" | python3 -c '
import functools, json, sys
config = json.load(sys.stdin)["Docker"]["config"]
print(*functools.reduce(dict.get, sys.argv[1:], config), sep="\n")' "$@"
}
mapfile -t entry < <(words Entrypoint)
mapfile -t health < <(words Healthcheck Test)
echo "entry point: ${entry[*]}"
start=exec in_image "${entry[@]}" &
pid=$!
ask() { curl -sS --fail-with-body -H "Authorization: Bearer $token" "http://127.0.0.1:8080$1" "${@:2}"; }
for ((i = 0; i < 300; ++i)); do
    ask /readyz >/dev/null 2>&1 && break
    kill -0 "$pid"
    sleep 0.2
done
in_image "${health[@]:1}"
echo "the health check passes"
ask /v1/jobs -H 'Content-Type: application/json' -d '{"kind": "run", "chain": "fast", "input": "shots/sharp.####.exr",
    "camera": "shots/camera.json", "output": "wheels.####.exr"}'
echo
ask /v1/jobs/1/events -N
ask /v1/jobs/1 | grep -q '"state":"done"'
ls -l "$work/shots"
echo "the image ran a job, $([[ $container == podman ]] && echo "in a container of podman" || echo "in a chroot by buildah")"
