#!/usr/bin/python3
"""Error of chains against path-traced ground truth, and time, as the tables of
docs/quality.md and docs/studies/tables.md.

    tools/research/quality.py POSTCHAIN SET[:FRAME] [SET[:FRAME]...] [--table motion|lens|both]
                           [--row TEXT] [--repeat 3] [--exact EXACT_SHOTS] [--json FILE] [--write FILE]
                           [--pictures FOLDER]

Each table is printed for each set of scenes. SET holds a folder for each scene with sharp.####.exr, mb,
dof and both (ground truth), camera.json and, for the rows that need them, peer_*.####.exr and
behind.####.exr. FRAME is 10 if none is given. SET may also
be a file of --json, whose scenes and rows are merged with the others. A cell is PSNR (dB, after x/(1+x) and
gamma 2.2) / HDR-FLIP / SSIM; time is the minimum over the repeats of the passes' total time, relative to the
table's first chain.

If a scene has its ground truth in two halves too (both_a.####.exr, both_b), PSNR is that without the
noise of the ground truth: a quarter of the halves' mean squared difference is taken off. The row "noise"
has the PSNR of that noise alone, and HDR-FLIP and SSIM between the halves.

A second table has the PSNR near the rims of bokeh only (docs/metrics.md#rims-of-bokeh), and their pixels.

--exact runs that program (tests/stability/exact_shots.cpp) and prints error and temporal error on shots with
exact ground truth after the other tables (docs/stability.md#in-time).

--json writes every figure, with chains and the commit. --write puts the tables, without times, between
the two marks of a Markdown file (quality_tables.py). --pictures makes strips of full-size crops instead
(needs oiiotool).
"""
import argparse
import contextlib
import io
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import quality_tables
import rims

BASELINE = "scatter_gather"  # a stage of a chain: scatter_gather.py
BEHIND = " --behind"  # after a chain: with the layer behind
MOTION = [
    ("`guertin`, 25 samples", "motion_blur: {mode: guertin}"),
    ("`guertin`, 401 samples", "motion_blur: {mode: guertin, samples: 401}"),
    ("Blender's Vector Blur, its factor tuned on the ground truth", "peer_vectorblur_best"),
    ("9 times, 3 starts, frame alone",
     "motion_blur: {mode: inverse_warp, samples: 9, starts: 3, neighbors: none}"),
    ("defaults, frame alone", "motion_blur: {mode: inverse_warp, neighbors: none}"),
    ("25 times everywhere, frame alone",
     "motion_blur: {mode: inverse_warp, path_px_per_time: 0.5, neighbors: none}"),
    ("defaults, the frame before", "motion_blur: {mode: inverse_warp, neighbors: before}"),
    ("defaults", "motion_blur: {mode: inverse_warp}"),
    ("25 times everywhere", "motion_blur: {mode: inverse_warp, path_px_per_time: 0.5}"),
]
LENS = [
    ("`gilham`, `downsample: 4`", "depth_of_field: {method: gilham, downsample: 4}"),
    ("`gilham`, `downsample: 1`", "depth_of_field: {method: gilham, downsample: 1}"),
    ("scatter as gather at half resolution, after Jimenez 2014", BASELINE),
    ("Blender's Defocus", "peer_defocus"),
    ("16 samples, frame alone", "depth_of_field: {samples: 16, neighbors: none}"),
    ("24 samples, frame alone", "depth_of_field: {samples: 24, neighbors: none}"),
    ("24 samples, frame alone, not denoised",
     "depth_of_field: {samples: 24, neighbors: none, denoise: false}"),
    ("128 samples, frame alone", "depth_of_field: {samples: 128, neighbors: none}"),
    ("32 samples, the default", "depth_of_field: {samples: 32}"),
    ("128 samples", "depth_of_field: {samples: 128}"),
]
BOTH = [
    ("`paper`", "paper"),
    ("`dof_first`", "dof_first"),
    ("`guertin`, 401 samples, then `gilham`",
     "motion_blur: {mode: guertin, samples: 401} ; depth_of_field: {method: gilham}"),
    ("`guertin`, 401 samples, then scatter as gather",
     f"motion_blur: {{mode: guertin, samples: 401}} ; {BASELINE}"),
    ("scatter as gather, then `guertin`, 401 samples",
     f"{BASELINE} ; motion_blur: {{mode: guertin, samples: 401}}"),
    ("Blender's Defocus, then Vector Blur, tuned on the ground truth", "peer_both_best"),
    ("motion blur, then depth of field", "motion_blur: {} ; depth_of_field: {}"),
    ("depth of field, then motion blur", "depth_of_field: {} ; motion_blur: {}"),
    ("depth of field, then motion blur, then FXAA",
     "depth_of_field: {} ; motion_blur: {} ; fxaa: {mode: directional}"),
    ("`fast`: `joint_blur`, 15 samples, 5 starts, frame alone, then FXAA", "fast"),
    ("`joint_blur`, 32 samples, frame alone", "joint_blur: {samples: 32, neighbors: none}"),
    ("`joint_blur`, 128 samples, frame alone", "joint_blur: {samples: 128, neighbors: none}"),
    ("`joint_blur`, 32 samples", "joint_blur: {samples: 32}"),
    ("`balanced`: `joint_blur`, 28 samples, 6 starts, then FXAA", "balanced"),
    ("`joint_blur`, 128 samples", "joint_blur: {samples: 128}"),
    ("`best`: `joint_blur`, 128 samples, 8 starts", "best"),
    ("`balanced` with the layer behind", f"balanced{BEHIND}"),
    ("`best` with the layer behind", f"best{BEHIND}"),
]
TABLES = {"motion": MOTION, "lens": LENS, "both": BOTH}


