// Tables, and figures drawn in their cells.
import { h, limit } from "./dom.js";

// cells: [text, class, help, line below] each.
export const head = (...cells) => h("thead", {}, h("tr", {}, cells.map(([text, kind, help, below]) =>
    h("th", { class: kind, scope: "col", title: help }, text,
        below && h("small", {}, below)))));

// A box in which a wide table scrolls, reachable by the keyboard.
export const scroll = (label, ...content) =>
    h("div", { class: "scroll", role: "region", "aria-label": label, tabindex: "0" }, content);

export const percent = (v) => `${100 * v}%`;

// A difference and its interval as a dot and a line around `middle`, all in pixels of an svg;
// `unit` is the length of 1. An arrow at `end` marks values beyond it.
export function interval_marks({ mean, interval, middle, unit, end, y, radius, ink, width = 3 }) {
    const at = (v) => middle + limit(v * unit, -end, end);
    const side = Math.sign(mean);
    const x = at(mean);
    return [
        interval && h("line", { x1: at(interval[0]), x2: at(interval[1]), y1: y, y2: y,
            stroke: ink, "stroke-width": width }),
        Math.abs(mean * unit) > end * 1.001
            ? h("path", { d: `M${x + 5 * side} ${y}l${-9 * side} -5v10z`, fill: ink })
            : h("circle", { cx: x, cy: y, r: radius, fill: ink })];
}
