"""From a scene to a filtered frame by the add-on, and its error against Cycles' own motion blur and depth
of field, beside the error of Blender's nodes with the settings that are best on that ground truth: the
table of docs/blender.md.

usage: python3 against_nodes.py POSTCHAIN ZIP BLENDER OUT [SCENE ...]   (corridor dancers)

Renders 480x270 with 64 samples, the ground truth with 256. What is in OUT already is not made again."""
import json
import pathlib
import subprocess
import sys

import launch

FRAME = 6
CYCLES = launch.HERE.parent / "cycles"
CHAINS = ("fast", "balanced", "best")


def errors(postchain, truth, image):
    """PSNR, HDR-FLIP and SSIM."""
    done = subprocess.run([postchain, "diff", truth, image, "--metric", "psnr", "--metric", "hdr_flip",
                           "--metric", "ssim", "--json"], capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    return found["psnr"], found["hdr_flip"], found["ssim"]


def cell(values):
    return f"{values[0]:.2f} / {values[1]:.3f} / {values[2]:.3f}".replace("/ 0.", "/ .")


def measure(blender, name, out):
    """[(row, errors)] of a scene."""
    out.mkdir(parents=True, exist_ok=True)
    if not (out / "scene.blend").exists():
        blender.run(out, "-b", "-P", CYCLES / f"{name}.py", "--", out, "--blend", "scene.blend",
                    "--frames", f"{FRAME - 1}-{FRAME + 1}", "--size", "480x270", "--sharp-samples", "64")
    if not (out / "truth.exr").exists():
        blender.run(out, "-b", "scene.blend", "-P", launch.HERE / "against_nodes_inside.py", "--", out,
                    FRAME, "filter", *CHAINS, timeout=7200)
    if not (out / "nodes").exists():
        blender.run(out, "-b", "scene.blend", "-P", launch.HERE / "against_nodes_inside.py", "--", out,
                    FRAME, "nodes", timeout=7200)
    truth = out / "truth.exr"
    file = f"shot_{FRAME:04d}.exr"
    nodes = sorted(((errors(blender.postchain, truth, path), path.stem) for path in
                    (out / "nodes").glob("*.exr")), reverse=True)
    for values, settings in nodes[:5]:
        print(f"{name}: {settings}: {cell(values)}", file=sys.stderr)
    rows = [("not filtered", errors(blender.postchain, truth, out / "render" / file)),
            ("Blender's Defocus and Vector Blur", nodes[0][0])]
    return rows + [(f"`{chain}`", errors(blender.postchain, truth, out / chain / file))
                   for chain in CHAINS]


def main():
    blender = launch.Launcher(sys.argv[1:])
    out = pathlib.Path(sys.argv[4]).resolve()
    names = sys.argv[5:] or ["corridor", "dancers"]
    columns = [measure(blender, name, out / name) for name in names]
    print("| | " + " | ".join(names) + " |\n" + "|---" * (len(names) + 1) + "|")
    for rows in zip(*columns):
        print(f"| {rows[0][0]} | " + " | ".join(cell(values) for _, values in rows) + " |")
    for name, rows in zip(names, columns):
        if max(rows[1][1][0], rows[0][1][0]) >= min(values[0] for _, values in rows[2:]):
            sys.exit(f"{name}: a chain is not closer to the ground truth than Blender's nodes")


main()