def call(*command):
    """Standard output of the command; ends the program if it fails."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(str(word) for word in command)}\n{done.stderr}")
    return done.stdout


def chain_path(chain, folder):
    """A shipped chain's name, or a file in folder of the passes joined by " ; "."""
    if ":" not in chain:
        return chain
    path = folder / "chain.yaml"
    passes = "".join(f"\n  - {one}" for one in chain.split(" ; "))
    path.write_text(f"postchain: 1\npasses:{passes}\n")
    return path


def stages(chain):
    """Runs of passes, and the baseline between them."""
    found = []
    for one in chain.split(" ; "):
        if found and BASELINE not in (one, found[-1]):
            found[-1] += " ; " + one
        else:
            found.append(one)
    return found


def run_chain(options, chain, scene, frame, folder):
    """Filters the frame into folder; ms of all passes, 0 with the baseline."""
    source, milliseconds = scene / "sharp.####.exr", 0
    behind = ["--behind", scene / "behind.####.exr"] if chain.endswith(BEHIND) else []
    for stage in stages(chain.removesuffix(BEHIND)):
        out = folder / ("out2.####.exr" if source == folder / "out.####.exr" else "out.####.exr")
        if stage == BASELINE:
            number = f"{frame:04d}"
            call(sys.executable, "-B", pathlib.Path(__file__).with_name("scatter_gather.py"),
                 str(source).replace("####", number), "--camera", scene / "camera.json", "--frame", frame,
                 "-o", str(out).replace("####", number))
        else:
            call(options.postchain, "run", chain_path(stage, folder), "-i", source,
                 "--camera", scene / "camera.json", "--frames", frame, "-o", out, *behind,
                 "--on-existing", "overwrite", "-q")
            sidecar = json.loads((out.parent / f"{out.name.replace('####', f'{frame:04d}')}.json").read_text())
            milliseconds += sum(one["ms"] for one in sidecar["times_ms"]["passes"])
        source = out
    if source.name != "out.####.exr":
        (folder / f"out2.{frame:04d}.exr").replace(folder / f"out.{frame:04d}.exr")
    return 0 if BASELINE in chain else milliseconds


def strip(pictures, crop, path):
    """Crops (WxH+X+Y) side by side, after x/(1+x) and gamma 2.2, as JPEG."""
    command = ["oiiotool"]
    for picture in pictures:
        command += [picture, "--ch", "0,1,2", "--chnames", "R,G,B", "--cut", crop,
                    "--clamp:min=0,0,0", "--dup", "--addc", "1", "--div", "--powc", "0.454545"]
    call(*command, "--mosaic:pad=4", f"{len(pictures)}x1", "-d", "uint8", "--nosoftwareattrib",
         "--eraseattrib", ".*", "--compression", "jpeg:90", "-o", path)


