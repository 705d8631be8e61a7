"""The tables of docs/results/ordering.md, from what has been measured."""
import intervals
from ordering_gains import (BATCH_FRAMES, FEWEST_BATCHES, gain, gains_by_size, mean_errors,
                            neighbor_correlation)
from ordering_study import (ALL, CHAINS, CLAIMS, FEW, FEW_FRAMES, GBUF, GENERATED, JOINT, LABELS,
                            METRICS, ORDER, QUESTIONS, STILL, TIMED, TURNS, family)

BEGIN = "<!-- From here on printed by tests/bench/ordering.py tables. -->"


def number(value, digits):
    """Without the 0 before the point; a real minus."""
    text = f"{abs(value):.{digits}f}"
    zero = float(text) == 0
    text = text[1:] if text.startswith("0.") else text
    return ("−" if value < 0 and not zero else "") + text


def signed(value, digits):
    text = number(value, digits)
    return text if text.startswith("−") or float(text) == 0 else "+" + text


def between(interval, digits):
    if interval is None:
        return ""
    return f" ({signed(interval[0], digits)} to {signed(interval[1], digits)})"


def heading(cells):
    return ["| " + " | ".join(cells) + " |", "|---" * len(cells) + "|"]


def line(cells):
    return "| " + " | ".join(cells) + " |"


def title(scene):
    """generated_wheels_far: wheels far, generated."""
    words = scene.split("_")
    return " ".join(words[1:]) + ", generated" if words[0] == "generated" else scene


def common_frames(results, source, chains):
    """{scene: frames} on which every one of the chains was measured; not the still scene."""
    found = {}
    for scene in results.scenes():
        frames = set.intersection(*(set(results.frames(scene, source, chain.name))
                                    for chain in chains))
        if frames and scene != STILL:
            found[scene] = sorted(frames)
    return found


def times(results):
    """{chain: mean over scenes of its time as a ratio}."""
    chains = results.times[0]["ratios"] if results.times else {}
    return {name: intervals.mean([one["ratios"][name] for one in results.times])
            for name in chains}


def errors_table(results, source, chains, names):
    ratios = times(results)
    rows = heading(["chain"] + [metric.label for metric in METRICS] + ["time"] * bool(ratios))
    for chain in chains:
        cells = [mean_errors(results, chain.name, source, metric, names) for metric in METRICS]
        time = f"{ratios[chain.name]:.2g}" if chain.name in ratios else ""
        rows.append(line([chain.label] + ["" if cell is None else number(cell, metric.digits)
                                          for cell, metric in zip(cells, METRICS)]
                         + [time] * bool(ratios)))
    return rows


def gains_table(results, questions, scenes=None):
    rows, group = [], None
    for question in questions:
        found = [gain(results, question, metric, scenes) for metric in METRICS]
        if not found[0]:
            continue
        if question.group != group:
            group = question.group
            rows += ["", f"**{group}**", ""]
            rows += heading(["gain of it"] + [metric.label + (f", {metric.unit}" if metric.unit
                                                              else "") for metric in METRICS])
        cells = [f"{signed(one.mean, metric.digits)}{between(one.interval, metric.digits)}, "
                 f"{one.positive}/{one.counted}" if one else ""
                 for one, metric in zip(found, METRICS)]
        rows.append(line([question.text] + cells))
    return rows


def scenes_table(results, questions, metric):
    found = [gain(results, question, metric) for question in questions]
    found = [{one.scene: one for one in one_gain.scenes} if one_gain else {} for one_gain in found]
    rows = heading([metric.label] + [question.text for question in questions])
    for scene in results.scenes():
        gains = [of_scene.get(scene) for of_scene in found]
        if any(gains):
            n = max(one.n for one in gains if one)
            rows.append(line([f"{title(scene)} ({n})"] + [
                signed(one.mean, metric.digits) + between(one.interval, metric.digits)
                if one else "" for one in gains]))
    return rows


