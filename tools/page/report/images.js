// The pictures of the page: found by kind, variant, frame and map, decoded on first use.
// With --assets each picture is a script beside the page that calls postchain_asset(id, base64): a
// page opened from disk can read a file in no other way. The page of the service, which shows a
// report in a frame, sends the pictures that the report asks it for.
import { PictureCache } from "../viewer/cache.js";
import { decode_picture, from_base64 } from "../viewer/picture.js";

const kCacheBytes = 768 * 2 ** 20;

const name_of = (kind, variant, frame, map) =>
    [kind, kind === "truth" || kind === "input" ? -1 : variant, frame, map ?? ""].join("/");

export class ImageStore {
    constructor(manifest) {
        this.scales = manifest.scales;  // by the key of an error map: {low, high, log}
        this.entries = new Map();
        for (const entry of manifest.images)
            this.entries.set(name_of(entry.kind, entry.variant, entry.frame, entry.map), entry);
        this.cache = new PictureCache(kCacheBytes);
        this.waiting = new Map();  // id -> resolve, of assets under way
        globalThis.postchain_asset = (id, text) => this.waiting.get(id)?.(text);
    }

    has(kind, variant, frame, map) { return this.entries.has(name_of(kind, variant, frame, map)); }

    // Keys of the error maps.
    maps() {
        return [...new Set([...this.entries.values()]
            .filter((entry) => entry.kind === "error").map((entry) => entry.map))];
    }

    // The picture if it is decoded, otherwise undefined.
    ready(kind, variant, frame, map) {
        return this.cache.ready(name_of(kind, variant, frame, map));
    }

    // {width, height, channels, bits, data, name}; undefined if there is none.
    async load(kind, variant, frame, map) {
        const name = name_of(kind, variant, frame, map);
        const entry = this.entries.get(name);
        return entry && this.cache.load(name, () => this.#decode(entry));
    }

    async #decode(entry) {
        const text = document.getElementById(entry.id)?.textContent
            ?? await (parent !== window ? this.#sent(entry)
                : entry.asset ? this.#asset(entry)
                    : Promise.reject(new Error(`the page does not have ${entry.id}`)));
        return { ...entry, data: await decode_picture(from_base64(text), entry) };
    }

    // By the page around this one.
    #sent({ id, asset }) {
        return new Promise((resolve, reject) => {
            const listen = ({ source, data }) => {
                if (source !== parent || data?.postchain_picture !== id) return;
                removeEventListener("message", listen);
                if (data.text === undefined) reject(new Error(data.why));
                else resolve(data.text);
            };
            addEventListener("message", listen);
            parent.postMessage({ postchain_wants: id, asset, page: location.pathname }, "*");
        });
    }

    #asset(entry) {
        return new Promise((resolve, reject) => {
            const script = document.createElement("script");
            script.src = entry.asset;
            script.onerror = () => reject(new Error(`${entry.asset} is missing`));
            script.onload = () => script.remove();
            this.waiting.set(entry.id, resolve);
            document.head.append(script);
        }).finally(() => this.waiting.delete(entry.id));
    }
}
