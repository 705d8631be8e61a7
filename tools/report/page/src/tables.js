// The panels that are tables: A against B, the error split, times per pass, chains, conditions.
import { h, milliseconds, number, signed } from "./dom.js";
import { metric_name } from "./model.js";

const panel = (title, about, ...rest) => h("section", { class: "panel wide", "aria-label": title },
    h("h2", {}, title), about && h("p", { class: "about" }, about), ...rest);
const head = (...cells) => h("thead", {}, h("tr", {}, cells.map(([text, kind, help]) =>
    h("th", { class: kind, scope: "col", title: help }, text))));
const legend = (entries) => h("div", { class: "legend" }, entries.map(([name, color]) =>
    h("span", {}, h("i", { style: { "--color": color } }), name)));
const color = (i) => `var(--part${(i % 7) + 1})`;
const percent = (v) => `${100 * v}%`;

// Marks the row of what is on the canvas.
function follow(page, rows) {
    page.state.watch(["show"], () => rows.forEach(({ key, row }) => {
        row.classList.add("current-able");
        row.classList.toggle("current", key === page.state.get("show"));
    }));
}

// Difference and interval as a dot and a line, in parts of A's mean; the axis is common.
function whisker(entry, base, reach) {
    const [width, height] = [190, 18];
    const at = (v) => width / 2 + (v / base / reach) * (width / 2 - 6);
    const y = height / 2;
    const clear = entry.finding === "a_better" || entry.finding === "b_better";
    const ink = clear ? "var(--accent)" : "var(--quiet)";
    const interval = entry.t_interval;
    return h("svg", { class: "whisker", viewBox: `0 0 ${width} ${height}`, "aria-hidden": "true" },
        h("line", { x1: width / 2, x2: width / 2, y1: 0, y2: height, stroke: "var(--grey)" }),
        interval && h("line", { x1: at(interval[0]), x2: at(interval[1]), y1: y, y2: y, stroke: ink,
            "stroke-width": 3 }),
        h("circle", { cx: at(entry.mean), cy: y, r: 4, fill: ink }));
}

export function add_comparison({ model }, more) {
    const comparison = model.comparison;
    if (!comparison) return;
    const [a, b] = model.variants;
    const bases = comparison.metrics.map((m) => {
        const base = m.differences?.length ? Math.abs(a.metrics?.[m.metric]?.mean ?? NaN) : NaN;
        return base > 0 ? base : undefined;
    });
    const spans = comparison.metrics.flatMap((m, i) => (bases[i] && Number.isFinite(m.mean)
        ? [m.mean, ...(m.t_interval ?? [])].filter(Number.isFinite)
            .map((v) => Math.abs(v) / bases[i]) : []));
    // Wide enough for nine of ten; the rest leave the box.
    spans.sort((x, y) => x - y);
    const reach = spans[Math.floor(0.9 * (spans.length - 1))] || 1;
    const interval = (v) => (v ? v.map(signed).join(" \u2026 ") : "\u2013");
    more.append(panel("A against B",
        `A: ${a.name}. B: ${b.name}. Differences are B \u2212 A (for ratios, how much further from 1), ` +
        "with paired 95 % t-intervals over frames and the bootstrap over tiles within frames. " +
        `The axis reaches \u00b1${number(100 * reach, 2)} % of A; the line is the t-interval.`,
        comparison.claims && h("p", {}, comparison.claims),
        h("div", { class: "scroll" }, h("table", {},
            head(["Metric"], ["A", "num"], ["B", "num"], ["B \u2212 A", "num"], ["relative to A"],
                ["t-interval", "num"], ["bootstrap", "num"], ["n", "num", "frames"], ["Finding"]),
            h("tbody", {}, comparison.metrics.map((m, i) => h("tr", {},
                h("th", { scope: "row", title: model.metric(m.metric)?.help }, metric_name(m.metric)),
                h("td", { class: "num" }, number(a.metrics?.[m.metric]?.mean)),
                h("td", { class: "num" }, number(b.metrics?.[m.metric]?.mean)),
                h("td", { class: "num" }, Number.isFinite(m.mean) ? signed(m.mean) : "\u2013"),
                h("td", {}, bases[i] && Number.isFinite(m.mean) ? whisker(m, bases[i], reach) : ""),
                h("td", { class: "num" }, interval(m.t_interval)),
                h("td", { class: "num" }, interval(m.bootstrap)),
                h("td", { class: "num" }, String(m.n)),
                h("td", { class: "words" }, m.words))))))));
}

