// The pictures of the page: found by kind, variant, frame and map, decoded on first use.
//
//   base64 --> zlib --> high bytes of all values, then the low bytes (one plane for 8-bit maps)
//          --> differences to the left (first column: to above), channel by channel --> pixels
//
// Written by tools/measure/report/page/encode.cpp. With --assets each picture is a script beside the
// page that calls postchain_asset(id, base64): a page opened from disk can read a file in no other
// way.

const kCacheBytes = 768 * 2 ** 20;

async function inflate(bytes) {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}

function from_base64(text) {
    const binary = atob(text.trim());
    const bytes = new Uint8Array(binary.length);
    for (let i = 0; i < bytes.length; ++i) bytes[i] = binary.charCodeAt(i);
    return bytes;
}

// Undoes the differences. `bytes`: the inflated planes; result: interleaved, row 0 at the top.
function integrate(bytes, { width, height, channels, bits }) {
    const count = width * height * channels;
    if (bytes.length !== (count * bits) / 8)
        throw new Error(`picture holds ${bytes.length} bytes, not ${(count * bits) / 8}`);
    const wide = bits === 16;
    const out = wide ? new Uint16Array(count) : new Uint8Array(count);
    let i = 0;
    for (let c = 0; c < channels; ++c) {
        let above = 0;
        for (let y = 0; y < height; ++y) {
            let left = above;
            let to = y * width * channels + c;
            for (let x = 0; x < width; ++x, ++i, to += channels) {
                const step = wide ? (bytes[i] << 8) | bytes[count + i] : bytes[i];
                left = wide ? (left + step) & 0xffff : (left + step) & 0xff;
                out[to] = left;
                if (x === 0) above = left;
            }
        }
    }
    return out;
}

const name_of = (kind, variant, frame, map) =>
    [kind, kind === "truth" || kind === "input" ? -1 : variant, frame, map ?? ""].join("/");

export class ImageStore {
    constructor(manifest) {
        this.scales = manifest.scales;  // by the key of an error map: {low, high, log}
        this.entries = new Map();
        for (const entry of manifest.images)
            this.entries.set(name_of(entry.kind, entry.variant, entry.frame, entry.map), entry);
        this.cache = new Map();  // name -> {promise, image, bytes}, oldest use first
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
        const name = name_of(kind, variant, frame, map);
        const held = this.cache.get(name);
        if (!held?.image) return undefined;
        this.cache.delete(name);
        this.cache.set(name, held);
        return held.image;
    }

    // {width, height, channels, bits, data, name}; undefined if there is none.
    async load(kind, variant, frame, map) {
        const name = name_of(kind, variant, frame, map);
        const entry = this.entries.get(name);
        if (!entry) return undefined;
        if (!this.cache.has(name)) {
            const held = { bytes: (entry.width * entry.height * entry.channels * entry.bits) / 8 };
            held.promise = this.#decode(entry, name).then((image) => (held.image = image));
            this.cache.set(name, held);
            held.promise.catch(() => this.cache.delete(name));
            this.#evict();
        }
        return this.cache.get(name).promise;
    }

    async #decode(entry, name) {
        const text = entry.asset ? await this.#asset(entry)
            : document.getElementById(entry.id).textContent;
        return { ...entry, name, data: integrate(await inflate(from_base64(text)), entry) };
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

    #evict() {
        let bytes = 0;
        for (const held of this.cache.values()) bytes += held.bytes;
        for (const [name, held] of this.cache) {
            if (bytes <= kCacheBytes) break;
            if (!held.image) continue;
            bytes -= held.bytes;
            this.cache.delete(name);
        }
    }
}
