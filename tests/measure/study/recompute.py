#!/usr/bin/env python3
"""Recomputes the report of a study from the figures of its frames or scenes.

    tests/measure/study/recompute.py STUDY            the study's folder: from tasks/*.json
    tests/measure/study/recompute.py report.json      from the gains of its scenes
    tests/measure/study/recompute.py STUDY --table    Markdown tables of the questions, the chains, and the
                                              scenes by HDR-FLIP, for docs/studies/tables.md

It shares no code with postchain: Student's t comes from the finite sums of Abramowitz and Stegun 26.7.3
and 26.7.4, quantiles from bisection. Prints each question by HDR-FLIP, and on stderr every figure that
differs from the report's: then the exit code is 1.
"""
import argparse
import json
import math
import pathlib
import sys

LEVEL = 0.05


def t_between(t, degrees):
    """Probability of -t .. t."""
    angle = math.atan(t / math.sqrt(degrees))
    cosine, term, total = math.cos(angle), 1.0, 0.0
    if degrees % 2:
        term = cosine
        for k in range(3, degrees + 1, 2):
            total += term
            term *= cosine * cosine * (k - 1) / k
        return 2 / math.pi * (angle + math.sin(angle) * total)
    for k in range(2, degrees + 1, 2):
        total += term
        term *= cosine * cosine * (k - 1) / k
    return math.sin(angle) * total


def above(t, degrees):
    """Probability of a value above t."""
    inside = t_between(abs(t), degrees)
    return (1 - inside) / 2 if t >= 0 else (1 + inside) / 2


def t_of(inside, degrees):
    low, high = 0.0, 1e6
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if t_between(middle, degrees) < inside else (low, middle)
    return (low + high) / 2


def tail(distance, error, degrees):
    if error == 0:
        return 0.0 if distance > 0 else 1.0 if distance < 0 else 0.5
    return above(distance / error, degrees)


def holm(probabilities):
    """None stays None and does not count."""
    known = sorted((p, i) for i, p in enumerate(probabilities) if p is not None)
    corrected, largest = [None] * len(probabilities), 0.0
    for rank, (p, i) in enumerate(known):
        largest = max(largest, min(1.0, (len(known) - rank) * p))
        corrected[i] = largest
    return corrected


def mean(values):
    values = [v for v in values if v is not None]
    return math.fsum(values) / len(values) if values else None


def gain_of(better, a, b):
    if better == "higher":
        return b - a
    return abs(a - 1) - abs(b - 1) if better == "one" else a - b


def gains_of_tasks(folder, report):
    """{metric: {scene: gain of each pair}} from the figures of the frames."""
    gains = {table["metric"]: {} for table in report["tables"]}
    for path in sorted((folder / "tasks").glob("*.json")):
        task = json.loads(path.read_text(encoding="utf8"))
        scene = path.name.split(".")[0]
        figures = {one["name"]: one["metrics"] for one in task["variants"]}
        for table in report["tables"]:
            row = gains[table["metric"]].setdefault(scene, [None] * len(report["pairs"]))
            for p, pair in enumerate(report["pairs"]):
                if pair["a"] not in figures or pair["b"] not in figures:
                    continue
                if len(figures) == 2 and path.name != f"{scene}.{pair['a']}_vs_{pair['b']}.json" and \
                        report["kind"] == "ab":
                    continue
                a, b = (figures[pair[side]].get(table["metric"], []) for side in "ab")
                row[p] = mean([gain_of(table["better"], x, y) for x, y in zip(a, b)
                               if x is not None and y is not None])
    return gains


def results(table, gains):
    """The report's entries of each pair, from {scene: gains}."""
    families = {}
    for scene in table["scenes"]:
        families.setdefault(scene["family"], []).append(gains[scene["name"]])
    found = []
    for p in range(len(table["pairs"])):
        values = [mean([row[p] for row in rows]) for rows in families.values()]
        values = [v for v in values if v is not None]
        n, margin = len(values), table["pairs"][p]["margin"]
        one = {"gain": mean(values), "families": n, "interval": None, "probability": None,
               "probability_beyond_margin": None,
               "families_nearer": sum(v > 0 for v in values),
               "families_farther": sum(v < 0 for v in values)}
        if n > 1:
            error = math.sqrt(math.fsum((v - one["gain"]) ** 2 for v in values) / (n - 1) / n)
            half = t_of(1 - LEVEL, n - 1) * error
            one["interval"] = [one["gain"] - half, one["gain"] + half]
            one["probability"] = min(1.0, 2 * tail(abs(one["gain"]), error, n - 1))
            if margin is not None:
                one["probability_beyond_margin"] = tail(margin - abs(one["gain"]), error, n - 1)
        found.append(one)
    for key in ("probability", "probability_beyond_margin"):
        for one, corrected in zip(found, holm([one[key] for one in found])):
            one[key + "_holm"] = corrected
    for one in found:
        p, beyond = one["probability_holm"], one["probability_beyond_margin_holm"]
        if p is None:
            one["finding"] = "too_few_families"
        elif p < LEVEL:
            one["finding"] = "b_nearer" if one["gain"] > 0 else "a_nearer"
        else:
            one["finding"] = "equal" if beyond is not None and beyond < LEVEL else "not_decided"
    return found


def same(a, b):
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, float) or isinstance(b, float):
        return None not in (a, b) and math.isclose(a, b, rel_tol=1e-6, abs_tol=1e-9)
    return a == b