const kParts = [["precision", "GPU against the double reference"],
    ["sampling", "the filter against itself converged"], ["model", "converged against the truth"]];

export function add_split(page, more) {
    const { model } = page;
    const sources = model.variant_sources.filter((s) => s.data.split);
    if (!sources.length) return;
    const others = [...new Set(sources.flatMap((s) => Object.keys(s.data.split.others)))];
    const select = h("select", { "aria-label": "Metric of the error split" },
        h("option", { value: "mse" }, "MSE (adds up)"),
        others.map((key) => h("option", { value: key }, metric_name(key))));
    const body = h("div", { class: "scroll" });
    const about = h("p", { class: "about" });
    const notes = [...new Set(sources.flatMap((s) => [...s.data.split.notes,
        ...s.data.split.convergence]))];

    function draw() {
        const stacked = select.value === "mse";
        const parts = [...kParts.map(([key]) => key), ...(stacked ? ["cross"] : [])];
        const value = (s, key) => (stacked ? s.data.split.mse
            : s.data.split.others[select.value])?.[key];
        const sums = sources.map((s) => parts.map((key) => value(s, key) ?? 0));
        const total = (list, sign) => list.reduce((sum, v) => sum + Math.max(0, sign * v), 0);
        const above = Math.max(...sums.map((v) => total(v, 1)), ...sources.map((s) => value(s, "total") ?? 0));
        const below = Math.max(...sums.map((v) => total(v, -1)));
        const largest = Math.max(...sources.flatMap((s) => [...parts, "total"].map((key) => value(s, key) ?? 0)));
        about.textContent = stacked
            ? "Total = precision + sampling + model + cross term; the cross term may be negative and then lies left of zero. The mark is the total."
            : "Side by side: these do not add up.";
        function bars(s, sum) {
            if (!stacked) return h("div", { class: "bars side" }, [...parts, "total"].map((key, i) =>
                value(s, key) !== undefined && value(s, key) !== null && h("i", { style: {
                    "--width": percent(value(s, key) / largest || 0),
                    "--color": key === "total" ? "var(--text)" : color(i) } })));
            const full = above + below || 1;
            let [right, left] = [below, below];
            return h("div", { class: "bars" }, sum.map((v, i) => {
                const from = v >= 0 ? right : left + v;
                if (v >= 0) right += v; else left += v;
                return h("i", { style: { "--from": percent(from / full),
                    "--width": percent(Math.abs(v) / full), "--color": color(i) } });
            }), Number.isFinite(value(s, "total")) && h("b", { style: {
                "--from": percent((below + value(s, "total")) / full) } }));
        }
        const rows = sources.map((s, i) => ({ key: s.key, row: h("tr", {},
            h("th", { scope: "row" }, s.name), h("td", { style: { width: "38%" } }, bars(s, sums[i])),
            [...parts, "total"].map((key) => h("td", { class: "num" }, number(value(s, key)))),
            h("td", { class: "num" }, s.data.split.seeds ? String(s.data.split.seeds) : "\u2013"),
            h("td", { class: "num" }, stacked ? number(s.data.split.converged_noise_mse) : "")) }));
        body.replaceChildren(legend([...parts.map((key, i) => [key === "cross" ? "cross term" : key, color(i)]),
            ["total", "var(--text)"]]),
        h("table", {}, head(["Variant"], [""], ...kParts.map(([key, help]) => [key, "num", help]),
            ...(stacked ? [["cross term", "num"]] : []), ["total", "num", "GPU against the truth"],
            ["seeds", "num", "averaged in the converged picture"],
            [stacked ? "noise left" : "", "num", "MSE left in the converged picture"]),
        h("tbody", {}, rows.map(({ row }) => row))));
        const shown = page.state.get("show");
        rows.forEach(({ key, row }) => row.classList.toggle("current", key === shown));
        current = rows;
    }
    let current = [];
    select.addEventListener("change", draw);
    more.append(h("section", { class: "panel wide", "aria-label": "Where the error comes from" },
        h("div", { class: "panel-head" }, h("h2", {}, "Where the error comes from"),
            others.length ? select : ""), about, body,
        notes.length ? h("details", {}, h("summary", {}, "How it converged, what is left out"),
            h("ul", { class: "notes" }, notes.map((n) => h("li", {}, n)))) : ""));
    draw();
    page.state.watch(["show"], () => current.forEach(({ key, row }) => {
        row.classList.add("current-able");
        row.classList.toggle("current", key === page.state.get("show"));
    }));
}