def filtered(options, chain, scene, frame, folder):
    """Path of the filtered frame, and the least time of its passes in ms."""
    least = min(run_chain(options, chain, scene, frame, folder) for _ in range(options.repeat))
    return folder / f"out.{frame:04d}.exr", least


def errors(options, reference, image):
    """[PSNR, HDR-FLIP, SSIM]; equal images have a PSNR of 200 dB."""
    found = json.loads(call(options.postchain, "diff", reference, image, "--metric", "psnr",
                            "--metric", "hdr_flip", "--metric", "ssim", "--json"))
    return [200 if found["psnr"] is None else found["psnr"], found["hdr_flip"], found["ssim"]]


def noise(options, truth, scene, frame):
    """[PSNR, ...] of the noise in the mean of the halves; None without halves."""
    halves = [scene / f"{truth}_{half}.{frame:04d}.exr" for half in "ab"]
    if not all(half.exists() for half in halves):
        return None
    found = errors(options, *halves)
    return [found[0] + 20 * math.log10(2), *found[1:]]


def without_noise(psnr, noise_psnr):
    """PSNR of the error alone. It does not correlate with the noise, so the squares add."""
    return -10 * math.log10(max(10**(-psnr / 10) - 10**(-noise_psnr / 10), 1e-20))


class Rims:
    """Errors near the bokeh rims of one scene."""

    def __init__(self, scene, truth, frame):
        self.truth = scene / f"{truth}.{frame:04d}.exr"
        self.mask = rims.of_files(scene / f"sharp.{frame:04d}.exr", scene / "camera.json", frame,
                                  self.truth, truth == "both")
        self.pixels = int(self.mask.sum())
        halves = [scene / f"{truth}_{half}.{frame:04d}.exr" for half in "ab"]
        self.noise = 0.0
        if self.pixels and all(half.exists() for half in halves):
            self.noise = rims.mean_squared_error(*halves, self.mask) / 4

    def psnr(self, image):
        """Without the noise of the ground truth; None without rims."""
        if not self.pixels:
            return None
        error = rims.mean_squared_error(self.truth, image, self.mask) - self.noise
        return -10 * math.log10(max(error, 1e-20))


def table(options, data, frame, name, folder):
    """Measures a table's rows on the scenes of a set; the figures."""
    truth, rows = quality_tables.TRUTH[name], TABLES[name]
    scenes, without = [], []
    for scene in sorted(data.iterdir()):
        if (scene / "camera.json").exists() and scene.name not in options.skip \
                and (not options.scene or scene.name in options.scene):
            exists = (scene / f"{truth}.{frame:04d}.exr").exists()
            (scenes if exists else without).append(scene)
    if without or not scenes:
        print(f"{data}: no {truth}.{frame:04d}.exr of "
              f"{', '.join(scene.name for scene in without) or 'any scene'}", file=sys.stderr)
    figures = []
    for scene in scenes:
        floor = noise(options, truth, scene, frame)
        near_rims = None if name == "motion" else Rims(scene, truth, frame)
        common = {"set": data.name, "table": name, "scene": scene.name, "frame": frame}
        if floor:
            figures.append({**common, "row": quality_tables.NOISE, "chain": None, "psnr": floor[0],
                            "hdr_flip": floor[1], "ssim": floor[2], "ms": 0})
        for label, chain in rows:
            if options.row and not any(text in label for text in options.row):
                continue
            out, least = scene / f"{chain}.{frame:04d}.exr", 0
            needed = scene / f"behind.{frame:04d}.exr" if chain.endswith(BEHIND) else \
                out if chain.startswith("peer_") else None
            if needed and not needed.exists():
                print(f"{needed} is missing", file=sys.stderr)
                continue
            if needed != out:
                out, least = filtered(options, chain, scene, frame, folder)
            psnr, hdr_flip, ssim = errors(options, scene / f"{truth}.{frame:04d}.exr", out)
            figure = {**common, "row": label, "chain": chain, "psnr": psnr, "hdr_flip": hdr_flip,
                      "ssim": ssim, "ms": least}
            if floor:
                figure.update(psnr_of_noise=floor[0], psnr_without_noise=without_noise(psnr, floor[0]))
            if near_rims:
                figure.update(rim_pixels=near_rims.pixels, rim_psnr=near_rims.psnr(out))
            figures.append(figure)
    return figures


