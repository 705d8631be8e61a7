// A against B: the table of ab.
import { h } from "../shared/dom.js";
import { head, interval_marks, scroll } from "../shared/tables.js";
import { number, signed, way_of } from "../shared/words.js";
import { metric_name } from "./model.js";
import { kRelMse, kWorse, mean_cell, panel } from "./panel.js";

// The two intervals of ab; report.md says the same (report_text.cpp).
const explain_intervals = (bootstrap) => h("details", { class: "explain", open: true },
    h("summary", {}, "How to read the intervals"),
    h("p", {}, h("b", {}, "t-interval, over frames: "), "how far the mean of these frames may be ",
        "from the mean over many frames of this kind. The more the frames disagree and the fewer ",
        "they are, the wider it is. An interval that contains 0 leaves open which of the two is ",
        "better; of 20 metrics without any difference one lies outside by chance."),
    h("p", {}, h("b", {}, "tile interval (bootstrap), within these frames: "), "each frame is ",
        `cut into tiles${bootstrap ? ` of ${bootstrap.tile_px} pixels` : ""}, and tiles are drawn `,
        "again and again at random, some of them twice and some not at all. An interval on one ",
        "side of 0 says that the difference does not come from a few places of these frames; it ",
        "says nothing about other frames."));

// Difference and interval as a dot and a line, in parts of A's mean. All rows have one axis; a
// value beyond its end is an arrow.
function whisker(entry, base, reach) {
    const [width, height] = [170, 18];
    const end = width / 2 - 6;
    const clear = entry.finding === "a_better" || entry.finding === "b_better";
    const ink = clear ? "var(--accent)" : "var(--quiet)";
    return h("svg", { class: "whisker", viewBox: `0 0 ${width} ${height}`, "aria-hidden": "true" },
        h("line", { x1: width / 2, x2: width / 2, y1: 0, y2: height, stroke: "var(--gray)" }),
        interval_marks({ mean: entry.mean, interval: entry.t_interval, middle: width / 2,
            unit: end / base / reach, end, y: height / 2, radius: 4, ink }));
}

const kFindings = {
    too_few_frames: "too few frames", no_measurable_difference: "no measurable difference",
    a_better: "A is better", b_better: "B is better",
};
// Rows without a finding are folded. If no metric has a finding, because there are too few frames,
// only rows of equal values are folded.
function folds_of(entries) {
    const few = entries.every((m) => m.finding === "too_few_frames" ||
        m.finding === "no_measurable_difference");
    const kinds = [
        ["without a measurable difference", (m) => m.n > 0 &&
            (m.finding === "no_measurable_difference" ||
                (few && m.differences.every((d) => d === null || d === 0)))],
        ["with too few frames to decide", (m) => m.n > 0 && !few && m.finding === "too_few_frames"],
        ["without a value of both", (m) => m.n === 0],
    ];
    return kinds.map(([what, is]) => ({ what, is, count: entries.filter(is).length }))
        .filter(({ count }) => count);
}

export function add_comparison({ model }, more) {
    const comparison = model.comparison;
    if (!comparison?.metrics.length) return;
    const [a, b] = model.variants;
    const bases = comparison.metrics.map((m) => {
        const base = m.differences?.length ? Math.abs(a.metrics?.[m.metric]?.mean ?? NaN) : NaN;
        return base > 0 ? base : undefined;
    });
    const spans = comparison.metrics.flatMap((m, i) => (bases[i] && Number.isFinite(m.mean)
        ? [m.mean, ...(m.t_interval ?? [])].filter(Number.isFinite)
            .map((v) => Math.abs(v) / bases[i]) : []));
    // Wide enough for nine of ten; the rest become arrows.
    spans.sort((x, y) => x - y);
    const reach = spans[Math.floor(0.9 * (spans.length - 1))] || 1;
    const interval = (v) => (v ? v.map(signed).join(" \u2026 ") : "\u2013");
    const input = model.source("input")?.data;
    const row = (m) => {
        const i = comparison.metrics.indexOf(m);
        return h("tr", {},
            h("th", { scope: "row", title: model.metric(m.metric)?.help }, metric_name(m.metric),
                h("small", {}, way_of(model.metric(m.metric), model.reference_kind))),
            mean_cell(model, a, m.metric), mean_cell(model, b, m.metric),
            input && h("td", { class: "num" }, number(model.mean(input, m.metric))),
            h("td", { class: "num" }, Number.isFinite(m.mean) ? signed(m.mean) : "\u2013"),
            h("td", { class: "words" }, h("details", {},
                h("summary", {}, kFindings[m.finding] ?? m.finding), m.words)),
            h("td", {}, bases[i] && Number.isFinite(m.mean) ? whisker(m, bases[i], reach) : ""),
            h("td", { class: "num" }, interval(m.t_interval)),
            h("td", { class: "num" }, interval(m.bootstrap)),
            h("td", { class: "num" }, String(m.n)));
    };
    const folds = folds_of(comparison.metrics);
    const bodies = [h("tbody", {}, comparison.metrics.filter((m) => !folds.some(({ is }) => is(m)))
        .map(row))];
    for (const { what, is, count } of folds) {
        const hidden = h("tbody", { hidden: true }, comparison.metrics.filter(is).map(row));
        const fold = h("details", { ontoggle: () => (hidden.hidden = !fold.open) },
            h("summary", {}, `${count} metric${count === 1 ? "" : "s"} ${what}`));
        bodies.push(h("tbody", { class: "fold" }, h("tr", {},
            h("td", { colspan: input ? 10 : 9 }, fold))), hidden);
    }
    const table = h("table", { class: "compare" },
        head(["Metric"], ["A", "num"], ["B", "num"], ...(input ? [["Input", "num", "unfiltered"]]
            : []), ["B \u2212 A", "num"], ["Finding"], ["relative to A"],
        ["t-interval", "num", undefined, "over frames"],
        ["tile interval", "num", undefined, "within frames"], ["n", "num", "frames"]), bodies);
    more.append(panel("A against B",
        `A: ${a.name}. B: ${b.name}. Differences are B \u2212 A (for metrics that are best at 1, ` +
        "how much further from 1), with 95 % intervals. " +
        `The axis reaches \u00b1${number(100 * reach, 2)} % of A; the line is the t-interval.` +
        (table.querySelector(".worse") ? ` ${kWorse}` : "") +
        (model.metrics.some((m) => model.is_relative(m.name)) ? ` ${kRelMse}` : ""),
        comparison.claims && h("p", {}, comparison.claims),
        scroll("A against B", table), explain_intervals(comparison.bootstrap)));
}
