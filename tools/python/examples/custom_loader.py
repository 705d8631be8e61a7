"""Filters frames from a loader of one's own, here .npz files with color, depth and motion, each with
the frames before and after.

    custom_loader.py 'frames/*.npz' OUT [--chain balanced]

A file holds color (height x width x 3 or 4, linear), depth (height x width, distance along the view
axis), motion (height x width x 2, pixels to the next frame, y down), and optionally camera values as
numbers (f_stop, focus_distance, ...).
"""
import argparse
import glob
import pathlib

import numpy

import postchain


def load(path, number):
    arrays = dict(numpy.load(path))
    planes = {name: arrays.pop(name).astype(numpy.float32) for name in ("color", "depth", "motion")}
    camera = {key: value.item() for key, value in arrays.items()}
    return postchain.Frame(**planes, camera=camera, frame=number)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pattern")
    parser.add_argument("output", type=pathlib.Path)
    parser.add_argument("--chain", default="balanced")
    options = parser.parse_args()

    paths = sorted(glob.glob(options.pattern))
    chain = postchain.Chain(options.chain)
    options.output.mkdir(exist_ok=True)
    frames = {}  # by number; each is loaded and converted once
    for i, path in enumerate(paths):
        for number in range(max(i - 1, 0), min(i + 2, len(paths))):
            if number not in frames:
                frames[number] = load(paths[number], number)
        frames.pop(i - 2, None)
        color = chain.run(frames[i], before=frames.get(i - 1), after=frames.get(i + 1))
        out = options.output / pathlib.Path(path).with_suffix(".npy").name
        numpy.save(out, color)
        print(out)


if __name__ == "__main__":
    main()
