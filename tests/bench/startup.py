#!/usr/bin/env python3
"""Cost of starting the command: CPU time of short runs, medians over --runs rounds.

    tests/bench/startup.py [--postchain build/tools/apps/postchain/postchain] [--against OTHER]

Each round makes all calls in turn, so that other load affects all of them. CPU time is user and
system, of all threads, of the whole process. The columns are medians in ms, with minimum and
maximum, and multiples of `--version`; with --against, another build of the command is called in turn,
and the ratio is the median of pairs. The first round fills Mesa's shader cache and is
not counted.
"""
import argparse
import pathlib
import statistics
import tempfile

from processes import run, spread


def calls(folder):
    """Name -> arguments, over a frame of 64x36 in the folder."""
    frame = ["-i", str(folder / "sharp.####.exr"), "--camera", str(folder / "camera.json")]
    filtered = ["run", "paper", *frame, "-o", str(folder / "out.####.exr"), "-q", "--on-existing",
                "overwrite"]
    return {"--version": ["--version"], "plan paper": ["plan", "paper", *frame],
            "run paper": filtered, "run paper --png": [*filtered, "--png"]}


def main():
    root = pathlib.Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--postchain", default=root / "build/tools/apps/postchain/postchain")
    parser.add_argument("--against", help="another build of the command")
    parser.add_argument("--runs", type=int, default=15)
    options = parser.parse_args()
    programs = [str(options.postchain)] + ([options.against] if options.against else [])
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        run(programs[0], "scene", "wheels", "-o", name, "--size", "64x36", "--frames", "1", "-q")
        times = {(call, program): [] for call in calls(folder) for program in programs}
        for turn in range(options.runs + 1):
            for call, arguments in calls(folder).items():
                for program in programs:
                    ms = 1e3 * run(program, *arguments).cpu_s
                    if turn:
                        times[call, program].append(ms)
    start = statistics.median(times["--version", programs[0]])
    print(f"{'call':22}{'CPU ms (least-most)':>24}{'x --version':>13}" +
          (f"{'--against, CPU ms':>24}{'ratio':>8}" if options.against else ""))
    for call in calls(folder):
        own = times[call, programs[0]]
        row = f"{call:22}{spread(own, 0):>24}{statistics.median(own) / start:>13.1f}"
        if options.against:
            other = times[call, options.against]
            ratio = statistics.median(a / b for a, b in zip(own, other))
            row += f"{spread(other, 0):>24}{ratio:>8.2f}"
        print(row)


if __name__ == "__main__":
    main()
