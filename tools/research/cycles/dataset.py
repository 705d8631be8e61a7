#!/usr/bin/env python3
"""Renders the scenes of the test set and writes their manifest (docs/scenes.md).

    tools/research/cycles/dataset.py OUT [SCENE...] [--blender blender] [--threads N] [--limit N]
    tools/research/cycles/dataset.py OUT --check

One Blender runs at a time, as niced as this script. The images that tables need most, of all
scenes, come first. Repeat the command after an interruption: whole images are kept. --limit stops after N
runs of Blender that succeeded, with exit code 3 if more is to do. OUT/manifest.json lists the files with
checksums of their pixels; --check compares them with the manifest beside this script, which is that of
docs/quality.md.
"""
import argparse
import hashlib
import json
import os
import pathlib
import struct
import subprocess
import sys
import time

import request

SCENES = ["meadow", "glass", "canopy", "night", "acrobat", "whip", "facade", "rain", "station"]
SIZE = "640x360"
FRAMES = range(10, 14)
SAMPLES = 512  # of each half of ground truth, at most
MIN_SAMPLES = 192  # lamps that few samples hit are found before a pixel counts as converged
SHARP_SAMPLES = 96
TRUTH = [("both", 11), ("both", 12), ("mb", 11), ("dof", 11)]
HALVES = "ab"
BEHIND_FRAME = 11
PEERS = {"peer_vectorblur_best": "mb", "peer_defocus": "dof", "peer_both_best": "both"}  # their truths
MANIFEST = pathlib.Path(__file__).with_name("manifest.json")


def jobs():
    """(files, script, options) in the order of rendering, for each scene in turn."""
    yield ([f"sharp.{frame:04d}.exr" for frame in FRAMES], "render.py",
           ["--kinds", "sharp", "--frames", f"{FRAMES[0]}-{FRAMES[-1]}"])
    yield [f"behind.{BEHIND_FRAME:04d}.exr"], "render.py", ["--kinds", "behind", "--frames", str(BEHIND_FRAME)]
    for kind, frame in TRUTH:
        for half in HALVES:
            yield ([f"{kind}_{half}.{frame:04d}.exr"], "render.py",
                   ["--kinds", kind, "--frames", str(frame), "--half", half])
    for frame in sorted({frame for _, frame in TRUTH}):
        yield ([f"{name}.{frame:04d}.exr" for name, kind in PEERS.items() if (kind, frame) in TRUTH],
               "peers.py", [str(frame)])


def dataset_files():
    """Names of all files of a scene."""
    names = ["camera.json"] + [name for files, *_ in jobs() for name in files]
    names += [f"{kind}.{frame:04d}.exr" for kind, frame in TRUTH]
    return names + [f"peers.{frame:04d}.json" for frame in sorted({frame for _, frame in TRUTH})]


def render(options, scene, script, arguments):
    """True if Blender made the images."""
    job = " ".join([scene, script, *arguments])
    arguments = [options.out / scene, *arguments]
    if script == "render.py":
        arguments = [scene, *arguments, "--size", SIZE, "--samples", SAMPLES, "--min-samples", MIN_SAMPLES,
                      "--sharp-samples", SHARP_SAMPLES, "--threads", options.threads]
    command = [options.blender, "-b", "--factory-startup", "--python-exit-code", "1", "-P",
               pathlib.Path(__file__).with_name(script), "--", *arguments]
    start, before = time.monotonic(), os.times()
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True,
                          env=request.blender_environment())
    after = os.times()
    print(f"{time.strftime('%F %T')} {job}: "
          f"{'rendered' if done.returncode == 0 else 'FAILED'}, {time.monotonic() - start:.0f} s, "
          f"processor {after.children_user - before.children_user:.0f} s", flush=True)
    if done.returncode:
        print("\n".join((done.stdout + done.stderr).splitlines()[-20:]), flush=True)
    return done.returncode == 0


def mean_of_halves(folder):
    """KIND.####.exr: the mean of two finished halves."""
    for kind, frame in TRUTH:
        out = folder / f"{kind}.{frame:04d}.exr"
        halves = [folder / f"{kind}_{half}.{frame:04d}.exr" for half in HALVES]
        if out.exists() or not all(half.exists() for half in halves):
            continue
        made = out.with_suffix(".tmp.exr")
        subprocess.run(["oiiotool", *map(str, halves), "--add", "--mulc", "0.5", "-d", "half",
                        "--compression", "zip", "-o", str(made)], check=True)
        made.replace(out)


def pixels_of(content):
    """The compressed pixels of an EXR of one part: without header and offsets, which hold times of
    rendering. Other content as it is."""
    if content[:4] != b"v/1\x01":
        return content
    place, attributes = 8, {}
    while content[place]:
        name, kind = content[place:place + 512].split(b"\0")[:2]
        place += len(name) + len(kind) + 2
        size, = struct.unpack_from("<i", content, place)
        attributes[name] = content[place + 4:place + 4 + size]
        place += 4 + size
    _, top, _, bottom = struct.unpack("<4i", attributes[b"dataWindow"])
    lines = 16 if attributes[b"compression"] == b"\3" else 1  # a chunk of ZIP; of ZIPS or none
    return content[place + 1 + 8 * -(-(bottom - top + 1) // lines):]


def digest(path):
    return hashlib.sha256(pixels_of(path.read_bytes())).hexdigest()


def manifest(out):
    """{scene: {file: SHA-256 of its pixels}} of the files that are there."""
    found = {}
    for scene in SCENES:
        found[scene] = {name: digest(out / scene / name) for name in sorted(dataset_files())
                        if (out / scene / name).exists()}
    return {scene: files for scene, files in found.items() if files}


def manifest_text(found):
    return json.dumps(found, indent=1, sort_keys=True) + "\n"


def check(out):
    """Prints each file that is not as in the manifest; their number."""
    wanted = json.loads(MANIFEST.read_text(encoding="utf8"))
    bad = 0
    for scene, files in wanted.items():
        for name, sum_ in files.items():
            path = out / scene / name
            state = "missing" if not path.exists() else "other" if digest(path) != sum_ else ""
            if state:
                print(f"{path}: {state}; render it again with {sys.argv[0]} {out}")
            bad += bool(state)
    return bad


def render_missing(options):
    """The number of failures, and whether the limit left something to do."""
    runs = failures = 0
    for files, script, arguments in jobs():
        for scene in options.scenes or SCENES:
            folder = options.out / scene
            if all((folder / name).exists() for name in files):
                continue
            if options.limit and runs >= options.limit:
                return failures, True
            rendered = render(options, scene, script, arguments)
            runs += rendered
            failures += not rendered
            if folder.exists():
                mean_of_halves(folder)
    return failures, False


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--blender", default="blender")
    parser.add_argument("--threads", type=int, default=0, help="0: all cores")
    parser.add_argument("--limit", type=int, default=0, help="runs of Blender; 0: all")
    parser.add_argument("--check", action="store_true", help="compare with the manifest only")
    options = parser.parse_args()
    if options.check:
        sys.exit(1 if check(options.out) else 0)
    failures, more = render_missing(options)
    (options.out / "manifest.json").write_text(manifest_text(manifest(options.out)), "utf8")
    sys.exit(1 if failures else 3 if more else 0)


if __name__ == "__main__":
    main()
