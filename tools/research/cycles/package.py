#!/usr/bin/env python3
"""Makes the folder of the dataset that others download (docs/scenes.md).

    tools/research/cycles/package.py OUT FOLDER --results results.json

OUT is the folder of dataset.py, FOLDER must not exist, results.json is that of tools/research/quality.py --json.
Scenes may be incomplete; README.md lists what lacks.
"""
import argparse
import hashlib
import json
import pathlib
import shutil
import sys

import dataset

ROOT = pathlib.Path(__file__).resolve().parents[3]
CODE = ["tools/research/cycles/*.py", "tools/research/cycles/scenes/*.py", "tools/blender/postchain_blender/camera.py",
        "tools/blender/postchain_blender/peel.py", "tools/research/quality.py", "tools/research/quality_tables.py",
        "tools/research/rims.py", "tools/research/frame.py", "tools/research/scatter_gather.py", "docs/scenes.md",
        "docs/metrics.md", "LICENSE"]
README = """# Motion blur and depth of field of path-traced scenes

Ground truth of shutter and lens, together and each alone, with depth, motion vectors, neighboring frames and
cameras, for filters that blur rendered frames. Description: code/docs/scenes.md; the metrics:
code/docs/metrics.md. License of everything here: Apache 2.0, code/LICENSE; nothing is third-party.

| folder | contents |
|---|---|
| `scenes` | {scenes} |
| `results/results.json` | errors of every filter on every scene, with chains, measured with {version} ({commit}) |
| `code` | the scripts that made all of it, as in postchain's repository |

{lacking}

    sha256sum -c SHA256SUMS                          # whole and unchanged
    code/tools/research/cycles/dataset.py scenes --check   # pixels as in the manifest
    code/tools/research/cycles/dataset.py AGAIN            # renders all again with Blender 3.4.1
    code/tools/research/quality.py POSTCHAIN scenes:11 --json results.json

`quality.py` needs {version}, python3-numpy and python3-openimageio. To compare another filter, write its
images as scenes/SCENE/peer_NAME.0011.exr and add a row with `peer_NAME` to a table of `quality.py`. Choose no
constant on these scenes.
"""
CITATION = """cff-version: 1.2.0
message: If you use this dataset, please cite it.
title: "postchain: ground truth of joint motion and lens blur for nine path-traced scenes"
type: dataset
version: "{version}"
license: Apache-2.0
authors:
  - name: The postchain authors
"""


def copy(source, target):
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy2(source, target)


def lacking_text(out):
    lines = []
    for scene in dataset.SCENES:
        missing = [name for name in dataset.dataset_files() if not (out / scene / name).exists()]
        if missing:
            lines.append(f"- `{scene}`: " + ", ".join(missing))
    return "Not rendered:\n\n" + "\n".join(lines) if lines else "All scenes are complete."


def package(out, folder, results):
    content = json.loads(results.read_text("utf8"))
    if not {"commit", "version", "figures"} <= content.keys():
        sys.exit(f"{results}: no results of quality.py; make them with tools/research/quality.py ... --json")
    if "-dirty" in content["commit"] or "no repository" in content["commit"]:
        sys.exit(f"{results}: measured at {content['commit']}, which names no commit; commit all changes "
                 "and measure again in a checkout")
    found = dataset.manifest(out)
    if not found:
        sys.exit(f"{out}: no scene; render with tools/research/cycles/dataset.py {out}")
    if folder.exists():
        sys.exit(f"{folder} exists; choose another folder or remove it")
    for scene, files in found.items():
        for name in files:
            copy(out / scene / name, folder / "scenes" / scene / name)
    for pattern in CODE:
        for path in sorted(ROOT.glob(pattern)):
            copy(path, folder / "code" / path.relative_to(ROOT))
    (folder / "code/tools/research/cycles/manifest.json").write_text(dataset.manifest_text(found), "utf8")
    copy(results, folder / "results/results.json")
    values = {"version": content["version"], "commit": content["commit"],
              "scenes": ", ".join(f"`{scene}`" for scene in found), "lacking": lacking_text(out)}
    (folder / "README.md").write_text(README.format(**values), "utf8")
    (folder / "CITATION.cff").write_text(CITATION.format(**values), "utf8")
    sums = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.relative_to(folder)}\n"
            for path in sorted(folder.rglob("*")) if path.is_file()]
    (folder / "SHA256SUMS").write_text("".join(sums), "utf8")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--results", type=pathlib.Path, required=True)
    options = parser.parse_args()
    package(options.out, options.folder, options.results)


if __name__ == "__main__":
    main()
