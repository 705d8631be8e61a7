#!/usr/bin/env bash
# Runs a slice of selftest, conformance and random elision on a device with the behaviors of
# gpu_like.cpp: a larger slice for several of them.
# Usage: run.sh LIBRARY BEHAVIORS POSTCHAIN CONFORMANCE_TESTS ELISION_RANDOM_TESTS
set -euo pipefail
library=$1 behaviors=$2 postchain=$3 conformance=$4 elision=$5
pass=motion_blur properties='*.SameBitsOnEveryRun/*' seeds=(3 153)
if [[ $behaviors == *,* ]]; then
    pass=joint_blur properties+=':*.HalfStorageStaysNearItsReference/*' seeds+=(78 228 303 378)
fi

if [[ $behaviors == *contract* ]]; then
    seeds+=(198)
fi

as_gpu() {
    LD_PRELOAD=$library POSTCHAIN_GPU_LIKE=$behaviors POSTCHAIN_GPU_LIKE_SEED=1 "$@"
}
as_gpu "$postchain" selftest --only "$pass"
as_gpu "$conformance" --gtest_brief=1 --gtest_filter="$properties"
for seed in "${seeds[@]}"; do
    POSTCHAIN_ELISION_SEED=$seed as_gpu "$elision" --gtest_brief=1
done