export function add_times(page, more) {
    const { model } = page;
    const sources = model.variant_sources.filter((s) => s.data.timing);
    if (!sources.length) return;
    // "0.motion_blur" -> "motion_blur": a pass keeps its colour wherever it stands.
    const kind = (pass) => pass.replace(/^\d+\./, "");
    const kinds = [...new Set(sources.flatMap((s) => s.data.timing.passes.map((p) => kind(p.pass))))];
    const longest = Math.max(...sources.map((s) => Math.max(s.data.timing.total.median_ms,
        s.data.timing.passes.reduce((sum, p) => sum + p.median_ms, 0)))) || 1;
    const clocks = [...new Set(sources.map((s) => s.data.timing.source))].join(", ");
    const doubts = [...new Set(sources.filter((s) => s.data.timing.trustworthy === false)
        .map((s) => s.data.timing.why_not))].filter(Boolean);
    const rows = sources.map((s) => {
        const { passes, total, frame } = s.data.timing;
        let from = 0;
        return { key: s.key, row: h("tr", {}, h("th", { scope: "row" }, s.name),
            h("td", { style: { width: "38%" } }, h("div", { class: "bars" }, passes.map((p) => {
                const bar = h("i", { title: `${p.pass}: ${milliseconds(p.median_ms)}`, style: {
                    "--from": percent(from / longest), "--width": percent(p.median_ms / longest),
                    "--color": color(kinds.indexOf(kind(p.pass))) } });
                from += p.median_ms;
                return bar;
            }))),
            h("td", { class: "num" }, milliseconds(total.median_ms)),
            h("td", { class: "num" }, `\u00b1 ${number(total.spread_ms / 2, 2)}`),
            h("td", { class: "num" }, String(total.n)), h("td", { class: "num" }, String(frame)),
            h("td", {}, passes.map((p) => `${kind(p.pass)} ${p.left_out ? "left out"
                : milliseconds(p.median_ms)}`).join(", "))) };
    });
    more.append(panel("Time per pass",
        `Median of n repetitions, no transfers; \u00b1 is half the distance between the quartiles. Clock: ${clocks}.`,
        doubts.length ? h("p", { class: "bad" }, `Not to be trusted: ${doubts.join("; ")}.`) : "",
        legend(kinds.map((k, i) => [k, color(i)])),
        h("div", { class: "scroll" }, h("table", {}, head(["Variant"], [""], ["total", "num"], ["", "num"],
            ["n", "num"], ["frame", "num"], ["passes"]), h("tbody", {}, rows.map(({ row }) => row))))));
    follow(page, rows);
}

