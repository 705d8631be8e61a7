// Panels below the first screen.
import { h } from "../shared/dom.js";
import { number } from "../shared/words.js";

// kind: "panel wide" or "panel", half as wide.
export const section = (kind, title, ...rest) =>
    h("section", { class: kind, "aria-label": title }, h("h2", {}, title), ...rest);

export const panel = (title, about, ...rest) =>
    section("panel wide", title, about && h("p", { class: "about" }, about), ...rest);

export const kRelMse = "relMSE misleads if a bright edge is slightly out of place: on a dark " +
    "surface the difference is divided by almost nothing, and a few such pixels decide the mean. It " +
    "is never marked as worse; read HDR-FLIP and PSNR.";

export const kWorse = "Underlined in red: worse than the unfiltered input.";

// The cell of a mean; marked if the variant is worse than the unfiltered input.
export function mean_cell(model, variant, name) {
    const worse = model.is_worse(variant, name);
    return h("td", { class: "num" }, worse
        ? h("span", { class: "worse", title: `worse than the unfiltered input: ` +
            number(model.input_metrics[name].mean) }, number(model.mean(variant, name)))
        : number(model.mean(variant, name)));
}

// entries: [name, color] each.
export const legend = (entries) => h("div", { class: "legend" }, entries.map(([name, color]) =>
    h("span", {}, h("i", { style: { "--color": color } }), name)));

// Color of the i-th part or pass.
export const color = (i) => `var(--part${(i % 7) + 1})`;

// Marks the row of the source on the canvas, now or whenever it changes.
export const mark = (page, rows) => rows.forEach(({ key, row }) => {
    row.classList.add("current-able");
    row.classList.toggle("current", key === page.state.get("show"));
});
export const follow = (page, rows) => page.state.watch(["show"], () => mark(page, rows));
