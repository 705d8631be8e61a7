"""What the ordering study compares: scenes, chains, questions (docs/ordering.md)."""
import collections

# Generated scenes: (folder, frames, arguments of `postchain scene`). Folders whose names begin with
# the same family differ in lens or shutter only.
GENERATED = [
    ("generated_wheels", "1-12", "wheels"),
    ("generated_wheels_far", "1-12", "wheels --focus-distance 3"),
    ("generated_wheels_wide", "1-12", "wheels --f-stop 0.7 --aperture-blades 6"),
    ("generated_poles", "1-12", "poles"),
    ("generated_poles_far", "1-12", "poles --focus-distance 8"),
    ("generated_poles_f2.8", "1-12", "poles --f-stop 2.8"),
    ("generated_crossing", "1-12", "crossing"),
    ("generated_crossing_near", "1-12", "crossing --focus-distance 0.8"),
    ("generated_crossing_open", "1-12", "crossing --shutter-frames 0.9"),
    ("generated_zoom", "1-12", "zoom"),
    ("generated_zoom_open", "1-12", "zoom --f-stop 1 --shutter-frames 0.9"),
    ("generated_still", "1-2", "still"),
]
SIZE, TRUTH_SAMPLES = "320x180", 256
# Nothing moves there, so the order of the blurs changes no bit: it is no case for an interval.
STILL = "generated_still"


def family(scene):
    """Scenes of a family show the same objects; the family is the unit of the intervals."""
    return "_".join(scene.split("_")[:2])


# Where a chain is measured: on every frame; on the first FEW_FRAMES of one scene of each family; on
# the same frames of `gbuf` (one sample a pixel, as an engine renders).
ALL, FEW, GBUF = "all", "few", "gbuf"
FEW_FRAMES = 2

Chain = collections.namedtuple("Chain", "name label passes where")

REPORT = {
    "mb": "motion_blur: {mode: guertin, samples: 25, max_blur_px: 40, jitter: 0.95, "
          "center_weight: 40, variance_threshold_px: 1.5}",
    "fxaa": "fxaa: {preset: 12, hint: checkerboard, hint_gate: tile}",
    "dof": "depth_of_field: {method: gilham, coc: lens, downsample: 4, leak: coc}",
}
OURS = {
    "mb": "motion_blur: {mode: inverse_warp}",
    "fxaa": "fxaa: {mode: directional}",
    "dof": "depth_of_field: {method: inverse_warp}",
}
ALONE = {name: text.replace("warp}", "warp, neighbors: none}") for name, text in OURS.items()}
WORDS = {"mb": "MB", "fxaa": "FXAA", "dof": "DoF"}
FILTERS = {"report": ("report", REPORT), "ours": ("ours", OURS), "alone": ("ours, frame alone", ALONE)}


def chain(name, where=ALL, **more):
    """A chain from its name, "report mb fxaa dof"; more: parameters added to a pass."""
    filters, *order = name.split()
    title, texts = FILTERS[filters]
    passes = [texts[one].replace("}", f", {more[one]}}}") if one in more else texts[one]
              for one in order]
    label = f"{title}: " + " → ".join(WORDS[one] for one in order)
    if more:
        label += ", " + ", ".join(f"`{value}`" for value in more.values())
        name += " " + " ".join(value.split(":")[0] for value in more.values())
    return Chain(name, label, " ; ".join(passes), where)


def joint(name, label, parameters, where=ALL, after=""):
    return Chain(name, label, f"joint_blur: {{{parameters}}}" + after, where)


def fxaa_positions(filters, order, where):
    """FXAA first, between and last."""
    first, second = order.split()
    return [chain(f"{filters} {passes}", where)
            for passes in (f"fxaa {order}", f"{first} fxaa {second}", f"{order} fxaa")]


