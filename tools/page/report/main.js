// Starts the page: reads the report, wires the parts together.
import { by_id, h, json_of } from "../shared/dom.js";
import { counted, number } from "../shared/words.js";
import { fill_bar } from "../viewer/bar.js";
import { add_comparison } from "./comparison.js";
import { add_split, add_times } from "./costs.js";
import { add_crops } from "./crops.js";
import { ImageStore } from "./images.js";
import { bind_keys } from "../viewer/keys.js";
import { fill_list } from "./list.js";
import { kMagma } from "../viewer/magma.js";
import { metric_name, model_of } from "./model.js";
import { add_moves } from "../viewer/moves.js";
import { overlay } from "../viewer/overlay.js";
import { add_frames_plot, add_pareto } from "./plots.js";
import { State } from "../viewer/state.js";
import { fields_of } from "./fields.js";
import { add_slices } from "./slices.js";
import { add_facts, add_left_out, add_variants } from "./tables.js";
import { Viewer } from "../viewer/viewer.js";

// The keys of a report, in addition to the keys of every viewer.
const kKeys = [
    [["1", "9"], "a variant, by its place in the list"],
    [["0"], "the truth"],
    [["I"], "the input"],
    [["N", "B"], "next picture, the one before"],
    [["Shift", "Drag"], "choose a region for the crops"],
];

function actions_of(page) {
    const actions = {
        0: () => page.show("truth"), i: () => page.show("input"),
        n: () => page.step(1), b: () => page.step(-1),
    };
    for (let digit = 1; digit <= 9; ++digit) actions[digit] = () => page.show(String(digit));
    return actions;
}

function start() {
    const store = new ImageStore(json_of("manifest"));
    const model = model_of(json_of("report"), store);
    document.title = model.title;
    by_id("title").textContent = model.title;
    by_id("meta").textContent = [
        `${model.width} \u00d7 ${model.height}`,
        counted(model.frames.length, "frame"),
        model.device.renderer, model.no_truth && "no truth",
    ].filter(Boolean).join("  \u00b7  ");
    const verdict = [model.comparison?.verdict, ...model.under.map((line) => `${line}.`),
        model.reference_kind === "converged" && "Without a truth every variant is measured " +
            `against its own filter converged, and there is no model error: ${model.no_truth}.`,
        model.winner && !model.comparison && `Shown first: ${model.winner.words}.`,
    ].filter(Boolean).join(" ");
    by_id("verdict").hidden = !verdict;
    by_id("verdict").textContent = verdict;
    by_id("warnings").append(...model.warnings.map((text) => h("li", {}, text)));
    by_id("warnings").hidden = !model.warnings.length;

    const shown = model.sources.filter((s) => s.frames.length);
    // The variant that won; without a winner B of two.
    const colors = shown.filter((s) => s.kind === "color");
    const first = colors.find((s) => s.variant === model.winner?.variant) ??
        (model.comparison && colors[1]) ?? colors[0] ?? shown[0] ?? model.sources[0];
    const second = shown.find((s) => s.kind === "color" && s !== first) ?? shown.find(
        (s) => s !== first) ?? first;
    const metric = model.metric(model.pareto_metric) ?? model.metric("hdr_flip") ??
        model.metrics[0];
    const state = new State(fields_of(model), {
        show: first.key, last: second.key, frame: first.frames[0] ?? model.page_frames[0] ?? 0,
        ev: 0, tone: "display", map: model.maps[0]?.key ?? "", pin: false, wipe: 0, zoom: 0, x: 0, y: 0,
        metric: metric?.name ?? "", crops: [],
    });

    const page = { model, store, state };
    add_moves(page);
    page.step = (count) => {
        const at = model.sources.findIndex((s) => s.key === state.get("show"));
        page.show(model.sources[(at + count + model.sources.length) % model.sources.length].key);
    };

    // Beside the name of the picture.
    page.note = (source) => {
        const metric = state.get("metric");
        const mean = source?.data && model.mean(source.data, metric);
        return mean === undefined ? "" : `${metric_name(metric)} ${number(mean)}`;
    };
    const marks = overlay(page);
    page.viewer = new Viewer(by_id("canvas"), model, store, state, {
        cursor: (pixel) => page.on_cursor.forEach((f) => f(pixel)),
        drawn: () => marks.drawn(),
        held: () => page.on_hold?.(),
        busy: (on) => marks.busy(on),
        choosing: (box) => marks.choosing(box),
        crop: (box) => state.set({
            crops: [...state.get("crops"), { frame: state.get("frame"), ...box }] }),
    });
    page.on_cursor = [marks.cursor];
    fill_list(page);
    fill_bar(page);
    bind_keys(page, kKeys, actions_of(page));

    const more = by_id("more");
    add_comparison(page, more);
    add_pareto(page, more);
    add_frames_plot(page, more);
    add_slices(page, more);
    add_crops(page, more);
    add_split(page, more);
    add_times(page, more);
    add_left_out(page, more);
    add_variants(page, more);
    add_facts(page, more);

    preload(page);
    // For tests and the console: the parts, and a promise of a finished canvas.
    globalThis.postchain = {
        ...page,
        pareto: () => page.pareto,
        magma: (i) => [...kMagma.slice(4 * i, 4 * i + 3)],
        settled: async () => {
            await page.viewer.loaded;
            page.viewer.draw_now();
        },
    };
}

// Decodes the pictures that the next keys may show, one at a time.
function preload({ model, store, state }) {
    let round = 0;
    state.watch(["frame", "map"], async () => {
        const mine = ++round;
        const frame = state.get("frame");
        const names = model.sources.map((s) => [s.kind, s.variant, frame]);
        names.push(...model.sources.map((s) => model.error_map(s, frame, state.get("map"))));
        for (const name of names) {
            await store.load(...name).catch(() => undefined);
            if (mine !== round) return;
        }
    });
}

start();