def sizes_table(results):
    """The scenes by the ratio of their blurs."""
    arguments = {name: f"`{words}`" for name, _, words in GENERATED}
    found = [gains_by_size(results, TURNS, metric) for metric in METRICS[:2]]
    rows = heading(["scene", "made by", "mean streak px", "mean circle px", "ratio"]
                   + [f"gain, {metric.label}" for metric in METRICS[:2]])
    for (ratio, sizes, flip), (_, _, psnr) in zip(*found):
        rows.append(line([title(flip.scene), arguments.get(flip.scene, "Cycles"),
                          f"{sizes['streak_px']:.1f}", f"{sizes['circle_px']:.1f}",
                          f"{ratio:.2f}", signed(flip.mean, METRICS[0].digits),
                          signed(psnr.mean, METRICS[1].digits)]))
    correlations = [intervals.rank_correlation([ratio for ratio, _, _ in one],
                                               [scene.mean for _, _, scene in one])
                    for one in found]
    return rows + ["", f"Rank correlation (Spearman) of ratio and gain, {len(found[0])} scenes: "
                   f"{number(correlations[0], 2)} for HDR-FLIP, {number(correlations[1], 2)} for "
                   "PSNR."]


def claims_table(results):
    rows = []
    for pair in CLAIMS:
        found = [one for one in results.claims if one["chains"] == list(pair)]
        if not found:
            continue
        rows += ["", f"{LABELS[pair[0]]} / {LABELS[pair[1]]}:", ""]
        rows += heading(["scene", "edges in blurred", "sharpness in focus", "flicker", "grid"])
        for one in found:
            cells = [" / ".join("" if value is None else f"{value:.{digits}f}"
                                for value in one["values"][key])
                     for key, digits in (("edges_in_blurred", 2), ("sharpness_in_focus", 2),
                                         ("flicker", 4), ("grid", 4))]
            rows.append(line([title(one["scene"])] + cells))
    return rows


def counts(names):
    families = len({family(scene) for scene in names})
    return f"{families} families, {len(names)} scenes, {sum(map(len, names.values()))} frames"


def text(results):
    of = {where: [chain for chain in CHAINS if chain.where == where] for where in (ALL, FEW, GBUF)}
    rows = ["## Errors of every chain", "",
            "Means over families. "
            + (f"Time: processor seconds of a frame, as a ratio to {LABELS[TIMED[0]]}." if results.times else "")]
    for words, source, chains in (("`sharp`", "sharp", of[ALL]),
                                  (f"`sharp`, the first {FEW_FRAMES} frames", "sharp",
                                   of[ALL] + of[FEW]),
                                  (f"`gbuf`, one sample a pixel, the first {FEW_FRAMES} frames",
                                   "gbuf", of[GBUF])):
        names = common_frames(results, source, chains)
        if names:
            rows += ["", f"{words} ({counts(names)}):", ""]
            rows += errors_table(results, source, chains, names)
    rows += ["", "## Gains with intervals", "",
             "Mean over families (95 % t interval over families), families nearer to the truth / "
             "families that differ. Positive is nearer to the truth in every metric."]
    rows += gains_table(results, QUESTIONS)
    main_questions = [one for one in QUESTIONS if one.group in (ORDER, JOINT)]
    traced = [scene for scene in results.scenes() if not scene.startswith("generated")]
    if traced:
        rows += ["", f"The {len(traced)} path-traced scenes alone:"]
        rows += gains_table(results, main_questions, traced)
    rows += ["", "## Gains of each scene", "",
             f"In brackets behind a scene its frames. Intervals: 95 % t over batches of "
             f"{BATCH_FRAMES} frames; below {FEWEST_BATCHES * BATCH_FRAMES} frames over single ones, "
             "which are alike, so that these are too narrow."]
    found = neighbor_correlation(results, main_questions[-3], METRICS[0])
    for group in (ORDER, JOINT):
        questions = [one for one in main_questions if one.group == group]
        for metric in METRICS[:2]:
            rows += ["", f"**{group}**", ""] + scenes_table(results, questions, metric)
    if found is not None:
        rows += ["", "Correlation of the gain in one frame with that in the next, mean of the "
                 f"scenes with 8 frames and more: {number(found, 2)}."]
    if results.sizes:
        rows += ["", "## Scenes", "",
                 "By mean length of the streaks (shutter times speed) over mean diameter of the "
                 f"circles of confusion, in `sharp`. Gain: {TURNS.group.lower()}, {TURNS.text}.", ""]
        rows += sizes_table(results)
    if results.claims:
        rows += ["", "## Edges, sharpness, flicker, grid", "",
                 f"By `postchain ab`, the first {FEW_FRAMES} frames of one scene of each family; "
                 "best at 1 for the first two ([metrics](../metrics.md)), at 0 for the others."]
        rows += claims_table(results)
    return "\n".join(rows) + "\n"


def write(results, path):
    """Replaces what stands below BEGIN."""
    before = path.read_text().split(BEGIN)[0]
    path.write_text(before + BEGIN + "\n\n" + text(results))
