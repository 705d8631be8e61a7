"""Shared by the scripts of this folder: run postchain over frames, compare with ground truth, cut
strips of images.

A chain is the name of a shipped chain, or its passes as in a chain file, joined by " ; "; "" changes
nothing.
"""
import json
import pathlib
import resource
import subprocess
import sys


def call(*command):
    """Returns the command's output; exits if the command fails."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(str(word) for word in command)}\n{done.stderr}")
    return done.stdout


def chain_path(chain, folder):
    """Chain argument of `postchain run`: a shipped chain's name, or a file in folder."""
    if chain and ":" not in chain:
        return chain
    path = folder / "chain.yaml"
    passes = "".join(f"\n  - {one.strip()}" for one in chain.split(" ; ")) if chain else " []"
    path.write_text(f"postchain: 1\npasses:{passes}\n")
    return path


def frame_list(frames):
    return ",".join(str(frame) for frame in frames)


def run_chain(postchain, chain, scene, frames, folder, source="sharp"):
    """Filters frames of SCENE/source into FOLDER/out.####.exr; returns {frame: ms of all passes}."""
    call(postchain, "run", chain_path(chain, folder), "-i", scene / f"{source}.####.exr",
         "--camera", scene / "camera.json", "--frames", frame_list(frames), "-o",
         folder / "out.####.exr", "--on-existing", "overwrite", "-q")
    times = {}
    for frame in frames:
        sidecar = json.loads((folder / f"out.{frame:04d}.exr.json").read_text())
        times[frame] = sum(one["ms"] for one in sidecar["times_ms"]["passes"])
    return times


def least_time(postchain, chain, scene, frame, folder, repeats, source="sharp"):
    """Minimum over the repeats of the passes' total time, in ms."""
    return min(run_chain(postchain, chain, scene, [frame], folder, source)[frame]
               for _ in range(repeats))


def processor_seconds(postchain, chain, scene, frames, folder):
    """CPU time of all threads per frame after the first, without start-up and compiling."""
    def spent(some):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        run_chain(postchain, chain, scene, some, folder)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    return (spent(frames) - spent(frames[:1])) / (len(frames) - 1)


def errors(postchain, truth, picture, *more):
    """{metric: value} of one image; HDR-FLIP at the exposures of this ground truth."""
    return json.loads(call(postchain, "diff", truth, picture, "--metric", "psnr", "--metric",
                           "hdr_flip", "--metric", "ssim", *more, "--json"))


def temporal_errors(postchain, truth, pictures, frames):
    """{frame: tde to the previous frame}, None for the first; patterns with ####."""
    if len(frames) < 2:
        return dict.fromkeys(frames)
    lines = call(postchain, "diff", truth, pictures, "--frames", frame_list(frames), "--metric",
                 "tde", "--json").splitlines()
    rows = [json.loads(line) for line in lines]
    return {row["frame"]: row["tde"] for row in rows if not row.get("summary")}


def strip(pictures, crop, path, enlarged=1):
    """Crops (WxH+X+Y) side by side, after x/(1+x) and gamma 2.2, as JPEG; enlarged: each pixel becomes a
    square of this size. Needs oiiotool."""
    command = ["oiiotool"]
    for picture in pictures:
        command += [picture, "--ch", "0,1,2", "--chnames", "R,G,B", "--cut", crop,
                    "--clamp:min=0,0,0", "--dup", "--addc", "1", "--div", "--powc", "0.454545"]
        if enlarged > 1:
            command += ["--resize:filter=box", f"{100 * enlarged}%"]
    call(*command, "--mosaic:pad=4", f"{len(pictures)}x1", "-d", "uint8", "--nosoftwareattrib",
         "--eraseattrib", ".*", "--compression", "jpeg:90", "-o", path)


def blur_sizes(scene, frame):
    """(streak, circle): mean length of the streaks and mean diameter of the circles of confusion,
    pixels of sharp.####.exr of a thin lens without refocusing; needs oiiotool."""
    camera = json.loads((scene / "camera.json").read_text())
    if isinstance(camera["frames"], dict):
        camera.update(camera["frames"].get(str(frame), {}))
    picture = scene / f"sharp.{frame:04d}.exr"

    def mean_of(*operations):
        text = call("oiiotool", picture, *operations, "--printstats")
        return float(next(line.split()[2] for line in text.splitlines() if "Stats Avg:" in line))

    speed = mean_of("--ch", "ViewLayer.Vector.Z,ViewLayer.Vector.W", "--dup", "--mul",
                    "--chsum:weight=1,1", "--powc", "0.5")
    focal = camera["focal_length_mm"]
    aperture = focal / 1000 / camera["f_stop"] / camera.get("meters_per_unit", 1)
    pixels = focal / camera["sensor_width_mm"] * camera["resolution"][0]
    defocus = mean_of("--ch", "ViewLayer.Depth.Z", "--powc", "-1", "--subc",
                      repr(1 / camera["focus_distance"]), "--abs")
    return camera["shutter_frames"] * speed, pixels * aperture * defocus


def frames_of(scene, kind):
    """Frame numbers of SCENE/kind.####.exr on disk."""
    return sorted(int(path.name.split(".")[1]) for path in pathlib.Path(scene).glob(
        f"{kind}.[0-9][0-9][0-9][0-9].exr"))
