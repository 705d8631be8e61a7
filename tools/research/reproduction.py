#!/usr/bin/python3
"""Measures the claims of the 2013 report: docs/reproduction.md, its tables in docs/studies/tables.md.

    PYTHONPATH=build/python tools/research/reproduction.py FOLDER [--data DATA] [--only 4.3] [--write FILE]
                                                           [--pictures FOLDER]

FOLDER gets the generated scenes and results.json. Interrupted, the same command continues: a measurement that
results.json has for this commit of the filters is not repeated. DATA holds path-traced wheels, flagpole and
crossing (docs/scenes.md). --only measures the rows whose name begins so; the others are printed if they are
there. --write puts the tables between the two marks of a Markdown file. --pictures FOLDER writes strips instead
(needs DATA and python3-openimageio).

A gain is that of B over A, positive where B is closer to ground truth. Means, 95 % intervals and p are over
families of scenes, as in a study (docs/studies.md). Holm's correction is over QUESTIONS, one for each claim, on the
families of cards.py alone: the questions were named after the other families had been seen. Switches that the product
lacks come from guertin.py, which is compared with the product in row 0.
"""
import argparse
import contextlib
import io
import json
import math
import pathlib
import subprocess
import sys
import textwrap

import numpy as np
import postchain

import cards
import guertin
import quality_tables

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests/measure/study"))
import recompute  # noqa: E402

MARK = "<!-- tables of tools/research/reproduction.py -->"
WIDTH, HEIGHT = 240, 135
SEEDS = range(4)
FILTERS = ["chain", "passes", "shaders", "tools/metrics", "tools/scenes", "tools/research/guertin.py",
           "tools/research/cards.py"]
SHOTS = [("wheels", "wheels"), ("flagpole", "flagpole"), ("crossing", "crossing")]  # name, family
SCENES = [("wheels", "wheels"), ("poles", "poles"), ("crossing", "crossing"), ("zoom", "zoom")]
CARDS = (160, 100)


def blur(**values):
    return {"motion_blur": {"mode": "guertin", "max_blur_px": 40, **values}}


def product(*passes):
    return ["product", *passes]


def port(**switches):
    return ["port", switches]


REPORT = product(blur())
FXAA = {"fxaa": {"preset": 12}}
CHECKERBOARD = {"fxaa": {"preset": 12, "hint": "checkerboard", "hint_gate": "tile"}}
RATES = (9, 17, 25, 35, 51, 75, 101)


