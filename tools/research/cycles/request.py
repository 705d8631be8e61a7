"""The request of a render: the options after "--", the kinds of pictures, names of files.

Imports nothing of Blender, so that tests run it in a plain interpreter.
"""
import argparse
import os
import pathlib

# name: (shutter open, lens open, depth and vectors). In the order in which they are rendered.
KINDS = {
    "gbuf": (False, False, True),   # one sample at the pixel's center
    "sharp": (False, False, True),
    "both": (True, True, False),
    "mb": (True, False, False),
    "dof": (False, True, False),
}
BEHIND = "behind"  # what the surfaces of sharp hide; last, because it reads sharp; only if asked for
HALVES = {"a": 1, "b": 2}
SCENES = sorted(path.stem for path in pathlib.Path(__file__).with_name("scenes").glob("*.py"))
FPS = 24
SHUTTER_FRAMES = 0.5


def parse_frames(text):
    """Frame numbers of "1-12" or "3,5-7": sorted, each once."""
    frames = set()
    for part in text.split(","):
        first, dash, last = part.partition("-")
        first = int(first)
        last = int(last) if dash else first
        if last < first:
            raise argparse.ArgumentTypeError(f"{part}: the last frame comes before the first")
        frames.update(range(first, last + 1))
    return sorted(frames)


def parse_kinds(text):
    """Names of KINDS, and BEHIND, from "sharp,both", in the order of KINDS."""
    wanted = text.split(",")
    known = [*KINDS, BEHIND]
    for name in wanted:
        if name not in known:
            raise argparse.ArgumentTypeError(f"{name}: a kind is one of {', '.join(known)}")
    return [name for name in known if name in wanted]


def parse_size(text):
    """Width and height of "640x360"."""
    width, _, height = text.partition("x")
    size = int(width), int(height)
    if min(size) < 1:
        raise argparse.ArgumentTypeError(f"{text}: not a size")
    return size


def parse_options(arguments):
    """The options of render.py: those that Blender leaves to it, after "--"."""
    parser = argparse.ArgumentParser(prog="blender -b -P render.py --")

    parser.add_argument("scene", choices=SCENES)
    parser.add_argument("out", metavar="OUT", help="folder, made when it is not there")
    parser.add_argument("--frames", type=parse_frames, default=parse_frames("1-12"),
                        help="1-12 by default")
    parser.add_argument("--kinds", type=parse_kinds, default=list(KINDS),
                        help="any of " + ",".join([*KINDS, BEHIND]) + "; all but behind by default")
    parser.add_argument("--samples", type=int, default=256, help="of ground truth, at most")
    parser.add_argument("--min-samples", type=int, default=64, help="of ground truth, at least")
    parser.add_argument("--half", choices=list(HALVES), help="ground truth of other seeds, as "
                        "KIND_HALF.####.exr; two halves tell its noise")
    parser.add_argument("--sharp-samples", type=int, default=96, help="of sharp, all of them")
    parser.add_argument("--size", type=parse_size, default=(640, 360),
                        help="640x360 by default")
    parser.add_argument("--threads", type=int, default=0, help="0: all cores")
    parser.add_argument("--transparent", action="store_true",
                        help="alpha, premultiplied, instead of the sky (dancers: and the stage)")
    parser.add_argument("--blend", metavar="FILE", help="save the scene as OUT/FILE, render nothing")
    return parser.parse_args(arguments)


def like(kind):
    """The one of KINDS whose settings and seed a kind has."""
    return "sharp" if kind == BEHIND else kind


def file_name(kind, frame, half=None):
    """Name of a finished picture."""
    return f"{kind}{'_' + half if half else ''}.{frame:04d}.exr"


def images_to_render(options):
    """(kind, frame) of every picture that is not finished yet, kind by kind."""
    return [(kind, frame) for kind in options.kinds for frame in options.frames
            if not os.path.exists(os.path.join(options.out, file_name(kind, frame, options.half)))]


def blender_environment():
    """Blender's Python takes its library from beside the first python3 in PATH; NumPy is that of
    the system."""
    return {**os.environ, "PATH": "/usr/bin:" + os.environ.get("PATH", "")}


def seed_of(kind, frame, half=None):
    """Seed of Cycles: another one for each picture, so that noise of two does not correlate."""
    return HALVES.get(half, 0) * 1000000 + frame * len(KINDS) + list(KINDS).index(like(kind))
