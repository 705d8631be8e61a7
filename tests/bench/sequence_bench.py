#!/usr/bin/env python3
"""The whole command on a sequence against oiiotool, which reads and writes the same channels, its peak
memory over 1000 frames against that over 10, and the CPU time of short calls.

    tests/bench/sequence_bench.py [--pairs 5] [--copy-level 4] [--run WORD]... [A.exr B.exr --camera FILE]

Two frames, by default of `postchain scene wheels`, become 24 numbered copies. oiiotool runs in its best form,
which is chosen by CPU time before the pairs: one process for all frames, with channels kept in their types (by
default it writes each as float, which is slower and larger). Deflate levels differ between zlib and libdeflate,
so the ratio of the sizes is printed beside the times. CPU time is user and system, of all threads.
"""
import argparse
import dataclasses
import json
import os
import pathlib
import re
import shutil
import statistics
import subprocess
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
FRAMES, LONG, SHORT = 24, 1000, 10
STARTS = 15  # of each short call


@dataclasses.dataclass
class Cost:
    wall_s: float = 0
    cpu_s: float = 0
    peak_mib: float = 0  # resident

    def __add__(self, other):
        return Cost(self.wall_s + other.wall_s, self.cpu_s + other.cpu_s, max(self.peak_mib, other.peak_mib))


def run(*command):
    """The cost of a run that succeeds; its standard output is dropped."""
    words = [str(word) for word in command]
    start = time.monotonic()
    with subprocess.Popen(words, stdout=subprocess.DEVNULL) as process:
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"exit code {process.returncode}: {' '.join(words)}")
    return Cost(time.monotonic() - start, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024)


def spread(values, digits):
    """Median, minimum and maximum."""
    return f"{statistics.median(values):.{digits}f} ({min(values):.{digits}f}-{max(values):.{digits}f})"


def render(options, folder, size):
    """Two frames and their camera file."""
    run(options.postchain, "scene", "wheels", "-q", "-o", folder, "--size", size, "--frames", "1-2")
    return [folder / "sharp.0001.exr", folder / "sharp.0002.exr"], folder / "camera.json"


def fill(folder, sources, frames):
    """Frames from 1 on, copies of the sources in turn."""
    folder.mkdir()
    for i in range(frames):
        shutil.copyfile(sources[i % len(sources)], folder / f"in.{i + 1:04d}.exr")
    return folder


def run_chain(options, source, camera, frames, out):
    return run(options.postchain, "run", "paper", "-q", "--on-existing", "overwrite", "--camera", camera, "--frames",
               f"1-{frames}", "-i", source / "in.####.exr", "-o", out / "out.####.exr", "--mkdir", *options.run)


def kept_types(path):
    """Options of oiiotool for each half channel, with its full name."""
    done = subprocess.run(["oiiotool", "--info", "-v", path], capture_output=True, text=True, check=True)
    channels = re.search(r"channel list: (.*)", done.stdout)[1].split(", ")
    return [word for channel in channels if channel.endswith(" (half)")
            for word in ("-d", channel.removesuffix(" (half)") + "=half")]


def copiers(options, source, out, types):
    """Name -> a call that copies all frames."""
    ending = ["--compression", f"zip:{options.copy_level}", "-o"]

    def at_once(kept):
        return run("oiiotool", "--frames", f"1-{FRAMES}", source / "in.%04d.exr", *kept, *ending, out / "out.%04d.exr")

    def one_by_one():
        return sum((run("oiiotool", source / f"in.{i:04d}.exr", *types, *ending, out / f"out.{i:04d}.exr")
                    for i in range(1, FRAMES + 1)), Cost())
    return {"one process, all channels float": lambda: at_once([]), "one process, types kept": lambda: at_once(types),
            "a process per frame, types kept": one_by_one}


def print_stages(out):
    """Time of each stage of the chain, from the sidecars; the first frame compiles shaders."""
    times = {}
    for i in range(2, FRAMES + 1):
        found = json.loads((out / f"out.{i:04d}.exr.json").read_text("utf8"))["times_ms"]
        stages = [(stage, found[stage]) for stage in ("read", "convert", "filter", "write")]
        for name, ms in stages + [("  " + one["name"], one["ms"]) for one in found["passes"]]:
            times.setdefault(name, []).append(ms)
    print(f"\nmilliseconds of wall clock per frame, median of frames 2 to {FRAMES} (stages of\n"
          "neighboring frames overlap and slow each other: the sum is more than a frame)")
    for name, all_ms in times.items():
        print(f"  {name:20} {statistics.median(all_ms):8.1f}")


