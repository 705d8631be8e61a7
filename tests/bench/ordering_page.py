"""docs/results/ordering.html: the answer of the ordering study in one look; one file, no script."""
import base64
import html
import math

from ordering_gains import decided, gain, gains_by_size, mean_errors
from ordering_study import (ALL, CHAINS, GBUF, JOINT, LABELS, METRICS, ORDER, QUESTIONS, STRIPS,
                            TIMED, TURNS)
from ordering_tables import common_frames, counts, number, signed, times, title

STYLE = """
:root { color-scheme: light dark; --back: #fcfcfb; --card: #fff; --ink: #1d1d1b; --quiet: #63625d;
  --line: #d9d7d0; --first: #c2570c; --second: #1668b8; --none: #7b7a74; }
@media (prefers-color-scheme: dark) { :root { --back: #1a1a19; --card: #242422; --ink: #efeee9;
  --quiet: #a9a79f; --line: #45443f; --first: #f0893e; --second: #5ca8f0; --none: #98968e; } }
body { background: var(--back); color: var(--ink); font: 15px/1.45 system-ui, sans-serif;
  margin: 0 auto; max-width: 1240px; padding: 20px; }
h1 { font-size: 25px; margin: 0 0 4px; } h2 { font-size: 18px; margin: 34px 0 6px; }
p { margin: 4px 0; max-width: 980px; } .quiet { color: var(--quiet); }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(180px, 1fr)); gap: 12px;
  margin: 16px 0; }
.card { background: var(--card); border: 1px solid var(--line); border-radius: 8px;
  padding: 12px 14px; }
.card { font-size: 14px; } .card b { display: block; font-size: 19px; margin: 3px 0; }
.first { color: var(--first); } .second { color: var(--second); } .none { color: var(--none); }
.wide { overflow-x: auto; } svg { display: block; font: 13px system-ui, sans-serif; }
svg text { fill: var(--ink); } svg .quiet { fill: var(--quiet); font-size: 12px; }
svg .zero { stroke: var(--quiet); } svg .rule { stroke: var(--line); }
svg .first { fill: var(--first); stroke: var(--first); }
svg .second { fill: var(--second); stroke: var(--second); }
svg .none { fill: var(--none); stroke: var(--none); }
svg line.mark { stroke-width: 1.5; } svg .strong { font-weight: 600; }
.pick input { position: absolute; opacity: 0; }
.pick label { border: 1px solid var(--line); border-radius: 6px; cursor: pointer;
  display: inline-block; margin: 4px 4px 10px 0; padding: 3px 11px; }
.pick input:checked + label { background: var(--ink); color: var(--back); }
.pick input:focus-visible + label { outline: 2px solid var(--second); }
.pane { display: none; } figure { margin: 14px 0; } img { max-width: 100%; }
"""
PANES = "".join(f"#pick{k}:checked ~ #pane{k} {{ display: block; }}\n" for k in range(len(METRICS)))


def side(value, clear=True):
    """The color of a gain: of the second chain, of the first, or of neither."""
    if value == 0 or not clear:
        return "none"
    return "second" if value > 0 else "first"


def words(question):
    """What is nearer when the gain is negative, and when it is positive."""
    return ("motion first", "lens first") if question.group == ORDER else ("lens first", "jointly")


def text(x, y, what, kind="", anchor="start"):
    return (f'<text x="{x:.1f}" y="{y:.1f}" class="{kind}" text-anchor="{anchor}">'
            f"{html.escape(what)}</text>")


def stroke(x1, y1, x2, y2, kind):
    return f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" class="{kind}"/>'


def svg(width, height, label, parts):
    return (f'<div class="wide"><svg xmlns="http://www.w3.org/2000/svg" width="{width}" '
            f'height="{height}" viewBox="0 0 {width} {height}" role="img" '
            f'aria-label="{html.escape(label)}">{"".join(parts)}</svg></div>')


class Scale:
    """Gains to x; what is beyond is drawn at the end."""

    def __init__(self, left, width, values):
        largest = max([abs(value) for value in values] + [1e-9]) * 1.1
        self.left, self.right = left, left + width
        self.middle, self.unit, self.largest = left + width / 2, width / 2 / largest, largest

    def x(self, value):
        return min(max(self.middle + value * self.unit, self.left), self.right)


