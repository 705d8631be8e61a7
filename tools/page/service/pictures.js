// The pictures of the viewer: a job's frames, or previews of the chains A and B. While one preview is
// under way only the newest of those asked for waits.
import { address, getValues, jobPath, preview } from "./api.js";
import { chainOf } from "./chains.js";
import { error_map, kErrorMaps } from "./maps.js";
import { PictureCache } from "../viewer/cache.js";
import { picture_of_file } from "../viewer/picture.js";

const kCacheBytes = 512 * 2 ** 20;
const kMinGap = 150;      // ms between two previews of a chain
const kPatience = 400;      // ms until a newer preview ends one that runs
const kMostPixels = 4096;   // longer side of an image of the service
const kLevels = [0.125, 0.25, 0.5, 1];

// The viewer asks again if it still wants the picture.
class Superseded extends Error {
    retry = true;
}

// Runs one task at a time; of the waiting tasks only the newest.
class Lane {
    #running = null;
    #waiting = null;
    run(task) {
        this.#waiting?.reject(new Superseded());
        return new Promise((resolve, reject) => {
            this.#waiting = { task, resolve, reject };
            this.#begin();
        });
    }
    #begin() {
        if (this.#running) {
            const left = kPatience - (performance.now() - this.#running.since);
            clearTimeout(this.timer);
            this.timer = setTimeout(() => this.#waiting && this.#running?.abort.abort(),
                Math.max(0, left));
            return;
        }
        const mine = this.#waiting;
        if (!mine) return;
        this.#waiting = null;
        const since = performance.now();
        this.#running = { since, abort: new AbortController() };
        mine.task(this.#running.abort.signal).then(mine.resolve, (error) => mine.reject(
            error.name === "AbortError" || error.status === 409 ? new Superseded() : error))
            .finally(() => setTimeout(() => {
                this.#running = null;
                clearTimeout(this.timer);
                this.#begin();
            }, Math.max(0, kMinGap - (performance.now() - since))));
    }
}

export const is_finished = ({ state }) => state === "written" || state === "skipped";
export const is_bad = ({ state }) => state === "quarantined" || state === "missing";

export class Pictures {
    constructor(page) {
        this.page = page;
        this.cache = new PictureCache(kCacheBytes);
        this.lanes = { a: new Lane(), b: new Lane() };
        this.known = false;  // the size of the frames
    }

    /** The part of the frame's size that the screen shows. */
    scale() {
        const { model, viewer } = this.page;
        return Math.min(kLevels.find((v) => v >= Math.min(viewer?.scale() ?? 1, 1) * 0.99) ?? 1,
            kLevels.findLast((v) => v * Math.max(model.width, model.height) <= kMostPixels) ?? kLevels[0]);
    }

    #name(kind, variant, frame, map) {
        const { subject } = this.page.model;
        const of = (one) => (one === "before" ? "" : subject.job ? this.#is_finished(frame)
            : chainOf(one)?.text);
        const names = kind === "error" ? [of(variant), of(this.page.reference(variant))] : [of(kind)];
        return JSON.stringify([subject.name, subject.camera, subject.more?.show, kind, variant ?? "", frame, map ?? "",
            this.scale(), ...names]);
    }

    #is_finished(frame) {
        const entry = this.page.model.subject.frames.find((one) => one.frame === frame);
        return Boolean(entry && is_finished(entry));
    }

    has(kind) { return ["before", "a", "b", "error"].includes(kind); }

    ready(...what) {
        return this.known ? this.cache.ready(this.#name(...what)) : undefined;
    }

    async load(kind, variant, frame, map) {
        if (!this.has(kind)) return undefined;
        const { subject } = this.page.model;
        await this.page.model.sized;
        // Another one is looked at by now.
        if (subject !== this.page.model.subject || !this.known) throw new Superseded();
        return this.cache.load(this.#name(kind, variant, frame, map),
            () => this.#make(kind, variant, frame, map));
    }

    async #make(kind, variant, frame, map) {
        const { subject, width, height } = this.page.model;
        if (kind === "error") {
            const [test, reference] = await Promise.all([this.load(variant, undefined, frame),
                this.load(this.page.reference(variant), undefined, frame)]);
            return error_map(test, reference, kErrorMaps.find((one) => one.key === map));
        }
        const scale = this.scale();
        const side = Math.max(1, Math.round(scale * Math.max(width, height)));
        const query = { type: "values", side };
        if (subject.job)
            return picture_of_file(await getValues(address(`${jobPath(subject.job)}/frames/${frame}/${
                kind === "a" && this.#is_finished(frame) ? "after" : "before"}.png`, query)));
        if (kind === "before")
            return picture_of_file(await getValues(address("v1/image",
                { input: subject.input, frame, ...query })));
        const body = { ...subject.more?.show, input: subject.input, frame, ...(subject.camera && { camera: subject.camera }) };
        const chain_text = chainOf(kind).text;
        const begun = performance.now();
        const file = await this.lanes[kind].run((signal) =>
            preview({ ...body, chain_text, scale }, kind, signal));
        this.page.previewed?.(kind, performance.now() - begun, scale);
        return picture_of_file(file);
    }
}