export function add_variants(page, more) {
    const { model } = page;
    const rows = model.variant_sources.map((s) => {
        const v = s.data;
        // "motion_blur: largest half-velocity ..." with the frames it holds for.
        const reasons = new Map();
        for (const entry of v.left_out) {
            const text = `${entry.what}: ${entry.reason}`;
            reasons.set(text, [...(reasons.get(text) ?? []), entry.frame]);
        }
        return { key: s.key, row: h("tr", {}, h("th", { scope: "row" }, s.name),
            model.metrics.map((m) => h("td", { class: "num" }, number(model.mean(v, m.name)))),
            h("td", {}, v.failure ? h("span", { class: "bad" }, `failed: ${v.failure}`) : "",
                h("details", {}, h("summary", {}, h("code", {}, v.chain_hash)),
                    h("pre", {}, v.chain),
                    reasons.size ? h("ul", { class: "notes" }, [...reasons].map(([text, frames]) =>
                        h("li", {}, `left out: ${text} (frames ${frames.join(", ")})`))) : "",
                    v.resumed ? h("p", { class: "quiet" }, "Taken from an interrupted run.") : ""))) };
    });
    more.append(panel("Variants", "Means over frames; the hash opens the chain.",
        h("div", { class: "scroll" }, h("table", {}, head(["Variant"],
            ...model.metrics.map((m) => [metric_name(m.name), "num", m.help]), ["Chain"]),
        h("tbody", {}, rows.map(({ row }) => row))))));
    follow(page, rows);
}

export function add_facts({ model, viewer }, more) {
    const facts = [
        ["Command",  h("code", {}, model.command.join(" "))],
        ["Input", model.input && h("code", {}, model.input)],
        ["Truth", model.truth ? h("code", {}, model.truth) : model.no_truth && `none: ${model.no_truth}`],
        ["Frames", model.frames.join(", ") + (model.page_frames.length < model.frames.length
            ? ` (pictures of ${model.page_frames.join(", ")})` : "")],
        ["Device, driver", model.device.renderer + (model.device.software ? " (software)" : "")],
        ["Threads", String(model.device.threads)],
        ["Precision", model.device.precision],
        ["Seeds", model.seeds.join(", ")],
        ["Compared with", model.compared],
        ["HDR-FLIP", model.hdr_flip.exposures_ev.length && `${model.hdr_flip.tone_mapper}, EV ` +
            `${number(model.hdr_flip.start_ev, 4)} \u2026 ${number(model.hdr_flip.stop_ev, 4)}: ` +
            model.hdr_flip.exposures_ev.map((v) => number(v, 4)).join(", ")],
        ["Display transform", model.display_transform],
        ["Shared steps", model.comparison && `${model.comparison.shared_steps} run once for both ` +
            `(A ${model.comparison.steps_a}, B ${model.comparison.steps_b})`],
        ["Bootstrap", model.comparison && `${model.comparison.bootstrap.replicates} replicates of tiles ` +
            `of ${model.comparison.bootstrap.tile_px} px, seed ${model.comparison.bootstrap.seed}`],
        ["postchain", model.version],
        ["This page", `drawn with ${viewer.painter.name}; pictures are 16-bit floats, FLIP maps 8 bit`],
    ].filter(([, value]) => value);
    more.append(h("section", { class: "panel", "aria-label": "Conditions" }, h("h2", {}, "Conditions"),
        h("table", { class: "facts" }, h("tbody", {}, facts.map(([name, value]) => h("tr", {},
            h("th", { scope: "row" }, name), h("td", {}, value)))))));
    more.append(h("section", { class: "panel", "aria-label": "Metrics" }, h("h2", {}, "Metrics"),
        h("table", { class: "facts" }, h("tbody", {}, model.metrics.map((m) => h("tr", {},
            h("th", { scope: "row" }, metric_name(m.name)), h("td", {}, m.help))),
        Object.entries(model.constants).map(([name, value]) => h("tr", {}, h("th", { scope: "row" }, name.replaceAll("_", " ")),
            h("td", {}, number(value, 4)))))),
        model.notes.length ? h("ul", { class: "notes" }, model.notes.map((n) => h("li", {}, n))) : ""));
}
