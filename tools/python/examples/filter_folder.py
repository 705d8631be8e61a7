"""Filters every sequence of a folder into another one, and shows progress.

    filter_folder.py IN OUT [--chain balanced] [--camera camera.json]
"""
import argparse
import pathlib
import sys

import postchain


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("output", type=pathlib.Path)
    parser.add_argument("--chain", default="balanced")
    parser.add_argument("--camera")
    options = parser.parse_args()

    def show(frame):
        print(f"{frame['done']}/{frame['total']} {frame['output']}: {frame['outcome']}", flush=True)

    try:
        chain = postchain.Chain(options.chain)
        for sequence in postchain.inspect(options.folder)["sequences"]:
            pattern = pathlib.Path(sequence["input"])
            if pattern.suffix != ".exr":
                continue
            summary = postchain.run_sequence(
                chain, pattern, options.output / pattern.name, camera=options.camera, mkdir=True,
                on_existing="skip", on_error="continue", progress=show)
            print(f"{pattern.name}: {summary['written']} written, {summary['skipped']} skipped, "
                  f"{summary['failed']} failed in {summary['elapsed_s']:.1f} s")
            for warning in summary["warnings"]:
                print(f"warning: {warning}", file=sys.stderr)
    except postchain.Error as error:
        sys.exit(f"error: {error}")


if __name__ == "__main__":
    main()
