#!/usr/bin/python3
"""The best constants of scatter_gather.py on tuning scenes, by PSNR against the lens alone.

    tests/bench/tune_baseline.py SCENE... [--frame 10]

One constant is changed at a time, to the best of its choices, until none helps.
"""
import argparse
import dataclasses
import pathlib

import numpy as np

import frame as frames
import scatter_gather

CHOICES = {
    "tile": [4, 6, 8], "depth_scale": [0.03, 0.06, 0.1, 0.3], "karis": [0, 0.5, 1, 2],
    "prefilter": [0, 0.15, 0.22, 0.3, 0.5], "alpha_gain": [0.5, 0.6, 0.7, 0.8, 0.9, 1, 2],
    "sharp_px": [0, 0.25, 0.5], "blurred_px": [1, 1.5, 2, 3], "median": [0, 1],
    "outer_ring": [0.8, 6 / 7, 0.89, 0.92, 1],
}


def mean_psnr(scenes, number, constants):
    found = []
    for scene in scenes:
        pixels, names = scatter_gather.filtered(scene / f"sharp.{number:04d}.exr", scene / "camera.json",
                                                number, constants)
        image = frames.displayed(pixels[..., frames.columns(names, "Combined.RGB")])
        truth = frames.displayed(frames.read(scene / f"dof.{number:04d}.exr")[0])
        found.append(-10 * np.log10(np.mean((image - truth)**2)))
    return float(np.mean(found))


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", type=pathlib.Path, nargs="+")
    parser.add_argument("--frame", type=int, default=10)
    options = parser.parse_args()
    best = scatter_gather.Constants()
    top, before = mean_psnr(options.scenes, options.frame, best), None
    while top != before:
        before = top
        for name, values in CHOICES.items():
            for value in values:
                trial = dataclasses.replace(best, **{name: value})
                if trial == best:
                    continue
                psnr = mean_psnr(options.scenes, options.frame, trial)
                if psnr > top:
                    top, best = psnr, trial
        print(f"{top:.3f} dB: {best}", flush=True)


if __name__ == "__main__":
    main()