def mark(scale, y, mean, interval, tip, clear=True, diamond=False):
    """A dot or a diamond with its interval."""
    kind, x = side(mean, clear), scale.x(mean)
    parts = [f"<g><title>{html.escape(tip)}</title>"]
    if interval:
        parts.append(stroke(scale.x(interval[0]), y, scale.x(interval[1]), y, f"{kind} mark"))
    if diamond:
        parts.append(f'<path d="M{x - 8:.1f} {y} L{x:.1f} {y - 6} L{x + 8:.1f} {y} L{x:.1f} '
                     f'{y + 6} Z" class="{kind}"/>')
    else:
        parts.append(f'<circle cx="{x:.1f}" cy="{y}" r="4" class="{kind}"/>')
    return "".join(parts) + "</g>"


def tip_of(name, mean, interval, metric):
    found = f"{name}: {signed(mean, metric.digits)} {metric.unit}".strip()
    if interval:
        found += f" ({signed(interval[0], metric.digits)} to {signed(interval[1], metric.digits)})"
    return found


def forest(results, questions, metric):
    """A column for each question, a row for each scene, the mean over families below."""
    found = [(question, gain(results, question, metric)) for question in questions]
    found = [(question, one) for question, one in found if one]
    names = [scene for scene in results.scenes()
             if any(one.scene == scene for _, found_one in found for one in found_one.scenes)]
    left, row, top = 192, 20, 62
    column = min(125, 980 // max(len(found), 1))
    bottom = top + row * len(names)
    width, height = left + column * len(found) + 10, bottom + 86
    means = [one.mean for _, all_of in found for one in all_of.scenes]
    parts, group = [], None
    for k, name in enumerate(names):
        parts.append(text(left - 12, top + row * k + 14, title(name), anchor="end"))
    parts.append(text(left - 12, bottom + 26, "mean of the families", "strong", "end"))
    parts.append(text(left - 12, bottom + 50, "families nearer", "quiet", "end"))
    for k, (question, one) in enumerate(found):
        start = left + column * k
        scale = Scale(start + 6, column - 12, means)
        if question.group != group:
            group = question.group
            parts.append(text(start + 6, 16, group, "strong"))
            parts.append(stroke(start, 4, start, bottom + 56, "rule"))
        parts += [text(start + 6, 34 + 15 * i, part, "quiet") for i, part in
                  enumerate(question.text.split(", "))]
        parts.append(stroke(scale.middle, top, scale.middle, bottom + 36, "zero"))
        for scene in one.scenes:
            y = top + row * names.index(scene.scene) + 10
            # Of two or three frames an interval says nothing.
            shown = scene.interval if scene.n > 3 else None
            parts.append(mark(scale, y, scene.mean, shown,
                              tip_of(title(scene.scene), scene.mean, shown, metric)))
        parts.append(mark(scale, bottom + 22, one.mean, one.interval,
                          tip_of("mean of the families", one.mean, one.interval, metric),
                          decided(one), True))
        parts.append(text(scale.middle, bottom + 50, f"{one.positive} of {one.counted}", "quiet",
                          "middle"))
        parts += [text(start + 6, bottom + 68, "← " + words(question)[0], "quiet"),
                  text(start + column - 6, bottom + 80, words(question)[1] + " →", "quiet", "end")]
    parts.append(stroke(left, bottom + 4, width - 10, bottom + 4, "rule"))
    return svg(width, height, f"Gains of each scene, {metric.label}", parts)


def overview(results, questions):
    """A row for each question, HDR-FLIP and PSNR beside each other, means over families."""
    shown = [(question, [gain(results, question, metric) for metric in METRICS[:2]])
             for question in questions]
    shown = [(question, found) for question, found in shown if all(found)]
    if not shown:
        return ""
    left, column, row, top = 330, 330, 22, 30
    parts, y, group = [], top, None
    scales = [Scale(left + column * k + 80, column - 110,
                    [end for _, found in shown for end in found[k].interval or [found[k].mean]])
              for k in range(2)]
    for k, metric in enumerate(METRICS[:2]):
        parts.append(text(scales[k].middle, 14, metric.label, "strong", "middle"))
    for question, found in shown:
        if question.group != group:
            group = question.group
            parts.append(text(0, y + 16, group.replace("`", ""), "strong"))
            y += row
        parts.append(text(left - 12, y + 15, question.text.replace("`", ""), anchor="end"))
        for scale, one, metric in zip(scales, found, METRICS):
            parts.append(mark(scale, y + 11, one.mean, one.interval,
                              tip_of(question.text, one.mean, one.interval, metric), decided(one),
                              True))
            parts.append(text(scale.left - 10, y + 15, signed(one.mean, metric.digits), "quiet",
                              "end"))
        y += row
    for scale in scales:
        parts.insert(0, stroke(scale.middle, top - 6, scale.middle, y, "zero"))
    return svg(left + 2 * column, y + 8, "Gains of what else can be chosen", parts)


def against_time(results):
    """Mean HDR-FLIP of the inverse warp's chains against their time, both logarithmic."""
    ratios = times(results)
    if not ratios:
        return ""
    names = common_frames(results, "sharp", [one for one in CHAINS if one.name in ratios
                                             and one.where != GBUF])
    points = [(ratio, mean_errors(results, name, "sharp", METRICS[0], names), name)
              for name, ratio in ratios.items() if not name.startswith("report")]
    left, right, top, bottom = 60, 780, 30, 290

    def place(value, values, low, high):
        first, last = math.log(min(values)), math.log(max(values))
        return low + (math.log(value) - first) / (last - first) * (high - low)

    parts = [stroke(left, bottom + 20, right + 40, bottom + 20, "zero"),
             text(right + 40, bottom + 52, f"processor seconds of a frame, {LABELS[TIMED[0]]} = 1",
                  "quiet", "end"), text(0, 16, "HDR-FLIP", "strong")]
    for ratio, error, name in points:
        x = place(ratio, [one for one, _, _ in points], left, right)
        y = place(error, [one for _, one, _ in points], bottom, top)
        kind = "none" if "joint" in name else "second" if "dof mb" in name else "first"
        near_end = x > right - 200
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" class="{kind}"/>',
                  text(x + (-9 if near_end else 9), y + 4,
                       f"{LABELS[name]} ({number(error, 4)}, {ratio:.2g})", "quiet",
                       "end" if near_end else "start")]
    for tick in (0.5, 1, 2, 4):
        if min(ratios[name] for _, _, name in points) <= tick <= max(ratios.values()):
            parts.append(text(place(tick, [one for one, _, _ in points], left, right), bottom + 37,
                              f"{tick:g}", "quiet", "middle"))
    return ("<h2>Error against time</h2><p>The inverse warp; in brackets HDR-FLIP and time.</p>"
            + svg(860, bottom + 60, "HDR-FLIP against time", parts))