TABLE = [("hdr_flip", "HDR-FLIP", 4), ("psnr", "PSNR, dB", 2), ("ssim", "SSIM", 4)]
WORDS = {"too_few_families": "too few families", "not_decided": "not decided", "a_nearer": "**farther**",
         "b_nearer": "**closer**"}


def short(value, digits):
    """+.0123, \u2212.0040"""
    sign = "\u2212" if value < 0 else "+"
    return sign + f"{abs(value):.{digits}f}".removeprefix("0")


def probability(p):
    return "below .001" if p < 0.001 else f"{p:.2g}".removeprefix("0")


def cell(found, margin, digits):
    text = short(found["gain"], digits)
    if found["interval"]:
        text += " ({} to {})".format(*(short(end, digits) for end in found["interval"]))
    text += f", {found['families_nearer']}/{found['families']}: "
    if found["finding"] == "equal":
        return f"{text}no difference beyond {margin} ({probability(found['probability_beyond_margin_holm'])})"
    p = found["probability_holm"]
    return text + WORDS[found["finding"]] + (f" ({probability(p)})" if p is not None else "")


def condition(pair):
    if pair["equal"] == "time":
        return f"{pair['time_ratio']:.2f} of the time" if pair["time_ratio"] else "equal time, not measured"
    return f"equal {pair['equal']}" if pair["equal"] else ""


def print_table(report, found):
    """found: {metric: results}."""
    scenes = [scene for scene in report["scenes"] if not scene["failure"]]
    families = {scene["family"] for scene in scenes}
    print(f"postchain {report['version']}, commit {', '.join(report['revisions'])}; {len(scenes)} scenes in "
          f"{len(families)} families. Gain of the first named, mean over families (95 %), families in which "
          "it is closer to ground truth: finding (probability, corrected by Holm).\n")
    columns = [(metric, name, digits) for metric, name, digits in TABLE if metric in found]
    print("| question | condition | " + " | ".join(name for _, name, _ in columns) + " |")
    print("|---" * (2 + len(columns)) + "|")
    margins = {table["metric"]: [pair["margin"] for pair in table["pairs"]] for table in report["tables"]}
    for p, pair in enumerate(report["pairs"]):
        cells = [cell(found[metric][p], margins[metric][p], digits)
                 if found[metric][p]["gain"] is not None else "" for metric, _, digits in columns]
        print(f"| `{pair['b']}` against `{pair['a']}` | {condition(pair)} | " + " | ".join(cells) + " |")


def print_chains(report):
    """Errors of each chain: means over families."""
    tables = [(table, name, digits) for metric, name, digits in TABLE
              for table in report["tables"] if table["metric"] == metric]
    print("\n| chain | " + " | ".join(name for _, name, _ in tables) + " |")
    print("|---" * (1 + len(tables)) + "|")
    for i, chain in enumerate(report["variants"]):
        cells = []
        for table, _, digits in tables:
            families = {}
            for scene in table["scenes"]:
                families.setdefault(scene["family"], []).append(scene["means"][i])
            cells.append(f"{mean(map(mean, families.values())):.{digits}f}".removeprefix("0"))
        print(f"| `{chain['name']}` | " + " | ".join(cells) + " |")


def print_scenes(report, gains):
    """gains: {scene: gain of each pair} by HDR-FLIP."""
    print("\n| scene | family | " + " | ".join(f"`{pair['b']}` against `{pair['a']}`"
                                             for pair in report["pairs"]) + " |")
    print("|---" * (2 + len(report["pairs"])) + "|")
    for scene in report["scenes"]:
        if scene["name"] in gains:
            cells = ["" if gain is None else short(gain, 4) for gain in gains[scene["name"]]]
            print(f"| {scene['name']} | {scene['family']} | " + " | ".join(cells) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=pathlib.Path)
    parser.add_argument("--table", action="store_true")
    options = parser.parse_args()
    path = options.study
    report = json.loads((path / "report.json" if path.is_dir() else path).read_text(encoding="utf8"))
    of_tasks = gains_of_tasks(path, report) if path.is_dir() else None
    differences = checked = 0
    found, by_scene = {}, {}
    for table in report["tables"]:
        gains = of_tasks[table["metric"]] if of_tasks else \
            {scene["name"]: scene["gains"] for scene in table["scenes"]}
        found[table["metric"]], by_scene[table["metric"]] = results(table, gains), gains
        for stated, one in zip(table["pairs"], found[table["metric"]]):
            for key, value in one.items():
                checked += 1
                if not same(stated[key], value):
                    differences += 1
                    print(f"{table['metric']}, {stated['b']} against {stated['a']}: {key} is "
                          f"{stated[key]} in the report, {value} recomputed", file=sys.stderr)
    if options.table:
        print_table(report, found)
        print_chains(report)
        print_scenes(report, by_scene.get("hdr_flip", {}))
    else:
        margin = next((table["pairs"][0]["margin"] for table in report["tables"]
                       if table["metric"] == "hdr_flip"), None)
        for pair, one in zip(report["pairs"], found.get("hdr_flip", [])):
            if one["gain"] is not None:
                print(f"{pair['b']} against {pair['a']}: {cell(one, margin, 4)}")
        print(f"{checked} figures recomputed, {differences} differ")
    return 1 if differences or not checked else 0


if __name__ == "__main__":
    sys.exit(main())
