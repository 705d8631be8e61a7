"""steps_bench measures every step once: the steps and sums of its tables agree.

    steps_bench_test.py STEPS_BENCH
"""
import re
import subprocess
import sys


def bench(*arguments):
    return subprocess.run([sys.argv[1], *arguments], capture_output=True, text=True, check=False)


tables = bench("--size=96x54", "--iterations=1", "--steps", "fast", "motion_blur").stdout.split("\n\n")[1:]
*steps, sums = [[re.split(r" *\| *", row.strip("| ")) for row in table.splitlines()] for table in tables]
sums = {name: [float(value) for value in values] for name, *values in sums[2:]}
assert list(sums) == ["guertin", "paper", "fast", "motion_blur"], sums
for (name, _), _, *rows in steps:
    *parts, total = sums[name][:4]
    assert abs(sum(float(ms) for _, ms in rows) - total) < 0.06 * len(rows), name
    assert abs(sum(parts) - total) < 0.2, name
fast = dict(steps[2][2:])
assert list(fast)[-1] == "1.fxaa.fxaa", fast
assert float(fast["0.joint_blur.gather"]) == sums["fast"][1], fast
assert sums["fast"][2] > 0 == sums["motion_blur"][2] and sums["guertin"][6] == 1, sums
for word in ("--sise=2", "fsat"):
    done = bench(word)
    assert done.returncode and word in done.stderr, done.stderr
