// The parts of the error, and the time of each pass.
import { h } from "../shared/dom.js";
import { head, percent } from "../shared/tables.js";
import { milliseconds, number } from "../shared/words.js";
import { metric_name } from "./model.js";
import { color, follow, legend, mark, panel } from "./panel.js";

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
        const value = (s, key) => (stacked ? s.data.split.mse
            : s.data.split.others[select.value])?.[key];
        // Without ground truth neither model error nor total exists.
        const there = (key) => sources.some((s) => Number.isFinite(value(s, key)));
        const kinds = [...kParts, ...(stacked ? [["cross", "what is left of the total"]] : [])]
            .map(([key, help], i) => ({ key, help, color: color(i),
                name: key === "cross" ? "cross term" : key })).filter(({ key }) => there(key));
        const parts = kinds.map(({ key }) => key);
        const whole = there("total") ? ["total"] : [];
        const sums = sources.map((s) => parts.map((key) => value(s, key) ?? 0));
        const total = (list, sign) => list.reduce((sum, v) => sum + Math.max(0, sign * v), 0);
        const above = Math.max(...sums.map((v) => total(v, 1)),
            ...sources.map((s) => value(s, "total") ?? 0));
        const below = Math.max(...sums.map((v) => total(v, -1)));
        const largest = Math.max(...sources.flatMap((s) =>
            [...parts, ...whole].map((key) => value(s, key) ?? 0)));
        about.textContent = [
            stacked && whole.length && "Total = precision + sampling + model + cross term; the " +
                "cross term may be negative and then lies left of zero. The mark is the total.",
            stacked || "Side by side: these do not add up.",
            whole.length ? "" : "Without a truth there is no model error, and no total.",
        ].filter((text) => typeof text === "string").join(" ");
        function bars(s, sum) {
            if (!stacked) {
                return h("div", { class: "bars side" }, [...parts, ...whole].map((key, i) =>
                    Number.isFinite(value(s, key)) && h("i", { style: {
                        "--width": percent(value(s, key) / largest || 0),
                        "--color": key === "total" ? "var(--text)" : kinds[i].color } })));
            }
            const full = above + below || 1;
            let [right, left] = [below, below];
            return h("div", { class: "bars" }, sum.map((v, i) => {
                const from = v >= 0 ? right : left + v;
                if (v >= 0) right += v; else left += v;
                return h("i", { style: { "--from": percent(from / full),
                    "--width": percent(Math.abs(v) / full), "--color": kinds[i].color } });
            }), Number.isFinite(value(s, "total")) && h("b", { style: {
                "--from": percent((below + value(s, "total")) / full) } }));
        }
        const rows = sources.map((s, i) => ({ key: s.key, row: h("tr", {},
            h("th", { scope: "row" }, s.name),
            h("td", { style: { width: "38%" } }, bars(s, sums[i])),
            [...parts, ...whole].map((key) => h("td", { class: "num" }, number(value(s, key)))),
            h("td", { class: "num" }, s.data.split.seeds ? String(s.data.split.seeds) : "\u2013"),
            h("td", { class: "num" }, stacked ? number(s.data.split.converged_noise_mse) : "")) }));
        body.replaceChildren(legend([...kinds.map(({ name, color: ink }) => [name, ink]),
            ...whole.map((key) => [key, "var(--text)"])]),
        h("table", {}, head(["Variant"], [""],
            ...kinds.map(({ name, help }) => [name, "num", help]),
            ...whole.map((key) => [key, "num", "GPU against the truth"]),
            ["seeds", "num", "averaged in the converged picture"],
            [stacked ? "noise left" : "", "num", "MSE left in the converged picture"]),
        h("tbody", {}, rows.map(({ row }) => row))));
        current = rows;
        mark(page, current);
    }
    let current = [];
    select.addEventListener("change", draw);
    more.append(h("section", { class: "panel wide", "aria-label": "Where the error comes from" },
        h("div", { class: "panel-head" }, h("h2", {}, "Where the error comes from"),
            others.length ? select : ""), about, body,
        notes.length ? h("details", {}, h("summary", {}, "How it converged, what is left out"),
            h("ul", { class: "notes" }, notes.map((n) => h("li", {}, n)))) : ""));
    draw();
    page.state.watch(["show"], () => mark(page, current));
}

export function add_times(page, more) {
    const { model } = page;
    const sources = model.variant_sources.filter((s) => s.data.timing);
    if (!sources.length) return;
    // "0.motion_blur" -> "motion_blur": a pass keeps its color at any position.
    const kind = (pass) => pass.replace(/^\d+\./, "");
    const kinds = [...new Set(sources.flatMap((s) =>
        s.data.timing.passes.map((p) => kind(p.pass))))];
    const longest = Math.max(...sources.map((s) => Math.max(s.data.timing.total.median_ms,
        s.data.timing.passes.reduce((sum, p) => sum + p.median_ms, 0)))) || 1;
    const clocks = [...new Set(sources.map((s) => s.data.timing.source))].join(", ");
    const doubts = sources.filter((s) => s.data.timing.trustworthy === false);
    const rows = sources.map((s) => {
        const { passes, total, frame, trustworthy, why_not } = s.data.timing;
        let from = 0;
        return { key: s.key, row: h("tr", {}, h("th", { scope: "row" }, s.name),
            h("td", { style: { width: "38%" } }, h("div", { class: "bars" }, passes.map((p) => {
                const bar = h("i", { title: `${p.pass}: ${milliseconds(p.median_ms)}`, style: {
                    "--from": percent(from / longest), "--width": percent(p.median_ms / longest),
                    "--color": color(kinds.indexOf(kind(p.pass))) } });
                from += p.median_ms;
                return bar;
            }))),
            h("td", { class: "num", title: trustworthy ? undefined : why_not },
                (trustworthy ? "" : "~") + milliseconds(total.median_ms)),
            h("td", { class: "num" }, `\u00b1 ${number(total.spread_ms / 2, 2)}`),
            h("td", { class: "num" }, String(total.n)), h("td", { class: "num" }, String(frame)),
            h("td", {}, passes.map((p) => `${kind(p.pass)} ${p.left_out ? "left out"
                : milliseconds(p.median_ms)}`).join(", "))) };
    });
    more.append(panel("Time per pass",
        "Median of n repetitions, no transfers; \u00b1 is half the distance between the " +
        `quartiles. Clock: ${clocks}.`,
        doubts.length ? h("p", { class: "bad" }, "Times marked ~ are not to be trusted: " +
            doubts[0].data.timing.why_not + (doubts.length > 1 ? ", and the like." : ".")) : "",
        legend(kinds.map((k, i) => [k, color(i)])),
        h("div", { class: "scroll" }, h("table", {},
            head(["Variant"], [""], ["total", "num"], ["", "num"], ["n", "num"], ["frame", "num"],
                ["passes"]),
            h("tbody", {}, rows.map(({ row }) => row))))));
    follow(page, rows);
}
