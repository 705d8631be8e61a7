#!/usr/bin/env python3
"""The ordering study: motion blur first, depth of field first, or both in one (docs/ordering.md).

    ordering.py scenes POSTCHAIN FOLDER           render the generated scenes with ground truth
    ordering.py measure POSTCHAIN FOLDER ...      errors of every chain on every scene in FOLDERs
    ordering.py time POSTCHAIN FOLDER ...         times, as ratios
    ordering.py claims POSTCHAIN FOLDER ...       edges, sharpness, flicker and grid, by `ab`
    ordering.py sizes POSTCHAIN FOLDER ...        of the blurs (needs oiiotool)
    ordering.py strips POSTCHAIN FOLDER ...       docs/images/ordering-*.jpg (needs oiiotool)
    ordering.py tables                            docs/results/ordering.md from the results
    ordering.py page                              docs/results/ordering.html from the results

A FOLDER holds scenes: folders with sharp.####.exr (and gbuf), both.####.exr (ground truth of shutter
and lens) and camera.json. What has been measured is in docs/results/ordering.json (--results) and is
not measured again while scene, input, frame, the chain's text and the version of postchain are the
same, so work that was interrupted goes on. Scenes, chains and questions: ordering_study.py.
"""
import argparse
import json
import pathlib
import sys
import tempfile

import measure
import ordering_page
import ordering_results
import ordering_tables
from ordering_study import (ALL, CHAINS, CLAIMS, FEW, FEW_FRAMES, GBUF, GENERATED, SIZE, STILL,
                            STRIPS, TIMED, TRUTH_SAMPLES, family)

ROOT = pathlib.Path(__file__).resolve().parents[2]
SKIPPED = ["wheels_720p", "dancers_alpha"]  # wheels larger; dancers with alpha


def scenes(options):
    """Renders what is not there; camera.json is written last."""
    for name, frames, arguments in GENERATED:
        folder = options.folders[0] / name
        if not (folder / "camera.json").exists():
            measure.call(options.postchain, "scene", *arguments.split(), "-o", folder, "--size",
                         SIZE, "--frames", frames, "--truth-samples", TRUTH_SAMPLES,
                         "--on-existing", "overwrite", "-q")
            print(name, flush=True)


def folders_of_scenes(options):
    found = [scene for folder in options.folders for scene in sorted(folder.iterdir())
             if (scene / "camera.json").exists() and measure.frames_of(scene, "both")
             and scene.name not in SKIPPED]
    return [scene for scene in found if not options.scene or scene.name in options.scene]


def frames_for(scene, chain):
    """Frames of the scene on which the chain is measured."""
    source = "gbuf" if chain.where == GBUF else "sharp"
    both = sorted(set(measure.frames_of(scene, "both")) & set(measure.frames_of(scene, source)))
    if chain.where == ALL:
        return both
    is_first = scene.name == family(scene.name) and scene.name != STILL
    return both[:FEW_FRAMES] if is_first else []


def measured(postchain, chain, scene, frames, missing, folder):
    """{frame: errors} of the frames in missing; the temporal error needs the frame before, too."""
    source = "gbuf" if chain.where == GBUF else "sharp"
    needed = [frame for frame in frames if frame in missing or frame + 1 in missing]
    measure.run_chain(postchain, chain.passes, scene, needed, folder, source)
    temporal = measure.temporal_errors(postchain, scene / "both.####.exr", folder / "out.####.exr",
                                       needed)
    values = {}
    for frame in missing:
        found = measure.errors(postchain, scene / f"both.{frame:04d}.exr",
                               folder / f"out.{frame:04d}.exr")
        values[frame] = {"psnr": found["psnr"], "hdr_flip": found["hdr_flip"],
                         "ssim": found["ssim"],
                         "tde": temporal[frame] if frame - 1 in frames else None}
    return values


def measure_all(options, results, folder):
    version = measure.call(options.postchain, "--version").strip()
    shots = folders_of_scenes(options)
    for where in options.where or [ALL, GBUF, FEW]:
        for scene in shots:
            for chain in (one for one in CHAINS if one.where == where):
                source = "gbuf" if where == GBUF else "sharp"
                frames = frames_for(scene, chain)[:options.most]
                row = results.row(scene.name, source, chain.name, chain.passes, version)
                missing = [frame for frame in frames if str(frame) not in row["frames"]]
                if missing:
                    found = measured(options.postchain, chain, scene, frames, missing, folder)
                    results.add(row, found)
                    print(scene.name, source, chain.name, len(missing), flush=True)


