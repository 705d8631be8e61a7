// Small helpers of the page: elements, numbers.

// h("button", {class: "x", onclick: f, "aria-label": "y"}, child, "text", [more])
export function h(tag, attributes = {}, ...children) {
    const svg = ["svg", "rect", "line", "circle", "path", "g", "title"].includes(tag);
    const element = svg ? document.createElementNS("http://www.w3.org/2000/svg", tag)
        : document.createElement(tag);
    for (const [key, value] of Object.entries(attributes)) {
        if (value === undefined || value === false || value === null) continue;
        if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
        else if (key === "style" && typeof value === "object")
            for (const [name, v] of Object.entries(value)) element.style.setProperty(name, v);
        else element.setAttribute(key, value === true ? "" : value);
    }
    element.append(...children.flat().filter((c) => c !== undefined && c !== null && c !== false));
    return element;
}

export const by_id = (id) => document.getElementById(id);

export const limit = (v, low, high) => Math.min(Math.max(v, low), high);

// Three significant digits (or as told), no longer than a column: "0.123", "1.23e-7", "12 300".
export function number(v, digits = 3) {
    if (v === null || v === undefined) return "\u2013";
    if (!Number.isFinite(v)) return Number.isNaN(v) ? "NaN" : v > 0 ? "\u221e" : "\u2212\u221e";
    if (v === 0) return "0";
    const size = Math.abs(v);
    const text = size >= 1e5 || size < 1e-3 ? size.toExponential(digits - 1).replace("e+", "e")
        : size >= 10 ** digits ? size.toFixed(0)
            : size.toPrecision(digits);
    return (v < 0 ? "\u2212" : "") + text.replace("e-", "e\u2212");
}

// A count with the prefix of its size: "2.30 kB", "5.18 k", "144".
export function short(v, unit = "") {
    const step = v < 1000 ? 0 : Math.min(4, Math.floor(Math.log10(v) / 3));
    const text = step ? number(v / 1000 ** step) : String(v);
    const suffix = ["", "k", "M", "G", "T"][step] + unit;
    return suffix ? `${text}\u2009${suffix}` : text;
}

// A difference: always with its sign.
export const signed = (v) => (v > 0 ? "+" : "") + number(v);

export const milliseconds = (v) => (v === undefined || v === null ? "\u2013"
    : v >= 1e4 ? `${number(v / 1000)} s` : `${number(v)} ms`);

// A color of the style sheet, as it is in the present scheme.
export const color_of = (name) =>
    getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

// Runs f once after calls have ceased for `wait` ms.
export function settle(f, wait) {
    let timer;
    return (...args) => {
        clearTimeout(timer);
        timer = setTimeout(() => f(...args), wait);
    };
}