# ---------------------------------------------------------------------------------------------- scenes
class Scene:
    def __init__(self, name, family, shutter, sharp, aliased, truth):
        """`sharp` and `aliased`: color, inverse depth and motion."""
        self.name, self.family, self.shutter = name, family, shutter
        self.planes = {"sharp": sharp, "gbuf": aliased}
        self.truth = truth
        self.height, self.width = truth.shape[:2]
        self.displayed = displayed(self.truth)
        self.masks = self._masks()

    def frame(self, kind, depth_scale=1.0):
        color, q, motion = self.planes[kind]
        with np.errstate(divide="ignore"):
            depth = np.where(q > 0, depth_scale / q, 0).astype(np.float32)
        return postchain.Frame(color, depth, motion, camera={"shutter_frames": self.shutter})

    def _masks(self):
        """slow: pixels that stand before or near something that moves; border: within 4 px of a tile's border;
        unblurred: pixels that ground truth does not blur, where the filter may."""
        color, _, motion = self.planes["sharp"]
        v, length = guertin.half_velocity(motion, self.shutter, 40)
        longest = guertin.neighbor_max(*guertin.tile_max(v, length, 40), True)
        y, x = np.mgrid[:self.height, :self.width]
        moving = np.hypot(*np.moveaxis(longest[y // 40, x // 40], -1, 0)) > 0.5
        near = np.zeros(moving.shape, bool)
        for at, size in ((y, self.height), (x, self.width)):
            near |= ((at % 40 < 4) & (at >= 40)) | ((at % 40 >= 36) & (at // 40 < (size - 1) // 40))
        same = np.abs(displayed(color[..., :3]) - self.displayed).max(-1) < 0.01
        return {"all": np.ones(moving.shape, bool), "slow": (length < 0.5) & moving, "border": near & moving,
                "inside": ~near & moving, "unblurred": same & moving}


def cropped_image(image):
    y, x = (image.shape[0] - HEIGHT) // 2, (image.shape[1] - WIDTH) // 2
    return np.ascontiguousarray(image[y:y + HEIGHT, x:x + WIDTH, :3], np.float32)


def cropped(frame):
    planes = frame.planes()
    def cut(plane):
        y, x = (plane.shape[0] - HEIGHT) // 2, (plane.shape[1] - WIDTH) // 2
        return np.ascontiguousarray(plane[y:y + HEIGHT, x:x + WIDTH], np.float32)
    return cropped_image(planes["color"]), np.squeeze(cut(planes["inverse_depth"])), cut(planes["motion"])


def displayed(image):
    image = np.maximum(image, 0).astype(float)
    return (image / (1 + image)) ** (1 / 2.2)


def read_scene(name, family, shutter, path, number):
    sharp, aliased, truth = (postchain.read(path / f"{kind}.{number:04d}.exr", camera=path / "camera.json")
                             for kind in ("sharp", "gbuf", "mb"))
    return Scene(name, family, shutter, cropped(sharp), cropped(aliased), cropped_image(truth.planes()["color"]))


def scenes_of(folder, data):
    found = []
    for name, family in SCENES:
        path = folder / "scenes" / name
        if not (path / "camera.json").exists():  # written last
            path.mkdir(parents=True, exist_ok=True)
            postchain.scene(name, path, size=(WIDTH, HEIGHT), frames="2", truth_samples=256,
                            camera={"shutter_frames": 1.0}, on_existing="overwrite")
        found.append(read_scene(f"generated {name}", family, 1.0, path, 2))
    for name, family in SHOTS if data else ():
        found.append(read_scene(name, family, 0.5, data / name, 10))
    for name in cards.SCENES:
        path = folder / "scenes" / f"{name}.npz"
        if not path.exists():
            *frames, truth = cards.render(name, *CARDS)
            partial = path.with_suffix(".part.npz")
            np.savez(partial, truth=truth, **{f"{kind}_{i}": plane for kind, frame in zip(("sharp", "gbuf"), frames)
                                              for i, plane in enumerate(frame)})
            partial.replace(path)
        with np.load(path) as kept:
            found.append(Scene(f"cards {name}", f"cards {name}", 1.0,
                               *([kept[f"{kind}_{i}"] for i in range(3)] for kind in ("sharp", "gbuf")),
                               kept["truth"]))
    return found


# ---------------------------------------------------------------------------------------- measurements
def psnr(squared):
    return -10 * math.log10(max(float(np.mean(squared)), 1e-20)) if squared.size else None


class Measurer:
    """Runs filters on scenes, and remembers what it measured in results.json."""

    def __init__(self, folder, scenes):
        self.path, self.scenes, self.chains, self.measuring = folder / "results.json", scenes, {}, True
        self.device = postchain.Device("auto")
        git = ["git", "-C", str(ROOT)]
        def answer(*words):
            return subprocess.run([*git, *words, "--", *FILTERS], capture_output=True, text=True).stdout.strip()
        self.commit = answer("log", "-1", "--format=%h") + ("-dirty" if answer("status", "--short") else "")
        self.store = json.loads(self.path.read_text()) if self.path.exists() else {}

    def run(self, scene, kind, setting, seed=0, depth_scale=1.0):
        if setting[0] == "port":
            color, q, motion = scene.planes[kind]
            return guertin.blur(color, q, motion, **{"shutter": scene.shutter, "seed": seed, **setting[1]})
        passes = [{name: {**values, **({"seed": seed} if name == "motion_blur" and seed else {})}
                   for name, values in one.items()} for one in setting[1:]]
        key = json.dumps(passes)
        if key not in self.chains:
            self.chains[key] = postchain.Chain({"postchain": 1, "passes": passes})
        return self.chains[key].run(scene.frame(kind, depth_scale), device=self.device)[..., :3]

    def _kept(self, key, measure):
        key = json.dumps(key)
        kept = self.store.get(key)
        now = {"commit": self.commit, "device": self.device.renderer}
        if kept and kept.items() >= now.items():
            return kept["value"]
        if not self.measuring:
            return None
        self.store[key] = {**now, "value": measure()}
        partial = self.path.with_suffix(".part")
        partial.write_text(json.dumps(self.store))
        partial.replace(self.path)
        return self.store[key]["value"]

    def errors(self, scene, kind, setting):
        """HDR-FLIP, and PSNR over each mask."""
        def measure():
            image = self.run(scene, kind, setting)
            squared = (displayed(image) - scene.displayed) ** 2
            found = {name: psnr(squared[mask]) for name, mask in scene.masks.items()}
            found["hdr_flip"] = postchain.diff(scene.truth, np.ascontiguousarray(image, np.float32),
                                               metrics=["hdr_flip"])["hdr_flip"]
            return found
        return self._kept(["errors", scene.name, kind, setting], measure)

    def noise(self, scene, kind, setting):
        """Flicker over seeds, and PSNR of the seeds' mean near tile borders and elsewhere."""
        def measure():
            images = np.array([displayed(self.run(scene, kind, setting, seed)) for seed in SEEDS])
            squared = (images.mean(0) - scene.displayed) ** 2
            return {"noise": float(images.std(0, ddof=1).mean()),
                    **{f"mean {name}": psnr(squared[mask]) for name, mask in scene.masks.items()}}
        return self._kept(["noise", scene.name, kind, setting], measure)

    def special(self, scene, name, measure):
        return self._kept(["special", scene.name, name], lambda: measure(self, scene))

    def gain(self, metric, scene, kind, a, b):
        """Of B over A: lower error or noise, higher PSNR."""
        if metric == "noise" or metric.startswith("mean "):
            found = [self.noise(scene, kind, one) for one in (a, b)]
        else:
            found = [self.errors(scene, kind, one) for one in (a, b)]
        values = [one and one[metric] for one in found]
        if None in values:
            return None
        return values[0] - values[1] if metric in ("hdr_flip", "noise") else values[1] - values[0]


def over_families(scenes, values):
    """{family: mean}; families without a value are left out."""
    found = {}
    for scene, value in zip(scenes, values):
        if value is not None:
            found.setdefault(scene.family, []).append(value)
    return {family: sum(one) / len(one) for family, one in found.items()}


def tested(gains):
    """Mean, half of the 95 % interval, p of a t test, families above 0, families."""
    n, mean = len(gains), sum(gains) / len(gains)
    if n < 2:
        return mean, None, None, sum(g > 0 for g in gains), n
    error = math.sqrt(sum((g - mean) ** 2 for g in gains) / (n - 1) / n)
    p = 2 * recompute.tail(abs(mean), error, n - 1) if mean else 1.0
    return mean, error * recompute.t_of(0.95, n - 1), p, sum(g > 0 for g in gains), n


# ------------------------------------------------------------------------------------------- the rows
def oracle(measurer, scene):
    """HDR-FLIP and PSNR if each tile had the u of the least error of 0, 1/4, 1/2 and 3/4."""
    images = [measurer.run(scene, "sharp", port(u=u)) for u in (0.0, 0.25, 0.5, 0.75)]
    squared = [((displayed(one) - scene.displayed) ** 2).mean(-1) for one in images]
    best = images[0].copy()
    for y in range(0, scene.height, 40):
        for x in range(0, scene.width, 40):
            part = np.s_[y:y + 40, x:x + 40]
            best[part] = images[int(np.argmin([one[part].mean() for one in squared]))][part]
    even = measurer.errors(scene, "sharp", port(u=0.5))
    return {"psnr": psnr((displayed(best) - scene.displayed) ** 2) - even["all"],
            "hdr_flip": even["hdr_flip"] - postchain.diff(scene.truth, best.astype(np.float32),
                                                          metrics=["hdr_flip"])["hdr_flip"]}


def drift(kappa):
    def measure(measurer, scene):
        mask = scene.masks["slow"]
        if not mask.any():
            return None
        first, last = (displayed(measurer.run(scene, "sharp", product(blur(samples=n, center_weight=kappa or n,
                                                                           noise="none"))))[mask]
                       for n in (17, 45))
        return {"drift": float(np.abs(first - last).mean())}
    return measure


def perpendicular(measurer, scene):
    """Share of slow pixels that differ by more than .01 from those with the dominant direction alone, and how many
    of these are closer to ground truth."""
    mask = scene.masks["slow"]
    other, own = (displayed(measurer.run(scene, "sharp", product(blur(static_direction=one))))[mask]
                  for one in ("dominant", "perpendicular"))
    truth, changed = scene.displayed[mask], np.abs(own - other).max(-1) > 0.01
    if not changed.any():
        return None
    closer = ((own - truth) ** 2).sum(-1) < ((other - truth) ** 2).sum(-1)
    return {"changed": float(changed.mean()), "closer": float(closer[changed].mean())}


def scaled(measurer, scene):
    base = measurer.run(scene, "sharp", REPORT)
    return {str(scale): float(np.abs(measurer.run(scene, "sharp", REPORT, depth_scale=scale) - base).max())
            for scale in (1e-3, 1e3)}


def against_port(measurer, scene):
    """Largest difference of the port from the product, without jitter."""
    apart = np.abs(measurer.run(scene, "sharp", port(noise="none"))
                   - measurer.run(scene, "sharp", product(blur(noise="none")))).max(-1)
    return {"largest": float(apart.max())}


def sweep(row, what, key, values, metric="hdr_flip", kind="sharp", base=REPORT):
    return [(row, f"{what} {value}", metric, kind, base, product(blur(**{key: value})))
            for value in values]


SINGLE = product({"motion_blur": {"mode": "single", "max_blur_px": 40}})
COMPARISONS = [  # row, words, deciding metric, input, A, B
    ("4.1 directions", "two directions, not `single`", "hdr_flip", "sharp", SINGLE, REPORT),
    ("4.1 directions", "two directions, not `single`: noise", "noise", "sharp", SINGLE, REPORT),
    ("4.1 directions", "perpendicular, not dominant, for slow pixels", "hdr_flip", "sharp",
     product(blur(static_direction="dominant")), REPORT),
    ("4.1 directions", "the same, PSNR of slow pixels", "slow", "sharp",
     product(blur(static_direction="dominant")), REPORT),
    ("4.1 directions", "the appendix, not equation 1", "hdr_flip", "sharp", port(mix_reversed=True), port()),
    ("4.1 u", "variance, not even", "hdr_flip", "sharp", REPORT, product(blur(sample_split="variance"))),
    ("4.1 u", "variance, not even: noise", "noise", "sharp", REPORT, product(blur(sample_split="variance"))),
    ("4.1 u", "equation 2 as printed, not even", "hdr_flip", "sharp", port(), port(u="printed")),
    ("4.1 u", "u bilinear, not nearest", "hdr_flip", "sharp", port(u="variance", u_nearest=True),
     port(u="variance")),
    ("4.1 weights", "with w_A, not without", "hdr_flip", "sharp", port(w_a=False), port()),
    ("4.1 weights", "with w_B, not without", "hdr_flip", "sharp", port(w_b=False), port()),
    ("4.1 weights", "with max(w_A, w_B), not without", "hdr_flip", "sharp", port(w_both=False), port()),
    ("4.2 tiles", "offset, not without: PSNR near borders, mean of seeds", "mean border", "sharp",
     product(blur(tile_jitter=False)), REPORT),
    ("4.2 tiles", "the same, elsewhere", "mean inside", "sharp", product(blur(tile_jitter=False)), REPORT),
    ("4.2 tiles", "v_max interpolated, not looked up", "hdr_flip", "sharp", port(tile_noise=False),
     port(interpolated=True)),
    *sweep("4.2 tiles", "tau", "tile_jitter_slope", (0.25, 0.5, 2, 4)),
    ("4.3 center", "report's weight, not the older one: PSNR of slow pixels, N = 17", "slow", "sharp",
     product(blur(samples=17, center_weight=17)), product(blur(samples=17))),
    ("4.3 center", "the same, N = 25", "slow", "sharp", product(blur(center_weight=25)), REPORT),
    ("4.3 center", "the same, N = 45", "slow", "sharp", product(blur(samples=45, center_weight=45)),
     product(blur(samples=45))),
    *sweep("4.3 center", "kappa", "center_weight", (10, 20, 80, 160)),
    *sweep("4.3 center", "depth softness", "depth_softness", (0, 5, 20)),
    ("4.4 diagonal", "with the test, not without", "hdr_flip", "sharp", port(diagonal=False), port()),
    ("4.4 diagonal", "the same, PSNR of pixels that are not blurred", "unblurred", "sharp", port(diagonal=False),
     port()),
    ("4.5 jitter", "Halton, not hashed", "hdr_flip", "sharp", port(noise="hashed"), port()),
    ("4.5 jitter", "Halton, not hashed: noise", "noise", "sharp", port(noise="hashed"), port()),
    ("4.5 jitter", "Halton, not none", "hdr_flip", "sharp", product(blur(noise="none")), REPORT),
    ("4.5 jitter", "without the central tap, not with it", "hdr_flip", "sharp", port(), port(central=False)),
    *sweep("4.5 jitter", "h", "jitter", (0, 0.5)),
    ("4.5 jitter", "h 1.5", "hdr_flip", "sharp", port(), port(h=1.5)),
    ("4.5 jitter", "h 2", "hdr_flip", "sharp", port(), port(h=2.0)),
    *((f"4.5 FXAA {kind}", f"{words}, not without{what}", metric, kind, REPORT, product(blur(), fxaa))
      for kind in ("gbuf", "sharp") for words, fxaa in (("FXAA", FXAA), ("FXAA, checkerboard", CHECKERBOARD))
      for what, metric in (("", "hdr_flip"), (": PSNR", "all"), (": noise", "noise"))),
    *((f"4.5 FXAA {kind}", "checkerboard, not plain FXAA: PSNR of pixels that are not blurred", "unblurred", kind,
       product(blur(), FXAA), product(blur(), CHECKERBOARD)) for kind in ("gbuf", "sharp")),
    ("5 storage", "8 bits as the report, not float", "hdr_flip", "sharp", REPORT,
     product(blur(velocity_storage="unorm8"))),
    ("5 storage", "8 bits as the report, not as McGuire 2012", "hdr_flip", "sharp", port(encoding="mcguire"),
     port(encoding="report")),
    *sweep("5 parameters", "N", "samples", (9, 17, 51, 101)),
    *sweep("5 parameters", "r", "max_blur_px", (20, 80)),
    *sweep("5 parameters", "gamma", "variance_threshold_px", (0.5, 3, 6)),
]
QUESTIONS = [  # one for each claim, named before cards.py was measured: what Holm's correction counts
    ("4.1 directions", "two directions, not `single`"),
    ("4.1 directions", "two directions, not `single`: noise"),
    ("4.1 directions", "the same, PSNR of slow pixels"),
    ("4.1 directions", "the appendix, not equation 1"),
    ("4.1 u", "variance, not even"),
    ("4.1 u", "u bilinear, not nearest"),
    ("4.1 weights", "with w_A, not without"),
    ("4.1 weights", "with w_B, not without"),
    ("4.1 weights", "with max(w_A, w_B), not without"),
    ("4.2 tiles", "offset, not without: PSNR near borders, mean of seeds"),
    ("4.2 tiles", "v_max interpolated, not looked up"),
    ("4.3 center", "the same, N = 25"),
    ("4.4 diagonal", "with the test, not without"),
    ("4.5 jitter", "Halton, not hashed"),
    ("4.5 jitter", "Halton, not none"),
    ("4.5 FXAA gbuf", "FXAA, not without"),
    ("4.5 FXAA gbuf", "FXAA, checkerboard, not without"),
    ("4.5 FXAA gbuf", "checkerboard, not plain FXAA: PSNR of pixels that are not blurred"),
    ("4.5 FXAA sharp", "FXAA, not without"),
    ("4.5 FXAA sharp", "FXAA, checkerboard, not without"),
    ("5 storage", "8 bits as the report, not float"),
    ("5 storage", "8 bits as the report, not as McGuire 2012"),
]
SPECIALS = [  # row, words, function, unit
    ("0 port", "port from product, without jitter", against_port),
    ("4.1 directions", "slow pixels, perpendicular and not dominant", perpendicular),
    ("4.1 u", "u of the least error in each tile, not 1/2: gain", oracle),
    ("4.3 center", "change of slow pixels from N = 17 to 45, report's weight", drift(40)),
    ("4.3 center", "the same, older weight", drift(None)),
    ("5 storage", "depth times 1e-3 and 1e3: largest change", scaled),
]


def pole():
    """Light that a still pole 3 px wide keeps before a background that moves by 20 px and is 1.1 times as far, by N
    and weight. Ground truth keeps all."""
    color, q, motion = np.zeros((80, 80, 3)), np.full((80, 80), 1 / 1.1), np.zeros((80, 80, 2))
    color[:, 39:42], q[:, 39:42], motion[..., 0] = 1, 1, 40
    motion[:, 39:42] = 0
    return {words: [float(guertin.blur(color, q, motion, shutter=1.0, samples=n, kappa=kappa or n)[:, 39:42].mean())
                    for n in (17, 25, 45)] for words, kappa in (("report's", 40), ("older", None))}


SPEEDS = (0.5, 1, 2, 4, 8, 16, 32)


def storage(encoding):
    """Errors of half-velocities of 8 bits a component, by speed: rms in px, rms angle in degrees in any direction and
    along the axes, and rms error of displayed values of a texture that all moves, against float velocities."""
    turns = np.arange(4096) * 2 * np.pi / 4096 + 0.01
    y, x = np.mgrid[:48, :48].astype(float)
    color, q = cards.waves(1, 12)(x, y), np.ones(x.shape)
    found = []
    for speed in SPEEDS:
        v = speed * np.stack([np.cos(turns), np.sin(turns)], -1)
        stored = guertin.encoded(v, 40, encoding)
        def angles(v, stored):
            return np.degrees(np.arctan2(np.abs(v[:, 0] * stored[:, 1] - v[:, 1] * stored[:, 0]),
                                         (v * stored).sum(1)))
        axes = speed * np.array([[1.0, 0], [0, 1], [-1, 0], [0, -1]])
        squared = []
        for one in v[::512]:
            motion = np.broadcast_to(2 * one, (*x.shape, 2))
            exact, coarse = (displayed(guertin.blur(color, q, motion, shutter=1.0, encoding=kind))
                             for kind in (None, encoding))
            squared.append(((exact - coarse) ** 2).mean())
        found.append([math.sqrt(np.mean(values)) for values in
                      (((v - stored) ** 2).sum(1), angles(v, stored) ** 2,
                       angles(axes, guertin.encoded(axes, 40, encoding)) ** 2, squared)])
    return found


def storages(measurer):
    return {words: measurer._kept(["storage", encoding], lambda encoding=encoding: storage(encoding))
            for words, encoding in (("the report's", "report"), ("McGuire's 2012", "mcguire"))}


def equal_rates(measurer, kind, setting):
    """By metric: the N of the report's filter that has the value of the setting, by interpolation in log N of
    the means over families."""
    def mean(setting, metric):
        values = [(measurer.noise if metric == "noise" else measurer.errors)(scene, kind, setting)
                  for scene in measurer.scenes]
        if None in values:
            return None
        families = over_families(measurer.scenes, [one[metric] for one in values])
        return sum(families.values()) / len(families)
    found = {}
    for metric in ("noise", "hdr_flip", "all"):
        goal = mean(setting, metric)
        curve = [mean(product(blur(samples=n)), metric) for n in RATES]
        if goal is None or None in curve:
            return None
        sign = 1 if metric == "all" else -1
        better = [sign * (value - goal) >= 0 for value in curve]
        if better[0]:
            text = f"below {RATES[0]}"
        elif not any(better):
            text = f"above {RATES[-1]}"
        else:
            i = better.index(True)
            part = (goal - curve[i - 1]) / (curve[i] - curve[i - 1])
            text = f"{math.exp(math.log(RATES[i - 1]) + part * math.log(RATES[i] / RATES[i - 1])):.0f}"
        found[metric] = f"{goal:.4f} = N {text}"
    return found


def steadiness(measurer, data):
    """Temporal error of frames 10 to 13 (docs/metrics.md), by shot and filter."""
    found = {}
    for name in ("wheels", "flagpole"):
        def measure(name=name):
            path = data / name
            frames = {kind: [postchain.read(path / f"{kind}.{n:04d}.exr", camera=path / "camera.json")
                             for n in range(10, 14)] for kind in ("sharp", "mb")}
            truth = [cropped_image(one.planes()["color"]) for one in frames["mb"]]
            result = {}
            for words, setting in (("`single`", SINGLE), ("report", REPORT),
                                   ("taps by variance", product(blur(sample_split="variance")))):
                images = []
                for frame in frames["sharp"]:
                    color, q, motion = cropped(frame)
                    with np.errstate(divide="ignore"):
                        depth = np.where(q > 0, 1 / q, 0).astype(np.float32)
                    chain = postchain.Chain({"postchain": 1, "passes": setting[1:]})
                    images.append(chain.run(postchain.Frame(color, depth, motion,
                                                            camera={"shutter_frames": 0.5}),
                                            device=measurer.device)[..., :3].copy())
                found = postchain.diff(truth, images, metrics=["temporal_error"])
                result[words] = found["summary"]["temporal_error"]
            return result
        found[name] = measurer._kept(["steady", name, 3], measure)
    return found


def no_offset(**switches):
    return port(tile_noise=False, **switches)


STRIPS = {  # scene, input, first row and column; settings, then ground truth
    "directions": ("crossing", "sharp", 20, 70, [SINGLE, REPORT]),
    "weights": ("generated wheels", "sharp", 20, 70, [SINGLE, REPORT, port(w_a=False), port(w_b=False)]),
    "tiles": ("cards doors", "sharp", 5, 30, [SINGLE, no_offset(), no_offset(interpolated=True), REPORT]),
    "offset": ("generated wheels", "sharp", 30, 60, [SINGLE, no_offset(), REPORT]),
    "pole": ("flagpole", "sharp", 20, 70, [product(blur(samples=17, center_weight=17)),
                                           product(blur(samples=45, center_weight=45)),
                                           product(blur(samples=17)), product(blur(samples=45))]),
    "fxaa": ("wheels", "gbuf", 20, 70, [REPORT, product(blur(), FXAA), product(blur(), CHECKERBOARD),
                                        product(blur(samples=51))]),
}


def orders(data, device):
    """Wheels, its depth of field before motion blur, after it, and ground truth of both."""
    frame, truth = (postchain.read(data / "wheels" / f"{kind}.0010.exr", camera=data / "wheels/camera.json")
                    for kind in ("sharp", "both"))
    lens = {"depth_of_field": {"method": "gilham"}}
    return [cropped_image(image) for image in (
        frame.planes()["color"],
        *(postchain.Chain({"postchain": 1, "passes": passes}).run(frame, device=device)
          for passes in ([lens, blur()], [blur(), lens])),
        truth.planes()["color"])]


def write_strip(path, images, top, left):
    import OpenImageIO as oiio
    strip = np.concatenate([np.pad(displayed(one)[top:top + 90, left:left + 100].repeat(2, 0).repeat(2, 1),
                                   ((0, 0), (0, 4), (0, 0)), constant_values=1) for one in images], 1)
    spec = oiio.ImageSpec(strip.shape[1], strip.shape[0], 3, oiio.UINT8)
    spec.attribute("compression", "jpeg:88")
    out = oiio.ImageOutput.create(str(path))
    out.open(str(path), spec)
    out.write_image(np.ascontiguousarray(strip, np.float32))
    out.close()


def write_pictures(measurer, data, folder):
    """reproduction-NAME.jpg: the input, each setting and ground truth, twice as large."""
    scenes = {scene.name: scene for scene in measurer.scenes}
    for name, (scene, kind, top, left, settings) in STRIPS.items():
        scene = scenes[scene]
        images = [scene.planes[kind][0], *(measurer.run(scene, kind, one) for one in settings), scene.truth]
        write_strip(folder / f"reproduction-{name}.jpg", images, top, left)
    write_strip(folder / "reproduction-order.jpg", orders(data, measurer.device), 20, 70)


# ------------------------------------------------------------------------------------------- the tables
def number(value):
    return "-" if value is None else f"{value:+.4f}".replace("+0.", "+.").replace("-0.", "−.").replace("-", "−")


MARGINS = {"hdr_flip": 0.005, "noise": 0}  # docs/studies.md; PSNR: .4 dB


def finding(metric, mean, half):
    """What the interval alone says: B, A, equal or nothing."""
    if abs(mean) > half:
        return "B" if mean > 0 else "A"
    return "equal" if abs(mean) + half < MARGINS.get(metric, 0.4) else ""


def print_comparisons(measurer):
    rows = []
    for row, words, metric, kind, a, b in COMPARISONS:
        families = over_families(measurer.scenes,
                                 [measurer.gain(metric, scene, kind, a, b) for scene in measurer.scenes])
        if len(families) > 1:
            new = [gain for family, gain in families.items() if family.startswith("cards")]
            asked = (row, words) in QUESTIONS and len(new) > 1
            rows.append((row, words, metric, tested(list(families.values())), tested(new)[2] if asked else None))
    corrected = recompute.holm([one[-1] for one in rows])
    print("| row | B, not A | by | gain | better | families | p | Holm |\n|---|---|---|---|---|---|---|---|")
    names = {"hdr_flip": "", "noise": "noise"}
    before = None
    for (row, words, metric, (mean, half, p, up, n), _), holm in zip(rows, corrected):
        interval = f"{number(mean)}±{number(half)[1:]}"
        decided = "" if holm is None else f"{holm:.2g}"
        print(f"| {'' if row == before else row} | {words} | {names.get(metric, 'PSNR')} | {interval} "
              f"| {finding(metric, mean, half)} | {up}/{n} | {p:.2g} | {decided} |".replace("e-0", "e-"))
        before = row


def print_tables(measurer, data):
    print(textwrap.fill(
        f"Commit of the filters {measurer.commit}, {measurer.device.renderer}, scenes: "
        f"{', '.join(scene.name for scene in measurer.scenes)}.", 118) + "\n")
    print_comparisons(measurer)
    lines = []
    for row, words, function in SPECIALS:
        values = [measurer.special(scene, words, function) for scene in measurer.scenes]
        for key in dict.fromkeys(key for one in values if one for key in one):
            families = over_families(measurer.scenes, [one and one[key] for one in values])
            mean, half, _, _, n = tested(list(families.values()))
            interval = "" if half is None else f"±{half:.2g}"
            lines.append(f"| {row} | {words}, {key} | {mean:.3g}{interval}, at most "
                         f"{max(families.values()):.2g} |")
    for kind in ("gbuf", "sharp"):
        for words, fxaa in (("FXAA", FXAA), ("FXAA, checkerboard", CHECKERBOARD)):
            found = equal_rates(measurer, kind, product(blur(), fxaa))
            if found:
                lines.append(f"| 4.5 FXAA {kind} | N = 25 with {words}, as N without | noise {found['noise']}; "
                             f"HDR-FLIP {found['hdr_flip']}; PSNR {found['all']} |")
    found = equal_rates(measurer, "sharp", SINGLE)
    if found:
        lines.append(f"| 4.1 directions | N = 25 of `single`, as N of the report | noise {found['noise']} |")
    gains = [measurer.gain("hdr_flip", scene, "sharp", SINGLE, REPORT) for scene in measurer.scenes]
    if None not in gains:
        lines.append("| 4.1 directions | two directions, not `single` | "
                     + ", ".join(f"{scene.name} {number(gain)}" for scene, gain in zip(measurer.scenes, gains)) + " |")
    for words, kept in pole().items():
        lines.append(f"| 4.3 center | a thin pole's light, N = 17, 25, 45, {words} weight | "
                     + ", ".join(f"{one:.3f}" for one in kept) + " |")
    for words, found in storages(measurer).items():
        for what, digits, values in zip(("px", "degrees", "degrees along axes", "image"), (2, 1, 1, 4),
                                        zip(*found) if found else ()):
            lines.append(f"| 5 storage | {words} 8 bits at {'/'.join(map(str, SPEEDS))} px: {what} | "
                         + "/".join(f"{one:.{digits}f}" for one in values) + " |")
    for name, one in (steadiness(measurer, data) if data else {}).items():
        if one:
            lines.append(f"| 6 coherence | temporal error, {name} 10 to 13 | "
                         + ", ".join(f"{words} {value:.3f}" for words, value in one.items()) + " |")
    print("\n| row | what | value |\n|---|---|---|")
    print("\n".join(lines))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--data", type=pathlib.Path)
    parser.add_argument("--only", default="")
    parser.add_argument("--write", type=pathlib.Path)
    parser.add_argument("--pictures", type=pathlib.Path)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    measurer = Measurer(options.folder, scenes_of(options.folder, options.data))
    if options.pictures:
        write_pictures(measurer, options.data, options.pictures)
        return
    measure_rows(measurer, options)
    measurer.measuring = False
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        print_tables(measurer, options.data)
    print(text.getvalue())
    if options.write:
        quality_tables.write_between_marks(options.write, text.getvalue(), MARK)


def measure_rows(measurer, options):
    for row, words, metric, kind, a, b in COMPARISONS:
        if row.startswith(options.only):
            for scene in measurer.scenes:
                measurer.gain(metric, scene, kind, a, b)
            print(row, words, file=sys.stderr)
    for row, words, function in SPECIALS:
        if row.startswith(options.only):
            for scene in measurer.scenes:
                measurer.special(scene, words, function)
            print(row, words, file=sys.stderr)
    for kind in ("gbuf", "sharp"):
        if f"4.5 FXAA {kind}".startswith(options.only):
            for fxaa in (FXAA, CHECKERBOARD):
                equal_rates(measurer, kind, product(blur(), fxaa))
    if "5 storage".startswith(options.only):
        storages(measurer)
    if options.data and "6 coherence".startswith(options.only):
        steadiness(measurer, options.data)


if __name__ == "__main__":
    main()
