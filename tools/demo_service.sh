#!/usr/bin/env bash
# Installs the packages it needs, builds, renders the scene `wheels`, starts the service, filters the
# frames over HTTP and prints where they are. Usage: tools/demo_service.sh [FOLDER]
# (default: out/demo_service). The service runs until Ctrl-C; with POSTCHAIN_DEMO_STOPS=1 it stops at
# the end.
set -euo pipefail
folder=$(realpath -m "${1:-out/demo_service}")
cd "$(dirname "$0")/.."

tools/build_command.sh lab serve
postchain=$PWD/build/tools/apps/postchain/postchain

mkdir -p "$folder/wheels" "$folder/out"
echo "== rendering 4 frames of wheels"
"$postchain" scene wheels -o "$folder/wheels" --frames 1-4 --size 640x360 --on-existing overwrite

echo "== starting the service"
rm -f "$folder/address"
"$postchain" serve --root "$folder" --store "$folder/jobs.sqlite" --port 0 >"$folder/address" &
serving=$!
trap 'kill "$serving" 2>/dev/null || true; wait "$serving" || true' EXIT
while [[ ! -s $folder/address ]]; do
    kill -0 "$serving"
    sleep 0.1
done
service=$(<"$folder/address")

echo "== submitting a job, and following its events"
job=$(curl -sS --fail-with-body "${service}v1/jobs" -H 'Content-Type: application/json' -d '{
    "chain": "balanced", "input": "wheels/sharp.####.exr", "camera": "wheels/camera.json",
    "output": "out/wheels.####.exr", "png": true, "on_existing": "overwrite"}')
id=$(sed -E 's/.*"id":"([^"]*)".*/\1/' <<<"$job")
curl -sSN "${service}v1/jobs/$id/events"
curl -sS "${service}v1/jobs/$id" | grep -q '"state":"done"'

echo
echo "rendered:  $folder/wheels/sharp.0001.exr ... sharp.0004.exr"
echo "filtered:  $folder/out/wheels.0001.png ... wheels.0004.png, and as .exr"
echo "the page:  $service"
if [[ -z ${POSTCHAIN_DEMO_STOPS:-} ]]; then
    echo "the service is running; Ctrl-C stops it"
    wait "$serving"
fi