def bytes_in(folder):
    return sum(path.stat().st_size for path in folder.glob("*.exr"))


def compare_with_copy(options, folder, sources, camera):
    source, out, copied = fill(folder / "in", sources, FRAMES), folder / "out", folder / "copied"
    copied.mkdir()
    calls = copiers(options, source, copied, kept_types(sources[0]))
    print(f"oiiotool, CPU seconds for {FRAMES} frames:")
    next(iter(calls.values()))()  # warms the file cache
    cpu = {name: call().cpu_s for name, call in calls.items()}
    for name, seconds in cpu.items():
        print(f"  {name:32} {seconds:7.2f}")
    chosen = min(cpu, key=cpu.get)
    print(f"chosen: {chosen}\n")
    heads = ("chain s", "copy s", "ratio", "chain CPU", "copy CPU", "ratio")
    print("pair " + " ".join(f"{head:>10}" for head in heads))
    wall_ratios, cpu_ratios = [], []
    for pair in range(1, options.pairs + 1):
        chain, copy = run_chain(options, source, camera, FRAMES, out), calls[chosen]()
        wall_ratios.append(chain.wall_s / copy.wall_s)
        cpu_ratios.append(chain.cpu_s / copy.cpu_s)
        row = (chain.wall_s, copy.wall_s, wall_ratios[-1], chain.cpu_s, copy.cpu_s, cpu_ratios[-1])
        print(f"{pair:4} " + " ".join(f"{value:10.2f}" for value in row), flush=True)
    print(f"chain over copy, median (range): wall clock {spread(wall_ratios, 2)}, CPU {spread(cpu_ratios, 2)}; "
          f"bytes written {bytes_in(out) / bytes_in(copied):.2f}")
    print_stages(out)


def compare_memory(options, folder):
    sources, camera = render(options, folder / "small", "96x54")
    source = fill(folder / "small_in", sources, LONG)
    short, long = (run_chain(options, source, camera, frames, folder / "small_out").peak_mib
                   for frames in (SHORT, LONG))
    print(f"\npeak memory: {short:.1f} MiB over {SHORT} frames of 96x54, {long:.1f} MiB over {LONG}: "
          f"ratio {long / short:.3f}")


def time_starts(options, folder):
    """Calls over a frame of 64x36, in turn. The first round fills Mesa's shader cache and does not count."""
    sources, camera = render(options, folder / "start", "64x36")
    frame = ["-i", sources[0], "--camera", camera]
    filtered = ["run", "paper", *frame, "-o", folder / "started.exr", "-q", "--on-existing", "overwrite"]
    calls = {"--version": ["--version"], "plan paper": ["plan", "paper", *frame], "run paper": filtered,
             "run paper --png": [*filtered, "--png"]}
    times = {name: [] for name in calls}
    for turn in range(STARTS + 1):
        for name, words in calls.items():
            ms = 1e3 * run(options.postchain, *words).cpu_s
            if turn:
                times[name].append(ms)
    print("\nCPU ms of a call, median (range):")
    for name, all_ms in times.items():
        print(f"  {name:20} {spread(all_ms, 0)}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("frames", nargs="*", type=pathlib.Path)
    parser.add_argument("--camera", type=pathlib.Path)
    parser.add_argument("--postchain", default=ROOT / "build/tools/apps/postchain/postchain")
    parser.add_argument("--pairs", type=int, default=5)
    parser.add_argument("--run", action="append", default=[], metavar="WORD", help="further words of postchain run")
    parser.add_argument("--copy-level", type=int, default=4, help="of oiiotool's ZIP; 4 is OpenEXR's default")
    options = parser.parse_args()
    if options.frames and (len(options.frames) != 2 or not options.camera):
        parser.error("give two files and their camera")
    if not shutil.which("oiiotool"):
        parser.exit(77, "skipped: no oiiotool; install: openimageio-tools\n")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        sources, camera = (options.frames, options.camera) if options.frames else \
            render(options, folder / "scene", "1280x720")
        compare_with_copy(options, folder, sources, camera)
        compare_memory(options, folder)
        time_starts(options, folder)


if __name__ == "__main__":
    main()
