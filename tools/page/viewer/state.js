// The state of the page, kept in the part of the address after #, so that a link shows the same.
import { settle } from "../shared/dom.js";

// key in the address -> member, how it is read and written. An invalid value is ignored.
export const number_between = (low, high) => ({
    read: (text) => {
        const v = Number(text);
        return text !== "" && v >= low && v <= high ? v : undefined;
    },
    write: (v) => String(Number(v.toFixed(3))),
});
export const one_of = (keys) => ({
    read: (text) => (keys.includes(text) ? text : undefined),
    write: (v) => v,
});
export const any_text = { read: (text) => text, write: (v) => v };
export const flag = { read: (text) => text === "1", write: (v) => (v ? "1" : "0") };
export const one_of_numbers = (list) => ({
    read: (text) => (text !== "" && list.includes(Number(text)) ? Number(text) : undefined),
    write: String,
});

export class State {
    // places: members that name what is looked at. The browser's Back leads to their former values.
    constructor(fields, defaults, places = []) {
        this.fields = fields;
        this.defaults = defaults;
        this.listeners = [];
        this.values = { ...defaults, ...this.#read() };
        this.#place = () => JSON.stringify(places.map((key) => this.values[key]));
        this.#written_place = this.#place();
        this.#write_later = settle(() => this.write(), 200);
        addEventListener("hashchange", () => {
            if (location.hash.slice(1) === this.written) return;
            this.written = location.hash.slice(1);
            this.set({ ...defaults, ...this.#read() });
            this.#written_place = this.#place();
        });
    }
    #write_later;
    #place;
    #written_place;

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
            .map(([key, text]) => `${key}=${text.replace(/[%&+#\s]/g, encodeURIComponent)}`).join("&");
    }

    write() {
        const hash = this.hash(), place = this.#place();
        if (hash === this.written) return;  // a write would end a Back or Forward that is under way
        this.written = hash;
        const way = place === this.#written_place ? "replaceState" : "pushState";
        history[way](null, "", `#${this.written}`);
        this.#written_place = place;
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
