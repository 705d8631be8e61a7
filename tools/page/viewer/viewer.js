// The canvas: every picture in place, zoom and drag, the cursor, choosing a region.
import { color_of, limit } from "../shared/dom.js";
import { CpuView, place_at, rgb_at } from "./cpu_view.js";
import { GlView } from "./gl_view.js";
import { kTones } from "./tone.js";

// Steps of the zoom, device pixels per picture pixel.
const kLadder = [0.0625, 0.125, 0.25, 0.33, 0.5, 0.67, 1, 1.5, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48,
    64];
const kGridFrom = 8;      // device pixels per picture pixel
const kWheelStep = 60;    // wheel event's deltaY for one step of the ladder
const kMinCrop = 4;     // picture pixels

function background_of() {
    const text = color_of("matte");
    return [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16) / 255);
}

export class Viewer {
    // on: {cursor({x, y} or undefined), drawn(), held(), busy(bool), choosing(box or
    // undefined), crop(box)}; a box is {x, y, width, height} in picture pixels
    constructor(canvas, model, store, state, on) {
        Object.assign(this, { canvas, model, store, state, on });
        this.holding = false;  // D is down
        this.painter = new URLSearchParams(location.search).get("renderer") === "2d"
            ? undefined : GlView.create(canvas, Math.max(model.width, model.height));
        if (!this.painter) {
            // A canvas that once had a WebGL context cannot have another.
            const fresh = canvas.cloneNode();
            canvas.replaceWith(fresh);
            this.canvas = fresh;
            this.painter = new CpuView(fresh);
        }
        this.painter.on_restored = () => this.draw();
        this.#follow_size();
        this.#follow_pointer();
        state.watch(["show", "frame", "map", "pin"], () => this.load());
        // Moving the line loads nothing.
        state.watch(["wipe", "last"], () => {
            if (this.wiped()?.key !== this.left) this.load();
            this.draw();
        });
        state.watch(["ev", "tone", "zoom", "x", "y"], () => this.draw());
    }

    // The map now on the canvas, or undefined.
    map() {
        if (!this.holding && !this.state.get("pin")) return undefined;
        return this.model.maps.find((m) => m.key === this.state.get("map"));
    }

    // The source left of the line, or undefined: no wipe.
    wiped() {
        const last = this.model.source(this.state.get("last"));
        return this.state.get("wipe") && last && !this.map() && last.key !== this.state.get("show")
            && last.frames.includes(this.state.get("frame")) ? last : undefined;
    }

    hold(on) {
        if (this.holding === on) return;
        this.holding = on;
        this.load();
        this.on.held();
    }