def time_all(options, results, folder):
    """Processor seconds of every chain in turn, less those of no chain, as ratios to the first's:
    on a shared machine they vary less than the wall clock."""
    for scene in folders_of_scenes(options):
        frames = measure.frames_of(scene, "both")[:3]
        texts = {"": "", **{chain.name: chain.passes for chain in CHAINS if chain.name in TIMED}}
        least = {}
        for _ in range(options.repeat):
            for name, passes in texts.items():
                spent = measure.processor_seconds(options.postchain, passes, scene, frames, folder)
                least[name] = min(spent, least.get(name, spent))
        first = least[TIMED[0]] - least[""]
        results.add_times(scene.name, frames, {name: (least[name] - least[""]) / first
                                               for name in TIMED})
        print(scene.name, least, flush=True)


def claims_all(options, results, folder):
    """Metrics that only `ab` has, of pairs of orders on a few frames of a scene of each family."""
    texts = {chain.name: chain.passes for chain in CHAINS}
    for scene in folders_of_scenes(options):
        frames = measure.frames_of(scene, "both")[:FEW_FRAMES]
        for pair in CLAIMS:
            if scene.name != family(scene.name) or results.has_claims(scene.name, pair):
                continue
            paths = []
            for side, name in zip("ab", pair):
                (folder / side).mkdir(exist_ok=True)
                paths.append(measure.chain_path(texts[name], folder / side))
            report = json.loads(measure.call(
                options.postchain, "ab", *paths, "-i", scene / "sharp.####.exr", "--camera",
                scene / "camera.json", "-r", scene / "both.####.exr", "--frames",
                measure.frame_list(frames), "-o", folder / "report", "--on-existing", "overwrite",
                "--repeats", 1, "--page-frames", 1, "--json"))
            results.add_claims(scene.name, pair, report)
            print(scene.name, *pair, flush=True)


def sizes_all(options, results, folder):
    """How long the streaks and how large the circles of confusion are, mean over a frame."""
    for scene in folders_of_scenes(options):
        frames = measure.frames_of(scene, "both")
        frame = frames[len(frames) // 2]
        results.add_sizes(scene.name, frame, *measure.blur_sizes(scene, frame))


def strips(options, folder):
    """The crops where each order fails: ground truth and the chains of STRIPS at full size."""
    texts = {chain.name: chain.passes for chain in CHAINS}
    shots = {scene.name: scene for scene in folders_of_scenes(options)}
    for name, (scene, frame, crop, enlarged, chains) in STRIPS.items():
        if scene not in shots:
            continue
        shown = [shots[scene] / f"both.{frame:04d}.exr"]
        for k, chain in enumerate(chains):
            measure.run_chain(options.postchain, texts[chain], shots[scene], [frame], folder)
            shown.append((folder / f"out.{frame:04d}.exr").rename(folder / f"shown{k}.exr"))
        measure.strip(shown, crop, ROOT / f"docs/images/ordering-{name}.jpg", enlarged)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["scenes", "measure", "time", "claims", "sizes", "strips",
                                         "tables", "page"])
    parser.add_argument("postchain", nargs="?", type=pathlib.Path)
    parser.add_argument("folders", nargs="*", type=pathlib.Path)
    parser.add_argument("--results", type=pathlib.Path, default=ROOT / "docs/results/ordering.json")
    parser.add_argument("--scene", action="append", help="only this scene; may be repeated")
    parser.add_argument("--where", action="append", choices=[ALL, GBUF, FEW],
                        help="measure only the chains that are for these frames")
    parser.add_argument("--most", type=int, help="measure at most so many frames of a scene")
    parser.add_argument("--repeat", type=int, default=3, help="of time")
    options = parser.parse_args()
    results = ordering_results.Results(options.results)
    if options.what == "tables":
        return ordering_tables.write(results, ROOT / "docs/results/ordering.md")
    if options.what == "page":
        return ordering_page.write(results, ROOT / "docs/results/ordering.html",
                                   ROOT / "docs/images")
    if not options.postchain or not options.folders:
        parser.error(f"{options.what} needs POSTCHAIN and a FOLDER")
    if options.what == "scenes":
        return scenes(options)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        if options.what == "strips":
            return strips(options, folder)
        {"measure": measure_all, "time": time_all, "claims": claims_all,
         "sizes": sizes_all}[options.what](options, results, folder)


if __name__ == "__main__":
    sys.exit(main())
