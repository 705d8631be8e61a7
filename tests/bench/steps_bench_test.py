"""steps_bench measures every step once: the chains, steps and sums of its tables and JSON agree.

    steps_bench_test.py STEPS_BENCH
"""
import json
import pathlib
import subprocess
import sys
import tempfile

with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder) / "steps.json"
    done = subprocess.run([sys.argv[1], "--size=96x54", "--iterations=1", "--steps",
                           f"--json={path}", "fast", "motion_blur"],
                          stdout=subprocess.PIPE, text=True, check=True)
    report = json.loads(path.read_text())
    chains = {chain["chain"]: chain for chain in report["chains"]}
    assert list(chains) == ["guertin", "paper", "fast", "motion_blur"], list(chains)
    for name, chain in chains.items():
        total = sum(step["cpu_ms"] for step in chain["steps"])
        assert all(step["cpu_ms"] > 0 for step in chain["steps"]), chain
        parts = chain["fixed_ms"] + chain["gather_ms"] + chain["after_ms"]
        assert abs(total - parts) < 1e-9 and abs(total - chain["sum_ms"]) < 1e-9, chain
        assert f"\n| {name} | ms |\n" in done.stdout, done.stdout
    names = [step["step"] for step in chains["fast"]["steps"]]
    assert "0.joint_blur.gather" in names and "1.fxaa.fxaa" in names, names
    assert chains["fast"]["gather_ms"] == next(
        step["cpu_ms"] for step in chains["fast"]["steps"] if step["step"] == "0.joint_blur.gather")
    assert chains["fast"]["after_ms"] > 0 and chains["motion_blur"]["after_ms"] == 0, chains
    row = next(line for line in done.stdout.splitlines() if line.startswith("| guertin | ")
               and line.count("|") == 10)
    assert row.split(" | ")[7] == "1.00", row
    done = subprocess.run([sys.argv[1], "--sise=2"], stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2 and "--sise=2: usage: steps_bench [--input=" in done.stderr
    done = subprocess.run([sys.argv[1], "fsat"], stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode != 0 and "fsat" in done.stderr, done.stderr
