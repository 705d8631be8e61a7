"""Filters a sequence frame by frame, in memory, and writes color, AOVs and the time of each pass.

    frame_by_frame.py IN OUT [--chain balanced] [--camera camera.json] [--aovs all]
"""
import argparse

import postchain


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("input", help="pattern of the frames: shot.####.exr")
    parser.add_argument("output", help="pattern of the results: out.####.exr")
    parser.add_argument("--chain", default="balanced")
    parser.add_argument("--camera")
    parser.add_argument("--aovs", default="none")
    options = parser.parse_args()

    chain = postchain.Chain(options.chain)
    for shot in postchain.frames(options.input, options.camera, aovs=options.aovs):
        result = chain.filter(shot.frame, before=shot.before, after=shot.after)
        path = options.output.replace("####", f"{shot.frame.number:04}")
        postchain.write(path, result, shot.frame, on_existing="overwrite", mkdir=True)
        times = ", ".join(f"{name} {ms:.1f} ms" for name, ms in result.times_ms.items())
        print(f"{path}: {times}")


if __name__ == "__main__":
    main()
