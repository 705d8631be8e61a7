// Decoded pictures by name, up to a number of bytes; those used longest ago go first.
export class PictureCache {
    #held = new Map();  // name -> {promise, image, bytes}, oldest use first
    #limit;
    constructor(limit) { this.#limit = limit; }

    /** The picture if it is decoded, otherwise undefined. */
    ready(name) {
        const held = this.#held.get(name);
        if (!held?.image) return undefined;
        this.#held.delete(name);
        this.#held.set(name, held);
        return held.image;
    }

    /** A promise of the picture with its name. make: called if it is neither held nor under way. */
    load(name, make) {
        if (!this.#held.has(name)) {
            const held = { bytes: 0 };
            held.promise = make().then((image) => {
                held.bytes = image.data.byteLength;
                this.#evict();
                return (held.image = { ...image, name });
            });
            this.#held.set(name, held);
            held.promise.catch(() => this.#held.delete(name));
        }
        return this.#held.get(name).promise;
    }

    #evict() {
        let bytes = 0;
        for (const held of this.#held.values()) bytes += held.bytes;
        for (const [name, held] of this.#held) {
            if (bytes <= this.#limit) break;
            if (!held.image) continue;
            bytes -= held.bytes;
            this.#held.delete(name);
        }
    }
}
