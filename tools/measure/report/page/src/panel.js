// What the panels with tables share.
import { h } from "./dom.js";

export const panel = (title, about, ...rest) =>
    h("section", { class: "panel wide", "aria-label": title }, h("h2", {}, title),
        about && h("p", { class: "about" }, about), ...rest);

// cells: [text, class, help] each.
export const head = (...cells) => h("thead", {}, h("tr", {}, cells.map(([text, kind, help]) =>
    h("th", { class: kind, scope: "col", title: help }, text))));

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
