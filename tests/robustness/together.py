"""Several processes write the same outputs simultaneously, with each --on-existing.

In any interleaving: each frame exists once, complete, with the bits of a single process; no
temporary is left; a process ends with exit code 0, or names a file that another has made (fail: 5, or 1
if other frames were made).

    python3 tests/robustness/together.py build/tools/apps/postchain/postchain --work /tmp/together \\
        --rounds 20
"""
import argparse
import random
import subprocess
import sys
import time

import jobs

PROCESSES = 3


def together(command, chance):
    """(exit code, stderr) of processes that begin within a tenth of a second."""
    started = []
    for _ in range(PROCESSES):
        started.append(subprocess.Popen(command, stdout=subprocess.DEVNULL,
                                        stderr=subprocess.PIPE, text=True))
        time.sleep(chance.uniform(0, 0.1 / PROCESSES))
    outcomes = []
    for process in started:
        _, said = process.communicate(timeout=600)
        outcomes.append((process.returncode, said))
    return outcomes


def faults_of(outcomes, on_existing, out):
    said = []
    for code, text in outcomes:
        if code == 0:
            continue
        if on_existing != "fail":
            said.append(f"exit code {code}: {text.strip()}")
        elif code not in (1, 5) or "exists" not in text or str(out) not in text:
            said.append(f"exit code {code} with an unclear message: {text.strip()}")
    return said


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    jobs.add_options(parser)
    parser.add_argument("--rounds", type=int, default=10, help="rounds with each --on-existing")
    arguments = parser.parse_args()
    work = arguments.work.resolve()
    scene, out = work / "in", work / "out"
    jobs.make_scene(arguments.postchain, scene, 4)
    job = jobs.JOBS["run"]
    expected = jobs.undisturbed(job, arguments.postchain, scene, work / "new")
    faults = 0
    for on_existing in ("fail", "skip", "overwrite"):
        refused = 0
        for turn in range(arguments.rounds):
            jobs.empty(out)
            chance = random.Random(f"{on_existing} {turn}")
            outcomes = together(job.command(arguments.postchain, scene, out, on_existing), chance)
            said = faults_of(outcomes, on_existing, out)
            # With `fail`, every process may have been refused at another frame.
            whole = on_existing != "fail" or any(code == 0 for code, _ in outcomes)
            said += jobs.differences(out, expected, whole)
            said += [f"{path}: left behind" for path in jobs.temporaries(out)]
            refused += sum(code != 0 for code, _ in outcomes)
            for sentence in said:
                print(f"{on_existing}, round {turn}: {sentence}", flush=True)
            faults += len(said)
        print(f"{on_existing}: {arguments.rounds} rounds of {PROCESSES} processes, "
              f"{refused} refused", flush=True)
    print(f"{faults} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
