// Elements, made from text alone: no text of a file or message ever becomes HTML.

/** el("a", {href: "#x", class: "y", onclick: f}, "text", child). False, null: no child, no attribute. */
export function el(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
        if (value === false || value === null || value === undefined) continue;
        if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
        else made.setAttribute(name, value === true ? "" : String(value));
    }
    made.append(...children.flat(2).filter((c) => c !== null && c !== undefined && c !== false));
    return made;
}

export const $ = (id) => document.getElementById(id);

let count = 0;
export const newId = () => `e${++count}`;

/** Calls f once, `ms` after the last call. */
export function later(ms, f) {
    let timer = 0;
    return (...args) => {
        clearTimeout(timer);
        timer = setTimeout(() => f(...args), ms);
    };
}

export function duration(seconds) {
    if (seconds < 60) return `${Math.max(1, Math.round(seconds))} s`;
    if (seconds < 3600) return `${Math.round(seconds / 60)} min`;
    return `${Math.floor(seconds / 3600)} h ${Math.round((seconds % 3600) / 60)} min`;
}

export const milliseconds = (ms) => (ms >= 10000 ? `${(ms / 1000).toFixed(1)} s`
    : ms >= 100 ? `${Math.round(ms)} ms` : `${ms.toFixed(1)} ms`);

/** "14:03" of today, else with its date. */
export function clock(text) {
    const time = new Date(text);
    const today = time.toDateString() === new Date().toDateString();
    return time.toLocaleString([], today ? { hour: "2-digit", minute: "2-digit" }
        : { month: "short", day: "numeric", hour: "2-digit", minute: "2-digit" });
}
