// Elements. They are made from strings alone: no text of a file or message ever becomes HTML.

const kSvg = new Set(["svg", "rect", "line", "circle", "path", "g", "text", "title"]);

// Characters that act on a terminal or turn the direction of the text around them are shown as \x1b
// and \u{202e} (chain/base/printable.h), except line feeds and tabs.
const kActing = /[\0-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff]/g;
export const printable = (text) => `${text}`.replace(kActing, (c) => {
    const code = c.codePointAt(0).toString(16);
    return c < "\x80" ? `\\x${code.padStart(2, "0")}` : `\\u{${code}}`;
});
const kShown = new Set(["alt", "aria-label", "placeholder", "title"]);  // attributes that are read

// h("button", {class: "x", onclick: f, "aria-label": "y"}, child, "text", [more]). A child or an
// attribute that is false, null or undefined is left out.
export function h(tag, attributes = {}, ...children) {
    const element = kSvg.has(tag) ? document.createElementNS("http://www.w3.org/2000/svg", tag)
        : document.createElement(tag);
    for (const [key, value] of Object.entries(attributes)) {
        if (value === undefined || value === false || value === null) continue;
        if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
        else if (key === "style")
            for (const [name, v] of Object.entries(value)) element.style.setProperty(name, v);
        else element.setAttribute(key, value === true ? "" : kShown.has(key) ? printable(value) : value);
    }
    element.append(...children.flat(2).filter((c) => c !== undefined && c !== null && c !== false)
        .map((c) => (typeof c === "string" ? printable(c) : c)));
    return element;
}

export const by_id = (id) => document.getElementById(id);

// The value of <script type="application/json" id="ID">, whose strings are only shown.
export const json_of = (id) => JSON.parse(by_id(id).textContent,
    (key, value) => (typeof value === "string" ? printable(value) : value));

let ids = 0;
export const new_id = () => `e${++ids}`;

export const limit = (v, low, high) => Math.min(Math.max(v, low), high);

// A color of the style sheet in the present scheme.
export const color_of = (name) =>
    getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

// Runs f once, `wait` ms after the last call.
export function settle(f, wait) {
    let timer;
    return (...args) => {
        clearTimeout(timer);
        timer = setTimeout(() => f(...args), wait);
    };
}
