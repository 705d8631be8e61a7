#!/usr/bin/python3
"""Error of few samples before and after a temporal antialiasing that follows, on a still scene.

    tests/bench/taa.py POSTCHAIN SET[:FRAME] CHAIN... [--frames 16] [--share 0.1]

SET and CHAIN are those of quality.py; each pass of CHAIN that has noise is animated. One frame is filtered
with the noise of --frames frames in turn, and the results are averaged exponentially, each new one with
--share, as the history of a still pixel: the first one counts whole. Printed for each chain: PSNR in dB of
one frame (the mean over the frames), and of the average at the end.
"""
import argparse
import pathlib
import re
import tempfile

import frame as frames
import quality


def with_seed(chain, seed):
    """The chain with this seed in every joint_blur, motion_blur and depth_of_field that states values."""
    return re.sub(r"(joint_blur|motion_blur|depth_of_field): \{", rf"\1: {{seed: {seed}, ", chain)


def averaged(options, chain, scene, number, folder):
    """[PSNR of each frame], PSNR of their exponential mean."""
    truth = scene / f"both.{number:04d}.exr"
    single, mean, names = [], None, None
    for i in range(options.frames):
        image, _ = quality.filtered(options, with_seed(chain, i + 1), scene, number, folder)
        single.append(quality.errors(options, truth, image)[0])
        pixels, spec = frames.read(image)
        names = spec.channelnames
        mean = pixels if mean is None else mean + options.share * (pixels - mean)
    path = folder / "mean.exr"
    frames.write(path, mean, names)
    return single, quality.errors(options, truth, path)[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("postchain", type=pathlib.Path)
    parser.add_argument("set")
    parser.add_argument("chains", nargs="+", metavar="CHAIN")
    parser.add_argument("--frames", type=int, default=16)
    parser.add_argument("--share", type=float, default=0.1)
    options = parser.parse_args()
    options.repeat = 1
    data, _, number = options.set.partition(":")
    scenes = [one for one in sorted(pathlib.Path(data).iterdir()) if (one / "both.0010.exr").exists()]
    print("| chain | " + " | ".join(one.name for one in scenes) + " | mean |\n" + "|---" * (len(scenes) + 2) + "|")
    with tempfile.TemporaryDirectory() as folder:
        for chain in options.chains:
            found = [averaged(options, chain, scene, int(number or 10), pathlib.Path(folder)) for scene in scenes]
            cells = [(sum(single) / len(single), mean) for single, mean in found]
            cells.append(tuple(sum(one[k] for one in cells) / len(cells) for k in (0, 1)))
            print(f"| `{chain}` | " + " | ".join(f"{one:.2f}, {mean:.2f}" for one, mean in cells) + " |", flush=True)


if __name__ == "__main__":
    main()
