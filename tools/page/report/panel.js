// Panels below the first screen.
import { h } from "../shared/dom.js";
import { number } from "../shared/words.js";

export const panel = (title, about, ...rest) =>
    h("section", { class: "panel wide", "aria-label": title }, h("h2", {}, title),
        about && h("p", { class: "about" }, about), ...rest);

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

// Marks the row of the source on the canvas.
export function follow(page, rows) {
    page.state.watch(["show"], () => rows.forEach(({ key, row }) => {
        row.classList.add("current-able");
        row.classList.toggle("current", key === page.state.get("show"));
    }));
}
