// What the panels with tables share.
import { h, number } from "./dom.js";

export const panel = (title, about, ...rest) =>
    h("section", { class: "panel wide", "aria-label": title }, h("h2", {}, title),
        about && h("p", { class: "about" }, about), ...rest);

// cells: [text, class, help, line below] each.
export const head = (...cells) => h("thead", {}, h("tr", {}, cells.map(([text, kind, help, below]) =>
    h("th", { class: kind, scope: "col", title: help }, text,
        below && h("small", {}, below)))));

// The cell of a mean; marked where the variant is worse than the unfiltered input.
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

// Of the i-th part or pass.
export const color = (i) => `var(--part${(i % 7) + 1})`;
export const percent = (v) => `${100 * v}%`;

// Marks the row of what is on the canvas.
export function follow(page, rows) {
    page.state.watch(["show"], () => rows.forEach(({ key, row }) => {
        row.classList.add("current-able");
        row.classList.toggle("current", key === page.state.get("show"));
    }));
}