    // [kind, variant, frame, map] of the pictures that the view needs.
    #wanted(source, frame) {
        const list = { image: [source.kind, source.variant, frame] };
        const map = this.map();
        const wiped = this.wiped();
        if (wiped) list.other = [wiped.kind, wiped.variant, frame];
        if (map) list.error = this.model.error_map(source, frame, map.key);
        return list;
    }

    // Shows the source and frame of the state, as soon as they are decoded.
    load() {
        const source = this.model.source(this.state.get("show"));
        const frame = this.state.get("frame");
        this.left = this.wiped()?.key;
        this.missing = undefined;
        if (!source?.frames.includes(frame)) {
            this.missing = source?.data?.failure ? `${source.name} failed: ${source.data.failure}`
                : "No picture of this frame is kept.";
            this.ticket = undefined;
            this.on.busy(false);
            this.shown = undefined;
            this.draw();
            return Promise.resolve();
        }
        const wanted = this.#wanted(source, frame);
        const map = this.map();
        const parts = Object.entries(wanted);
        const ready = parts.map(([, name]) => this.store.ready(...name));
        const show = (images) => {
            this.shown = { source, frame, map };
            parts.forEach(([part], i) => (this.shown[part] = images[i]));
            // A picture without a map, like the truth, is shown itself.
            if (map && !this.shown.error) {
                this.shown.map = undefined;
                this.shown.no_map = true;
            }
            this.on.busy(false);
            this.draw();
        };
        const all_here = parts.every(([, name], i) => ready[i] || !this.store.has(...name));
        const ticket = (this.ticket = {});
        if (all_here) {
            show(ready);
            this.loaded = Promise.resolve();
        } else {
            this.on.busy(true);
            // The other half of a wipe may fail: then there is no wipe.
            const forgive = (error) => (error.retry ? Promise.reject(error) : undefined);
            this.loaded = Promise.all(parts.map(([part, name]) => this.store.load(...name)
                .catch(part === "other" ? forgive : (error) => Promise.reject(error)))).then(
                (images) => this.ticket === ticket && show(images),
                (error) => {
                    if (this.ticket !== ticket) return undefined;
                    if (error.retry) return this.load();
                    this.on.busy(false);
                    this.missing = error.message;
                    this.shown = undefined;
                    return this.draw();
                });
        }
        return this.loaded;
    }

    // Device pixels per picture pixel.
    scale() { return this.state.get("zoom") || this.fit(); }
    fit() {
        const { width, height } = this.canvas;
        return Math.min(width / this.model.width, height / this.model.height);
    }
    center() {
        return this.state.get("zoom") ? [this.state.get("x"), this.state.get("y")]
            : [this.model.width / 2, this.model.height / 2];
    }

    view() {
        const ev = this.state.get("ev");
        return {
            ...this.shown, center: this.center(), scale: this.scale(), ev, gain: 2 ** ev,
            tone: kTones.findIndex((t) => t.key === this.state.get("tone")),
            background: background_of(), grid: this.scale() >= kGridFrom,
            size: [this.model.width, this.model.height],
            split: this.shown?.other ? this.state.get("wipe") * this.canvas.width : 0,
        };
    }

    draw() {
        if (this.pending) return;
        this.pending = requestAnimationFrame(() => this.draw_now());
    }
    draw_now() {
        cancelAnimationFrame(this.pending);
        this.pending = undefined;
        if (this.shown) this.painter.draw(this.view());
        this.on.drawn();
    }

    // Picture coordinates of a place in CSS pixels from the canvas' corner, and back.
    to_picture(x, y) {
        const [cx, cy] = this.center();
        const density = this.canvas.width / this.canvas.clientWidth;
        return [(x * density - this.canvas.width / 2) / this.scale() + cx,
            (y * density - this.canvas.height / 2) / this.scale() + cy];
    }
    from_picture(x, y) {
        const [cx, cy] = this.center();
        const density = this.canvas.width / this.canvas.clientWidth;
        return [((x - cx) * this.scale() + this.canvas.width / 2) / density,
            ((y - cy) * this.scale() + this.canvas.height / 2) / density];
    }

    // Zooms to the next step of the ladder; the point at (x, y), CSS pixels, stays.
    zoom_by(steps, x = this.canvas.clientWidth / 2, y = this.canvas.clientHeight / 2) {
        const now = this.scale();
        const next = steps > 0 ? kLadder.find((z) => z > now * 1.001)
            : kLadder.findLast((z) => z < now * 0.999);
        if (!next) return;
        if (next <= this.fit() && steps < 0) return this.zoom_fit();
        const [px, py] = this.to_picture(x, y);
        const [cx, cy] = this.center();
        this.move(next, px + (cx - px) * (now / next), py + (cy - py) * (now / next));
    }
    zoom_to(zoom) {
        const [cx, cy] = this.center();
        this.move(zoom, cx, cy);
    }
    zoom_fit() { this.state.set({ zoom: 0, x: 0, y: 0 }); }
    move(zoom, x, y) {
        this.state.set({
            zoom, x: limit(x, 0, this.model.width), y: limit(y, 0, this.model.height),
        });
    }
    // Centers a region of the picture, as large as it fits.
    show_region({ x, y, width, height }) {
        const room = Math.min(this.canvas.width / width, this.canvas.height / height);
        const zoom = kLadder.findLast((z) => z <= room) ?? kLadder[0];
        this.move(zoom, x + width / 2, y + height / 2);
    }

    #follow_size() {
        new ResizeObserver(() => {
            const width = Math.max(1, Math.round(this.canvas.clientWidth * devicePixelRatio));
            const height = Math.max(1, Math.round(this.canvas.clientHeight * devicePixelRatio));
            if (width !== this.canvas.width || height !== this.canvas.height) {
                this.canvas.width = width;
                this.canvas.height = height;
            }
            this.draw_now();
        }).observe(this.canvas);
    }

    point_at(pixel) {
        this.cursor = pixel;
        this.on.cursor(pixel);
    }

    #follow_pointer() {
        const canvas = this.canvas;
        let drag;
        const place = (event) => {
            const box = canvas.getBoundingClientRect();
            return [event.clientX - box.left, event.clientY - box.top];
        };
        const inside = ([x, y]) => {
            const pixel = { x: Math.floor(x), y: Math.floor(y) };
            return pixel.x >= 0 && pixel.y >= 0 && pixel.x < this.model.width &&
                pixel.y < this.model.height ? pixel : undefined;
        };
        canvas.addEventListener("pointerdown", (event) => {
            if (event.button !== 0) return;
            canvas.setPointerCapture(event.pointerId);
            drag = { at: place(event), center: this.center(), scale: this.scale(),
                crop: event.shiftKey && this.on.crop };
        });
        canvas.addEventListener("pointermove", (event) => {
            const at = place(event);
            if (!drag) return this.point_at(inside(this.to_picture(...at)));
            if (drag.crop) return this.on.choosing(this.#box(drag.at, at));
            const density = canvas.width / canvas.clientWidth;
            const [dx, dy] = [at[0] - drag.at[0], at[1] - drag.at[1]];
            if (!drag.moved && Math.hypot(dx, dy) < 3) return undefined;
            drag.moved = true;
            canvas.classList.add("dragging");
            return this.move(drag.scale, drag.center[0] - (dx * density) / drag.scale,
                drag.center[1] - (dy * density) / drag.scale);
        });
        const end = (event) => {
            if (drag?.crop) {
                this.on.choosing(undefined);
                const box = this.#box(drag.at, place(event));
                if (event.type === "pointerup" &&
                    Math.min(box.width, box.height) >= kMinCrop)
                    this.on.crop(box);
            }
            drag = undefined;
            canvas.classList.remove("dragging");
        };
        canvas.addEventListener("pointerup", end);
        canvas.addEventListener("pointercancel", end);
        canvas.addEventListener("pointerleave", () => drag || this.point_at(undefined));
        let wheel = 0;
        canvas.addEventListener("wheel", (event) => {
            event.preventDefault();
            const unit = event.deltaMode === 1 ? 20 : event.deltaMode === 2 ? 400 : 1;
            wheel -= event.deltaY * unit;
            while (Math.abs(wheel) >= kWheelStep) {
                this.zoom_by(Math.sign(wheel), ...place(event));
                wheel -= Math.sign(wheel) * kWheelStep;
            }
        }, { passive: false });
        canvas.addEventListener("dblclick", () => this.zoom_fit());
    }

    // The whole pixels between two places of the canvas, inside the picture.
    #box(from, to) {
        const [a, b] = [this.to_picture(...from), this.to_picture(...to)];
        const low = [0, 1].map((i) => Math.max(0, Math.floor(Math.min(a[i], b[i]))));
        const size = [this.model.width, this.model.height];
        const high = [0, 1].map((i) => Math.min(size[i], Math.ceil(Math.max(a[i], b[i]))));
        return { x: low[0], y: low[1], width: Math.max(0, high[0] - low[0]),
            height: Math.max(0, high[1] - low[1]) };
    }

    // Values of a source at a pixel: {rgb, place of its error on the map's scale}, once decoded.
    values(source, { x, y }, map) {
        const frame = this.state.get("frame");
        const image = this.store.ready(source.kind, source.variant, frame);
        if (!image) return undefined;
        return {
            rgb: rgb_at(image, ...this.texel(image, x, y)),
            place: map && this.place_on_map(
                this.store.ready(...this.model.error_map(source, frame, map.key)), x, y),
        };
    }

    // A picture may be smaller than the frame: a draft.
    texel(image, x, y) {
        const at = (v, size, frame) => Math.min(Math.floor(((v + 0.5) * size) / frame), size - 1);
        return [at(x, image.width, this.model.width), at(y, image.height, this.model.height)];
    }
    place_on_map(map, x, y) { return map && place_at(map, ...this.texel(map, x, y)); }

    // RGB (0..255) of the canvas at the center of a pixel of the picture.
    read(x, y) {
        this.draw_now();
        const density = this.canvas.width / this.canvas.clientWidth;
        const [left, top] = this.from_picture(x + 0.5, y + 0.5);
        return this.painter.read(Math.floor(left * density), Math.floor(top * density));
    }
}
