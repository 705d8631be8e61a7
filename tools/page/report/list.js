// The list of pictures: key, name, error, time, and the values under the cursor.
import { by_id, h } from "../shared/dom.js";
import { is_better, milliseconds, number, way_of } from "../shared/words.js";
import { metric_name } from "./model.js";
import { error_of } from "../viewer/tone.js";

// Three values in columns of 8.
const triple = (rgb) => rgb.map((v) => number(v).padStart(8)).join("");

// An error of 255 steps: as many digits as they have.
const error_text = (map, place) => (place === undefined ? ""
    : number(error_of(place, map), map.log ? 2 : 3));

// Shown while there is no cursor: the order of the passes.
const passes_of = ({ data }) => (data?.timing?.passes ?? [])
    .map(({ pass }) => pass.replace(/^\d+\./, "").replaceAll("_", " ")).join(" \u2192 ");

export function fill_list(page) {
    const { model, state } = page;
    const select = by_id("metric");
    select.append(...model.metrics.map((m) => h("option", { value: m.name, title: m.help },
        metric_name(m.name))));
    select.disabled = !model.metrics.length;
    select.addEventListener("change", () => state.set({ metric: select.value }));

    const rows = new Map();
    for (const source of model.sources) {
        const failure = source.data?.failure;
        const parts = {
            figure: h("span", { class: "figure" }),
            values: h("span", { class: failure ? "values reason" : "values passes" },
                failure ?? passes_of(source)),
            at: h("span", { class: "at" }),
        };
        const time = source.kind === "color" && !(failure && model.time(source.data) === undefined)
            ? milliseconds(model.time(source.data)) : "";
        const untrusted = source.data?.timing?.trustworthy === false;
        parts.row = h("button", {
            type: "button", class: "row", "aria-pressed": "false",
            title: failure || source.data?.name ||
                (source.data && "what the metrics are without any filter"),
            onclick: () => page.show(source.key),
            // After a click the picture gets the focus, so that space flips.
            onpointerup: () => page.viewer.canvas.focus({ preventScroll: true }),
        }, h("kbd", {}, source.digit), h("span", { class: "name" }, source.name), parts.figure,
        h("span", { class: "figure", title: untrusted && source.data.timing.why_not },
            untrusted && time ? `~${time}` : time), parts.values, failure ? "" : parts.at);
        rows.set(source.key, parts);
        by_id("sources").append(parts.row);
    }

    state.watch(["show", "last"], () => {
        for (const [key, { row }] of rows) {
            row.setAttribute("aria-pressed", key === state.get("show"));
            row.classList.toggle("last", key === state.get("last") && key !== state.get("show"));
        }
        rows.get(state.get("show"))?.row.scrollIntoView({ block: "nearest" });
    });
    state.watch(["metric"], () => {
        select.value = state.get("metric");
        const metric = model.metric(state.get("metric"));
        by_id("way").textContent = way_of(metric, model.reference_kind);
        let best;
        for (const source of model.variant_sources.filter(() => model.reference_kind !== "a")) {
            const mean = model.mean(source.data, state.get("metric"));
            if (mean !== undefined && (best === undefined || is_better(metric?.better, mean, best)))
                best = mean;
        }
        for (const source of model.sources.filter((s) => s.data)) {
            const mean = model.mean(source.data, state.get("metric"));
            const { figure } = rows.get(source.key);
            const failed = source.data.failure && mean === undefined;
            figure.textContent = failed ? "failed" : number(mean);
            figure.classList.toggle("best", source.kind === "color" && mean !== undefined &&
                mean === best);
            const worse = model.is_worse(source.data, state.get("metric"));
            figure.classList.toggle("worse", worse);
            figure.title = worse ? "worse than the unfiltered input" : "";
            figure.classList.toggle("bad", Boolean(failed));
        }
    });

    const readout = by_id("readout");
    function values(pixel) {
        const map = model.maps.find((m) => m.key === state.get("map"));
        for (const source of model.sources) {
            const { values: line, at } = rows.get(source.key);
            if (source.data?.failure) continue;
            const found = pixel && page.viewer.values(source, pixel, map);
            line.textContent = found ? triple(found.rgb) : passes_of(source);
            line.classList.toggle("passes", !found);
            at.textContent = error_text(map, found?.place);
        }
        readout.textContent = pixel
            ? `Linear R, G, B${map ? ` and ${map.name}` : ""} at ${pixel.x}, ${pixel.y}.`
            : "Point at the picture for its values.";
    }
    page.on_cursor.push(values);
    state.watch(["frame", "map", "show"], () => page.viewer.loaded?.then(() =>
        page.viewer.cursor && values(page.viewer.cursor)));

    // The values in words, for the cursor of the keyboard.
    page.read_values = (pixel) => {
        const map = model.maps.find((m) => m.key === state.get("map"));
        page.say(`${pixel.x}, ${pixel.y}: ` + model.sources.map((source) => {
            const found = page.viewer.values(source, pixel, map);
            if (!found) return "";
            const error = error_text(map, found.place);
            return `${source.name} ${found.rgb.map((v) => number(v)).join(" ")}` +
                (error && `, ${map.name} ${error}`);
        }).filter(Boolean).join("; "));
    };
}
