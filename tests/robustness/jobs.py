"""Shared by the scripts of this folder: a small generated sequence, subcommands as jobs
over it, and checks of a finished job's outputs.

All outputs of a job are in a separate folder. `Job.content()` returns their content without
times, so that two runs of one job can be compared: images bit by bit, JSON without
measurements, pages and tables by being complete.
"""
import json
import os
import pathlib
import re
import shutil
import subprocess

TEMPORARY = re.compile(r"\.(.+)\.\d+\.tmp")
# Keys of JSON by which two runs of a job may differ: where it wrote, what the clock says (notes tell
# of times that cannot be trusted), and what the process had done before.
OWN_KEYS = {"output", "command", "times_ms", "timing", "pareto", "notes", "counters", "resumed"}


class Job:
    """A command line; {OUT} is the folder of its outputs, {IN} that of its inputs.

    resumes: --on-existing of a run after an interrupted one; replaces: the job whose outputs already
    exist.
    """

    def __init__(self, name, words, resumes, replaces=None):
        self.name, self.words, self.resumes = name, words.split(), resumes
        self.replaces = replaces

    def command(self, postchain, scene, out, on_existing=None):
        words = [word.format(OUT=out, IN=scene) for word in self.words]
        return [str(postchain), *words, "--on-existing", on_existing or self.resumes, "-q"]


CAMERA = "--camera {IN}/camera.json"
REPORT = f"-i {{IN}}/sharp.####.exr -r {{IN}}/both.####.exr {CAMERA} -o {{OUT}}/report --repeats 1 " \
         "--page-frames 1"
JOBS = {job.name: job for job in [
    Job("run", f"run balanced -i {{IN}}/sharp.####.exr {CAMERA} -o {{OUT}}/o.####.exr --png",
        "skip"),
    Job("ab", f"ab fast paper {REPORT}", "overwrite"),
    Job("bench", f"bench fast {REPORT} --sweep joint_blur.samples=5,9", "skip"),
    Job("replace", f"run fast -i {{IN}}/sharp.####.exr {CAMERA} -o {{OUT}}/o.####.exr --png",
        "overwrite", replaces="run"),
    Job("stages", f"run fast -i {{IN}}/sharp.0001.exr {CAMERA} -o {{OUT}}/o.exr --no-sidecar "
        "--dump-stages {OUT}/stages", "overwrite"),
    Job("scene", "scene still -o {OUT}/scene --size 24x16 --frames 1-2", "overwrite"),
    Job("diff", "diff {IN}/both.####.exr {IN}/sharp.####.exr --map {OUT}/map.####.exr",
        "overwrite"),
    Job("stress", "stress fast -o {OUT}/page --only *still*fp32", "overwrite"),
]}


def make_scene(postchain, folder, frames):
    """Frames, ground truth and camera.json of a generated scene, 48x32."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    done = subprocess.run([str(postchain), "scene", "crossing", "-o", str(folder), "--size",
                           "48x32", "--frames", f"1-{frames}", "--truth-samples", "4", "-q"],
                          capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(done.stderr)


def empty(folder):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def temporaries(folder):
    return sorted(path for path in folder.rglob("*") if TEMPORARY.fullmatch(path.name))


def files_of(folder):
    """Finished files: every file except temporaries, as paths relative to the folder."""
    return sorted(path.relative_to(folder) for path in folder.rglob("*")
                  if path.is_file() and not TEMPORARY.fullmatch(path.name))


def _comparable(value):
    if isinstance(value, dict):
        return {key: _comparable(item) for key, item in value.items() if key not in OWN_KEYS}
    return [_comparable(item) for item in value] if isinstance(value, list) else value


def content(path):
    """Content of the file for comparison; AssertionError if it is not complete."""
    data = path.read_bytes()
    assert data, f"{path}: empty"
    if path.suffix == ".json":
        try:
            return _comparable(json.loads(data))
        except ValueError as error:
            raise AssertionError(f"{path}: half a file: {error}") from error
    if path.suffix in (".html", ".md", ".csv", ".txt"):
        # They contain times. Check that they are complete: the page by its end tag, others by a
        # line end.
        end = b"</html>\n" if path.suffix == ".html" else b"\n"
        assert data.endswith(end), f"{path}: half a file"
        return "whole"
    return data


def contents(folder):
    return {str(path): content(folder / path) for path in files_of(folder)}


def differences_of_file(folder, path, expected):
    """Faults of a finished file, as sentences."""
    try:
        value = content(folder / path)
    except AssertionError as error:
        return [str(error)]
    if str(path) not in expected:
        return [f"{folder / path}: is no file of the job"]
    if value == expected[str(path)]:
        return []
    at = ""
    if isinstance(value, bytes):
        other = expected[str(path)]
        first = next((i for i, (a, b) in enumerate(zip(value, other)) if a != b), min(len(value), len(other)))
        at = f" from byte {first} on: {value[first:first + 16].hex()}, there {other[first:first + 16].hex()}"
    return [f"{folder / path}: differs from the undisturbed job's{at}"]


def differences(folder, expected, whole):
    """Faults of a job's files, as sentences. Missing files count if the job is complete."""
    said = [sentence for path in files_of(folder)
            for sentence in differences_of_file(folder, path, expected)]
    if whole:
        said += [f"{folder / path}: is missing" for path in expected
                 if not (folder / path).is_file()]
    return said


def run(command, environment=None, timeout=600):
    return subprocess.run(command, capture_output=True, text=True, timeout=timeout,
                          env={**os.environ, **(environment or {})})


def undisturbed(job, postchain, scene, folder):
    """Contents of an undisturbed job."""
    out = empty(folder)
    done = run(job.command(postchain, scene, out))
    if done.returncode:
        raise SystemExit(f"{job.name}: exit code {done.returncode}\n{done.stderr}")
    return contents(out)


def add_options(parser):
    parser.add_argument("postchain", type=pathlib.Path, help="the built command")
    parser.add_argument("--work", type=pathlib.Path, required=True, help="folder for its files")


def watched(library, folder, log, fail=None):
    """Environment in which the library of file_calls.cpp watches the folder."""
    environment = {"LD_PRELOAD": str(library.resolve()),
                   "POSTCHAIN_FILE_CALLS_FOLDER": str(folder),
                   "POSTCHAIN_FILE_CALLS_LOG": str(log)}
    if fail:
        environment["POSTCHAIN_FILE_CALLS_FAIL"] = fail
    return environment
