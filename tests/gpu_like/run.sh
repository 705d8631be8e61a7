#!/usr/bin/env bash
# Runs selftest, and a slice of conformance and random elision, on a device with the behaviors of gpu_like.cpp.
# Usage: run.sh LIBRARY SLICE BEHAVIORS POSTCHAIN CONFORMANCE_TESTS ELISION_RANDOM_TESTS
set -euo pipefail
library=$1 slice=$2 behaviors=$3 postchain=$4 conformance=$5 elision=$6
half='*.HalfStorageStaysNearItsReference/*' same='*.SameBitsOnEveryRun/*'
case $slice in
    alone) pass=motion_blur properties=$same seeds=(3 153) ;;
    full) pass=joint_blur properties=$same:$half seeds=(3 78 153 198 228 303 378) ;;
    *) echo "run.sh: no slice '$slice'" >&2; exit 2 ;;
esac

as_gpu() {
    LD_PRELOAD=$library POSTCHAIN_GPU_LIKE=$behaviors "$@"
}
as_gpu "$postchain" selftest --only "$pass"
as_gpu "$conformance" --gtest_brief=1 --gtest_filter="$properties"
for seed in "${seeds[@]}"; do
    POSTCHAIN_ELISION_SEED=$seed as_gpu "$elision" --gtest_brief=1
done
