#!/usr/bin/env python3
"""Error of chains against path-traced ground truth, and time, as the tables of docs/quality.md.

    tests/bench/quality.py POSTCHAIN DATA [--table motion|lens|both] [--frame 10] [--repeat 3]
                           [--pictures FOLDER]

DATA holds a folder for each scene with sharp.####.exr, mb, dof and both (ground truth), camera.json
and, for the peers, peer_*.####.exr. A cell is PSNR (dB, after x/(1+x) and gamma 2.2) / HDR-FLIP /
SSIM; time is the minimum over the repeats of the passes' total time, relative to the table's first chain.
--pictures makes strips of full-size crops instead (needs oiiotool).
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

MOTION = [
    ("`guertin`, 25 samples", "motion_blur: {mode: guertin}"),
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
    ("Blender's Defocus", "peer_defocus"),
    ("16 samples, frame alone", "depth_of_field: {samples: 16, neighbors: none}"),
    ("24 samples, frame alone", "depth_of_field: {samples: 24, neighbors: none}"),
    ("the same, not denoised",
     "depth_of_field: {samples: 24, neighbors: none, denoise: false}"),
    ("128 samples, frame alone", "depth_of_field: {samples: 128, neighbors: none}"),
    ("32 samples, the default", "depth_of_field: {samples: 32}"),
    ("128 samples", "depth_of_field: {samples: 128}"),
]
BOTH = [
    ("`paper`", "paper"),
    ("`dof_first`", "dof_first"),
    ("Blender's Defocus, then Vector Blur, tuned on the ground truth", "peer_both_best"),
    ("motion blur, then depth of field", "motion_blur: {} ; depth_of_field: {}"),
    ("depth of field, then motion blur", "depth_of_field: {} ; motion_blur: {}"),
    ("the same, then FXAA",
     "depth_of_field: {} ; motion_blur: {} ; fxaa: {mode: directional}"),
    ("`fast`: `joint_blur`, 16 samples, frame alone, then FXAA", "fast"),
    ("`joint_blur`, 32 samples, frame alone", "joint_blur: {samples: 32, neighbors: none}"),
    ("`joint_blur`, 128 samples, frame alone", "joint_blur: {samples: 128, neighbors: none}"),
    ("`joint_blur`, 32 samples", "joint_blur: {samples: 32}"),
    ("`balanced`: the same, then FXAA", "balanced"),
    ("`joint_blur`, 128 samples", "joint_blur: {samples: 128}"),
    ("`best`: the same, 8 starts", "best"),
]
TABLES = {"motion": ("mb", MOTION), "lens": ("dof", LENS), "both": ("both", BOTH)}


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


def run_chain(options, chain, scene, folder):
    """Filters the frame into folder; ms of all passes."""
    call(options.postchain, "run", chain_path(chain, folder), "-i", scene / "sharp.####.exr",
         "--camera", scene / "camera.json", "--frames", options.frame, "-o",
         folder / "out.####.exr", "--on-existing", "overwrite", "-q")
    sidecar = json.loads((folder / f"out.{options.frame:04d}.exr.json").read_text())
    return sum(one["ms"] for one in sidecar["times_ms"]["passes"])


def strip(pictures, crop, path):
    """Crops (WxH+X+Y) side by side, after x/(1+x) and gamma 2.2, as JPEG."""
    command = ["oiiotool"]
    for picture in pictures:
        command += [picture, "--ch", "0,1,2", "--chnames", "R,G,B", "--cut", crop,
                    "--clamp:min=0,0,0", "--dup", "--addc", "1", "--div", "--powc", "0.454545"]
    call(*command, "--mosaic:pad=4", f"{len(pictures)}x1", "-d", "uint8", "--nosoftwareattrib",
         "--eraseattrib", ".*", "--compression", "jpeg:90", "-o", path)


def filtered(options, chain, scene, folder):
    """Path of the filtered frame, and the least time of its passes in ms."""
    least = min(run_chain(options, chain, scene, folder) for _ in range(options.repeat))
    return folder / f"out.{options.frame:04d}.exr", least


def table(options, name, folder):
    truth, rows = TABLES[name]
    scenes = [scene for scene in sorted(options.data.iterdir())
              if (scene / f"{truth}.{options.frame:04d}.exr").exists()
              and (scene / "camera.json").exists() and scene.name not in options.skip]
    names = [scene.name for scene in scenes]
    print(f"| frame {options.frame}, `{truth}` | " + " | ".join(names) + " | mean | time |")
    print("|---" * (len(names) + 3) + "|")
    first = None
    for label, chain in rows:
        cells, total, missing = [], 0, False
        for scene in scenes:
            least = None
            if chain.startswith("peer_"):
                out = scene / f"{chain}.{options.frame:04d}.exr"
                missing = missing or not out.exists()
            else:
                out, least = filtered(options, chain, scene, folder)
                total += least
            if missing:
                break
            found = json.loads(call(
                options.postchain, "diff", scene / f"{truth}.{options.frame:04d}.exr", out,
                "--metric", "psnr", "--metric", "hdr_flip", "--metric", "ssim", "--json"))
            cells.append([found["psnr"], found["hdr_flip"], found["ssim"]])
        if missing:
            continue
        cells.append([sum(values) / len(scenes) for values in zip(*cells)])
        time = ""
        if total:
            first = first or total
            time = f"{total / first:.1f}"
        texts = [f"{p:.2f} / {f:.3f} / {s:.3f}".replace("/ 0.", "/ .") for p, f, s in cells]
        print(f"| {label} | " + " | ".join(texts) + f" | {time} |", flush=True)
    print()


def pictures(options, folder):
    """SCENE-quality.jpg: ground truth, best, balanced, paper and Blender's nodes side by side."""
    for scene in sorted(options.data.iterdir()):
        if scene.name in options.skip or not (scene / "peer_both_best.0010.exr").exists():
            continue
        shown = []
        for one in ["both", "best", "balanced", "paper", "peer_both_best"]:
            out = scene / f"{one}.{options.frame:04d}.exr"
            if not out.exists():
                out = folder / f"{one}.exr"
                filtered(options, one, scene, folder)[0].rename(out)
            shown.append(out)
        strip(shown, options.crop, options.pictures / f"{scene.name}-quality.jpg")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("postchain", type=pathlib.Path)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--table", choices=list(TABLES), action="append")
    parser.add_argument("--frame", type=int, default=10)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--skip", action="append", default=["wheels_720p"], help="scene to skip")
    parser.add_argument("--pictures", type=pathlib.Path, help="output folder for strips")
    parser.add_argument("--crop", default="280x240+180+60", help="crop of the strips")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        if options.pictures:
            return pictures(options, pathlib.Path(folder))
        for name in options.table or TABLES:
            table(options, name, pathlib.Path(folder))


main()
