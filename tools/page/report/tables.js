// Variants with their chains, and the conditions of the experiment.
import { h } from "../shared/dom.js";
import { head } from "../shared/tables.js";
import { number, short, way_of } from "../shared/words.js";
import { metric_name } from "./model.js";
import { follow, kRelMse, kWorse, mean_cell, panel, section } from "./panel.js";

export function add_variants(page, more) {
    const { model } = page;
    const rows = model.variant_sources.map((s) => {
        const v = s.data;
        return { key: s.key, row: h("tr", {}, h("th", { scope: "row" }, v.name),
            h("td", {}, v.failure ? h("div", { class: "bad" }, `failed: ${v.failure}`) : "",
                h("details", {}, h("summary", {}, h("code", {}, v.chain_hash)),
                    h("pre", {}, v.chain),
                    v.resumed ? h("p", { class: "quiet" }, "Taken from an interrupted run.") : "")),
            model.metrics.map((m) => mean_cell(model, v, m.name))) };
    });
    const input = model.source("input");
    if (input?.data)
        rows.push({ key: "input", row: h("tr", {}, h("th", { scope: "row" }, "input"),
            h("td", { class: "quiet" }, "no filter"),
            model.metrics.map((m) => h("td", { class: "num" },
                number(model.mean(input.data, m.name))))) });
    const worse = rows.some(({ row }) => row.querySelector(".worse"));
    more.append(panel("Variants", "Means over frames; the hash opens the chain." +
        (worse ? ` ${kWorse}` : "") +
        (model.metrics.some((m) => model.is_relative(m.name)) ? ` ${kRelMse}` : ""),
        h("div", { class: "scroll" }, h("table", {}, head(["Variant"], ["Chain"],
            ...model.metrics.map((m) => [metric_name(m.name), "num", m.help,
                way_of(m, model.reference_kind)])),
        h("tbody", {}, rows.map(({ row }) => row))))));
    follow(page, rows);
}

// Work that the plans left out, and its saving: the rows of report.json.
export function add_left_out({ model }, more) {
    const rows = model.left_out.map((row, i) => {
        const known = row.bytes || row.dispatches || row.taps;
        const [reason, ...others] = row.reasons;
        const again = i > 0 && model.left_out[i - 1].variant === row.variant;
        return h("tr", {}, h("th", { scope: "row" }, again ? "" : row.variant),
            h("td", {}, row.what), h("td", {}, row.rule),
            h("td", { title: others.join("\n") }, reason,
                others.length ? ` (first frame; ${others.length} more like it)` : ""),
            h("td", {}, row.frames.join(", ")),
            h("td", { class: "num" }, known ? short(row.bytes, "B") : "\u2013"),
            h("td", { class: "num" }, known ? short(row.dispatches) : "\u2013"),
            h("td", { class: "num" }, known ? short(row.taps) : "\u2013"));
    });
    more.append(panel("Left out of the plans", rows.length
        ? "Work that frames did not need: rule, reason, and what it saved over " +
            "the frames named; of blocks that the device found, fetches alone. A dash: nothing."
        : "Nothing: the plan of every frame is whole.",
    rows.length > 0 && h("div", { class: "scroll" }, h("table", { class: "left-out" },
        head(["Variant"], ["Left out"], ["Rule"], ["Reason"], ["Frames"],
            ["bytes", "num", "of textures"], ["dispatches", "num"],
            ["taps", "num", "texture fetches"]),
        h("tbody", {}, rows)))));
}

export function add_facts({ model, viewer }, more) {
    const bootstrap = model.comparison?.bootstrap;
    const noise = model.truth_noise;
    const facts = [
        ["Command",  h("code", {}, model.command.join(" "))],
        ["Input", model.input && h("code", {}, model.input)],
        ["Truth", model.truth ? h("code", {}, model.truth)
            : model.no_truth && `none: ${model.no_truth}`],
        ["Noise of the truth", noise && `standard deviation ${number(noise.sigma.mean, 2)} of the ` +
            "displayed luma; a picture without any error would have " + model.metrics
            .filter((m) => noise[m.name]).map((m) => `${metric_name(m.name)} ` +
                number(noise[m.name].mean)).join(", ")],
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
        ["Bootstrap", bootstrap && `${bootstrap.replicates} replicates of tiles of ` +
            `${bootstrap.tile_px} px, seed ${bootstrap.seed}`],
        ["Constants", Object.entries(model.constants).map(([name, value]) =>
            `${name.replaceAll("_", " ")} ${value}`).join(", ")],
        ["Notes", model.notes.length && h("ul", { class: "notes" },
            model.notes.map((n) => h("li", {}, n)))],
        ["postchain", model.version],
        ["This page", `drawn with ${viewer.painter.name}; pictures are 16-bit floats, stored ` +
            "maps 8 bit"],
    ].filter(([, value]) => value);
    more.append(section("panel", "Conditions",
        h("table", { class: "facts" }, h("tbody", {}, facts.map(([name, value]) => h("tr", {},
            h("th", { scope: "row" }, name), h("td", {}, value)))))));
    more.append(section("panel", "Metrics",
        h("table", { class: "facts" }, h("tbody", {}, model.metrics.map((m) => h("tr", {},
            h("th", { scope: "row" }, metric_name(m.name)),
            h("td", {}, `${m.help}; ${way_of(m, model.reference_kind)}`)))))));
}