CHAINS = [
    chain("report mb dof"),
    chain("report dof mb"),
    chain("ours mb dof"),
    chain("ours dof mb"),
    joint("joint 32", "ours: jointly, 32 samples", "samples: 32"),
    chain("alone mb dof"),
    chain("alone dof mb"),
    joint("alone joint 32", "ours, frame alone: jointly, 32 samples",
          "samples: 32, neighbors: none"),
    joint("joint 128", "ours: jointly, 128 samples", "samples: 128", FEW),
    joint("alone joint 128", "ours, frame alone: jointly, 128 samples",
          "samples: 128, neighbors: none", FEW),
    joint("joint 32 fxaa", "ours: jointly, 32 samples → FXAA", "samples: 32", FEW,
          " ; " + OURS["fxaa"]),
    *fxaa_positions("report", "mb dof", FEW),
    *fxaa_positions("report", "dof mb", FEW),
    *fxaa_positions("ours", "dof mb", FEW),
    chain("report mb dof", GBUF),
    chain("report dof mb", GBUF),
    chain("ours dof mb", GBUF),
    joint("joint 32", "ours: jointly, 32 samples", "samples: 32", GBUF),
    joint("joint 32 fxaa", "ours: jointly, 32 samples → FXAA", "samples: 32", GBUF,
          " ; " + OURS["fxaa"]),
    *fxaa_positions("report", "mb dof", GBUF),
    *fxaa_positions("report", "dof mb", GBUF),
    *fxaa_positions("ours", "dof mb", GBUF),
]
LABELS = {one.name: one.label for one in CHAINS}

# What is asked: the gain of the second chain over the first. `source` is the input; `card`: one of
# the answers at the top of the page.
Question = collections.namedtuple("Question", "group text first second source card")


def ask(group, text, first, second, source="sharp", card=False):
    return Question(group, text, first, second, source, card)


def fxaa_questions(source):
    """FXAA in each place against none."""
    found = []
    for filters, order in (("report", "mb dof"), ("report", "dof mb"), ("ours", "dof mb")):
        first, second = order.split()
        for place, passes in (("first", f"fxaa {order}"), ("between", f"{first} fxaa {second}"),
                              ("last", f"{order} fxaa")):
            found.append(ask(f"FXAA, input `{source}`", f"{LABELS[f'{filters} {order}']}: {place}",
                             f"{filters} {order}", f"{filters} {passes}", source))
    return found + [ask(f"FXAA, input `{source}`", f"{LABELS['joint 32']}: last", "joint 32",
                        "joint 32 fxaa", source)]


ORDER, JOINT = "Lens first, against motion first", "Jointly, against lens first"
QUESTIONS = [
    ask(ORDER, "report's filters", "report mb dof", "report dof mb", card=True),
    # As `paper` and `dof_first`.
    ask(ORDER, "report's filters, with FXAA", "report mb fxaa dof", "report dof mb fxaa"),
    ask(ORDER, "ours, frame alone", "alone mb dof", "alone dof mb", card=True),
    ask(ORDER, "ours, with neighbors", "ours mb dof", "ours dof mb", card=True),
    ask(JOINT, "32 samples, frame alone", "alone dof mb", "alone joint 32"),
    ask(JOINT, "32 samples, with neighbors", "ours dof mb", "joint 32", card=True),
    ask(JOINT, "128 samples, frame alone", "alone dof mb", "alone joint 128"),
    ask(JOINT, "128 samples, with neighbors", "ours dof mb", "joint 128", card=True),
    ask(JOINT, "32 samples, FXAA last", "ours dof mb fxaa", "joint 32 fxaa", card=True),
    ask(JOINT, "32 samples, FXAA on gbuf", "ours dof mb fxaa",
        "joint 32 fxaa", GBUF),
    *[question for source in ("sharp", "gbuf") for question in fxaa_questions(source)],
]

# Whose gain turns around with the sizes of the blurs.
TURNS = next(one for one in QUESTIONS if one.first == "ours mb dof" and one.second == "ours dof mb")

Metric = collections.namedtuple("Metric", "key label sign digits unit")
# sign: +1 where more is nearer to the truth.
METRICS = [
    Metric("hdr_flip", "HDR-FLIP", -1, 4, ""),
    Metric("psnr", "PSNR", +1, 2, "dB"),
    Metric("ssim", "SSIM", +1, 4, ""),
    Metric("tde", "temporal error", -1, 4, ""),
]

# The first one's time is 1.
TIMED = ["ours dof mb", "ours mb dof", "joint 32", "joint 128", "alone dof mb", "alone mb dof",
         "alone joint 32", "alone joint 128", "report mb dof", "report dof mb"]
CLAIMS = [("report mb dof", "report dof mb"), ("ours mb dof", "ours dof mb")]

# Pictures: {name: (scene, frame, crop, enlarged, chains beside the ground truth)}.
SHOWN = ["ours mb dof", "ours dof mb", "joint 128", "report mb dof", "report dof mb"]
STRIPS = {
    "flagpole": ("flagpole", 11, "200x200+60+60", 1, SHOWN),
    "crossing": ("generated_crossing_open", 3, "120x90+90+90", 2, SHOWN),
}
