"""Filters one frame with several values of a parameter, and plots error against time.

    sweep.py 'scene/sharp.####.exr' 'scene/both.####.exr' --camera scene/camera.json --frame 2 \\
             --chain balanced --key joint_blur.samples --values 8 16 32 64 -o sweep.png
"""
import argparse
import time

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt

import postchain


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("frames", help="pattern of the frames to filter")
    parser.add_argument("truth", help="pattern of the ground truth")
    parser.add_argument("--frame", type=int, required=True)
    parser.add_argument("--camera")
    parser.add_argument("--chain", default="balanced")
    parser.add_argument("--key", default="joint_blur.samples")
    parser.add_argument("--values", nargs="+", default=["8", "16", "32", "64"])
    parser.add_argument("--metric", default="hdr_flip")
    parser.add_argument("-o", "--output", default="sweep.png")
    options = parser.parse_args()

    frame = postchain.read(options.frames, frame=options.frame, camera=options.camera)
    truth = postchain.read(options.truth, frame=options.frame).planes()["color"]
    milliseconds, errors = [], []
    for value in options.values:
        chain = postchain.Chain(options.chain, set={options.key: value})
        chain.run(frame)  # compiles programs, converts planes
        start = time.perf_counter()
        color = chain.run(frame)
        milliseconds.append(1e3 * (time.perf_counter() - start))
        errors.append(postchain.diff(truth, color, metrics=[options.metric])[options.metric])
        print(f"{options.key} {value}: {milliseconds[-1]:.1f} ms, "
              f"{options.metric} {errors[-1]:.4f}")

    plt.plot(milliseconds, errors, "o-")
    for value, x, y in zip(options.values, milliseconds, errors):
        plt.annotate(value, (x, y), textcoords="offset points", xytext=(6, 6))
    plt.xlabel("ms a frame")
    plt.ylabel(options.metric)
    plt.title(f"{options.chain}, {options.key}")
    plt.savefig(options.output, dpi=120)
    print(options.output)


if __name__ == "__main__":
    main()