def pictures(options, data, frame, folder):
    """SCENE-quality.jpg: ground truth, best, balanced, paper and Blender's nodes side by side."""
    for scene in sorted(data.iterdir()):
        if scene.name in options.skip or not (scene / f"peer_both_best.{frame:04d}.exr").exists():
            continue
        shown = []
        for one in ["both", "best", "balanced", "paper", "peer_both_best"]:
            out = scene / f"{one}.{frame:04d}.exr"
            if not out.exists():
                out = folder / f"{one}.exr"
                filtered(options, one, scene, frame, folder)[0].rename(out)
            shown.append(out)
        strip(shown, options.crop, options.pictures / f"{scene.name}-quality.jpg")


def exact(program, folder):
    """Figures of shots with exact ground truth: by shot, chain and metric."""
    call(program, f"--json={folder / 'exact.json'}")
    return json.loads((folder / "exact.json").read_text("utf8"))


def scene_set(text):
    """FOLDER and frame of "FOLDER:FRAME" or "FOLDER"; or a file."""
    folder, _, frame = text.partition(":")
    if not pathlib.Path(folder).is_dir() and not folder.endswith(".json"):
        raise argparse.ArgumentTypeError(f"{folder}: no such folder; see docs/scenes.md")
    return pathlib.Path(folder), int(frame or 10)


def commit():
    done = subprocess.run(["git", "-C", pathlib.Path(__file__).parent, "describe", "--always", "--dirty"],
                          capture_output=True, text=True, check=False)
    return done.stdout.strip() or "no repository"


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("postchain", type=pathlib.Path)
    parser.add_argument("sets", type=scene_set, nargs="+", metavar="SET[:FRAME]")
    parser.add_argument("--table", choices=list(TABLES), action="append")
    parser.add_argument("--row", action="append", metavar="TEXT", help="only rows with TEXT in their label")
    parser.add_argument("--scene", action="append", help="only these scenes")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--skip", action="append", default=["wheels_720p"], help="scene to skip")
    parser.add_argument("--exact", type=pathlib.Path, metavar="EXACT_SHOTS",
                        help="the program, for the tables of exact shots")
    parser.add_argument("--json", type=pathlib.Path, metavar="FILE", help="output of every figure")
    parser.add_argument("--write", type=pathlib.Path, metavar="FILE", help="Markdown file for the tables")
    parser.add_argument("--pictures", type=pathlib.Path, help="output folder for strips")
    parser.add_argument("--crop", default="280x240+180+60", help="crop of the strips")
    options = parser.parse_args()
    figures, commits, versions, shots = [], set(), set(), {}
    with tempfile.TemporaryDirectory() as folder:
        for data, frame in options.sets:
            if data.suffix == ".json":
                content = json.loads(data.read_text("utf8"))
                figures += content["figures"]
                shots.update(content.get("exact", {}))
                commits.add(content["commit"])
                versions.add(content["version"])
            elif options.pictures:
                pictures(options, data, frame, pathlib.Path(folder))
            else:
                commits.add(commit())
                versions.add(call(options.postchain, "--version").strip())
                for name in options.table or TABLES:
                    figures += table(options, data, frame, name, pathlib.Path(folder))
        if options.exact:
            shots.update(exact(options.exact, pathlib.Path(folder)))
    labels = [quality_tables.NOISE, *(label for rows in TABLES.values() for label, _ in rows)]
    # A merged file may have rows that this version does not.
    figures.sort(key=lambda figure: labels.index(figure["row"]) if figure["row"] in labels else len(labels))
    quality_tables.print_tables(figures, times=True)
    if shots:
        quality_tables.print_exact(shots)
    if options.write:
        with contextlib.redirect_stdout(io.StringIO()) as text:
            quality_tables.print_tables(figures, times=False)
        quality_tables.write_between_marks(options.write, text.getvalue())
    if options.json:
        content = {"commit": ", ".join(sorted(commits)),
                   "version": ", ".join(sorted(versions)), "figures": figures, "exact": shots}
        options.json.write_text(json.dumps(content, indent=1) + "\n")


if __name__ == "__main__":
    main()
