// The state of the page, kept in the part of the address after #, so that a link shows the same.
//
// show, last: "truth", "input" or the number of a variant, from 1; docs/report.md has the rest.
import { settle } from "../shared/dom.js";

// key in the address -> member, how it is read and written. An invalid value is ignored.
const number_between = (low, high) => ({
    read: (text) => {
        const v = Number(text);
        return text !== "" && v >= low && v <= high ? v : undefined;
    },
    write: (v) => String(Number(v.toFixed(3))),
});
const one_of = (keys) => ({
    read: (text) => (keys.includes(text) ? text : undefined),
    write: (v) => v,
});
const flag = { read: (text) => text === "1", write: (v) => (v ? "1" : "0") };
const boxes = (frames, width, height) => ({
    read: (text) => text.split("_").map((box) => box.split(",").map(Number)).filter(
        ([frame, x, y, w, h]) => frames.includes(frame) && x >= 0 && y >= 0 && w >= 1 && h >= 1 &&
            x + w <= width && y + h <= height && [x, y, w, h].every(Number.isInteger))
        .map(([frame, x, y, w, h]) => ({ frame, x, y, width: w, height: h })),
    write: (list) => list.map((b) => [b.frame, b.x, b.y, b.width, b.height].join()).join("_"),
});

export function fields_of(model) {
    return {
        show: one_of(model.sources.map((s) => s.key)),
        last: one_of(model.sources.map((s) => s.key)),
        frame: one_of_numbers(model.page_frames),
        ev: number_between(-20, 20),
        tone: one_of(model.tones),
        map: one_of(model.maps.map((m) => m.key)),
        pin: flag,
        zoom: number_between(0, 64),  // device pixels per picture pixel; 0: the whole picture
        x: number_between(-1e5, 1e5),  // picture pixel at the center of the canvas
        y: number_between(-1e5, 1e5),
        metric: one_of(model.metrics.map((m) => m.name)),
        crops: boxes(model.page_frames, model.width, model.height),
    };
}
const one_of_numbers = (list) => ({
    read: (text) => (text !== "" && list.includes(Number(text)) ? Number(text) : undefined),
    write: String,
});

export class State {
    constructor(fields, defaults) {
        this.fields = fields;
        this.defaults = defaults;
        this.listeners = [];
        this.values = { ...defaults, ...this.#read() };
        this.#write_later = settle(() => this.write(), 200);
        addEventListener("hashchange", () => {
            if (location.hash.slice(1) !== this.written)
                this.set({ ...defaults, ...this.#read() });
        });
    }
    #write_later;

    #read() {
        const values = {};
        for (const [key, text] of new URLSearchParams(location.hash.slice(1))) {
            const value = this.fields[key]?.read(text);
            if (value !== undefined) values[key] = value;
        }
        return values;
    }

    // The part of the address after #: members that differ from the default.
    hash() {
        return Object.entries(this.fields)
            .map(([key, { write }]) =>
                [key, write(this.values[key] ?? ""), write(this.defaults[key] ?? "")])
            .filter(([, text, usual]) => text !== usual)
            .map(([key, text]) => `${key}=${text}`).join("&");
    }

    write() {
        this.written = this.hash();
        history.replaceState(null, "", `#${this.written}`);
    }

    get(key) { return this.values[key]; }

    set(changes) {
        const changed = new Set(Object.keys(changes).filter((key) =>
            this.values[key] !== changes[key]));
        if (!changed.size) return;
        Object.assign(this.values, changes);
        this.#write_later();
        for (const [keys, listener] of this.listeners)
            if (keys.some((key) => changed.has(key))) listener(changed);
    }

    // Calls listener now, and again when one of the members changes.
    watch(keys, listener) {
        this.listeners.push([keys, listener]);
        listener(new Set(keys));
    }
}