def turning(results):
    """The gain against the ratio of the blurs, HDR-FLIP and PSNR beside each other."""
    parts, column, height = [], 470, 300
    for k, metric in enumerate(METRICS[:2]):
        points = gains_by_size(results, TURNS, metric)
        if not points:
            return ""
        left, top, bottom = 60 + column * k, 30, height - 44
        largest = max(abs(scene.mean) for _, _, scene in points) * 1.15
        ends = math.log2(points[0][0]) - 0.3, math.log2(points[-1][0]) + 0.3
        middle, half = (top + bottom) / 2, (bottom - top) / 2

        def across(ratio, left=left, ends=ends):
            return left + (math.log2(ratio) - ends[0]) / (ends[1] - ends[0]) * (column - 100)

        parts += [text(left, 16, f"{metric.label} {metric.unit}", "strong"),
                  stroke(left, middle, left + column - 100, middle, "zero"),
                  text(left - 4, top + 6, "lens", "quiet", "end"),
                  text(left - 4, top + 20, "first", "quiet", "end"),
                  text(left - 4, bottom - 10, "motion", "quiet", "end"),
                  text(left - 4, bottom + 4, "first", "quiet", "end"),
                  text(left + column - 100, height - 6, "mean streak / mean circle", "quiet", "end")]
        for tick in (0.25, 0.5, 1, 2):
            parts += [stroke(across(tick), top, across(tick), bottom, "rule"),
                      text(across(tick), bottom + 18, f"{tick:g}", "quiet", "middle")]
        for ratio, _, scene in points:
            tip = tip_of(title(scene.scene), scene.mean, None, metric)
            parts.append(f"<g><title>{html.escape(tip)}</title><circle cx=\"{across(ratio):.1f}\" "
                         f"cy=\"{middle - scene.mean / largest * half:.1f}\" r=\"5\" "
                         f"class=\"{side(scene.mean)}\"/></g>")
    return ("<h2>When it turns around</h2><p>Lens first against motion first, with neighbors, by how "
            "long the streaks are beside the circles of confusion; a dot is a scene.</p>"
            + svg(2 * column, height, "Gain against the ratio of the blurs", parts))


def verdict(question, found):
    """In words, and the sign of what is nearer: of the metrics whose intervals do not contain 0."""
    signs = {one.mean > 0 for one in found if decided(one)}
    if len(signs) == 1:
        nearer = signs.pop()
        return words(question)[nearer] + " is nearer", 1 if nearer else -1
    return ("metrics disagree", 0) if signs else ("not decided", 0)


def card(results, question):
    """The answer to one question in words and numbers."""
    found = [gain(results, question, metric) for metric in METRICS[:3]]
    if not all(found) or not found[0].interval:
        return ""
    answer, sign = verdict(question, found)
    lines = [f"{metric.label} {signed(one.mean, metric.digits)} {metric.unit}".strip()
             + f", {one.positive} of {one.counted}<br><span class=\"quiet\">"
             f"{signed(one.interval[0], metric.digits)} to "
             f"{signed(one.interval[1], metric.digits)}</span>"
             for one, metric in zip(found, METRICS)]
    return (f'<div class="card"><span class="quiet">{html.escape(question.group)}</span><br>'
            f'{html.escape(question.text)}<b class="{side(sign)}">{answer}</b>'
            + "<br>".join(lines) + "</div>")


def write(results, path, images):
    main = [one for one in QUESTIONS if one.group in (ORDER, JOINT)]
    others = [one for one in QUESTIONS if one.group not in (ORDER, JOINT)]
    names = common_frames(results, "sharp", [one for one in CHAINS if one.where == ALL])
    parts = [
        "<!doctype html>", '<html lang="en"><head><meta charset="utf-8">',
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; '
        'style-src \'unsafe-inline\'; img-src data:">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>Which order to blur in</title><style>{STYLE}{PANES}</style></head><body>",
        "<h1>Which order to blur in</h1>",
        f"<p>Motion blur first, depth of field (lens) first, or both in one gather: what is nearer "
        f"to ground truth of shutter and lens. {counts(names)}. Made by <code>tests/bench/ordering.py "
        "page</code>; how, and what does not hold, is in docs/ordering.md.</p>",
        '<div class="cards">', *[card(results, question) for question in main if question.card],
        "</div>",
        "<h2>Each scene</h2>",
        "<p>Gain of the second over the first: right of the line the second is nearer. Dots: mean "
        "over a scene's frames, lines its 95 % interval (four frames and more). Diamonds: mean over "
        "families with the 95 % interval that decides; gray where it contains 0.</p>",
        '<div class="pick">']
    for k, metric in enumerate(METRICS):
        checked = " checked" if k == 0 else ""
        parts.append(f'<input type="radio" name="metric" id="pick{k}"{checked}>'
                     f'<label for="pick{k}">{metric.label}</label>')
    for k, metric in enumerate(METRICS):
        parts.append(f'<div class="pane" id="pane{k}">{forest(results, main, metric)}</div>')
    parts += ["</div>", "<h2>What else can be chosen</h2>",
              "<p>Gain over the same chain without it, mean over families with the 95 % "
              "interval.</p>", overview(results, others), turning(results), against_time(results)]
    for name, (scene, frame, _, _, chains) in STRIPS.items():
        picture = images / f"ordering-{name}.jpg"
        if picture.exists():
            data = base64.b64encode(picture.read_bytes()).decode()
            shown = ", ".join(["ground truth"] + [LABELS[chain] for chain in chains])
            parts.append(f"<h2>{title(scene)}, frame {frame}</h2><figure><figcaption>{shown}"
                         f'</figcaption><img alt="{shown}" src="data:image/jpeg;base64,{data}">'
                         "</figure>")
    path.write_text("\n".join(parts) + "\n</body></html>\n")
