// Draws a view with the 2D canvas: the crops, and the picture if there is no WebGL2.
import { kMagma } from "./magma.js";
import { half_to_float, tone_table } from "./tone.js";

let table_key = "";
let table;
function tones(tone, ev) {
    const key = `${tone}/${ev}`;
    if (key !== table_key) {
        table_key = key;
        table = tone_table(tone, ev);
    }
    return table;
}

const is_nan = (bits) => (bits & 0x7c00) === 0x7c00 && (bits & 0x3ff) !== 0;

// Linear RGB of a pixel.
export function rgb_at(image, x, y) {
    const at = 3 * (y * image.width + x);
    return [0, 1, 2].map((c) => half_to_float(image.data[at + c]));
}

// Place (0..1) of a pixel's error on the scale of its map; undefined without a map.
export const place_at = (map, x, y) => map && map.data[y * map.width + x] / 255;

// Taps a side of a device pixel. Whole and large scales show pixels as they are; between, edges of
// pixels are smoothed; small scales take what falls into the device pixel.
export function taps_of(scale) {
    if (scale < 1) return Math.min(Math.ceil(1 / scale), 4);
    return scale >= 4 || Number.isInteger(scale) ? 1 : 2;
}

// Fills `out` (RGBA of width x height) with the view, whose members are those of GlView.draw, with
// `ev` beside gain.
export function render(view, out, width, height) {
    const { scale } = view;
    const [w, h] = view.size;
    const lookup = tones(view.tone, view.ev);
    // The index of the pixel of a picture that covers a place of the frame.
    const clamp = (v, size, frame) =>
        Math.min(Math.max(Math.floor((v * size) / frame), 0), size - 1);
    const texel = ({ width, height }, x, y) =>
        clamp(y, height, h) * width + clamp(x, width, w);
    const pixel = (image, x, y, sum) => {
        if (view.error) {
            const at = 4 * view.error.data[texel(view.error, x, y)];
            for (let c = 0; c < 3; ++c) sum[c] += kMagma[at + c];
            return;
        }
        const at = 3 * texel(image, x, y);
        const [r, g, b] = [image.data[at], image.data[at + 1], image.data[at + 2]];
        const bad = is_nan(r) || is_nan(g) || is_nan(b);
        sum[0] += bad ? 255 : lookup[r];
        sum[1] += bad ? 0 : lookup[g];
        sum[2] += bad ? 255 : lookup[b];
    };
    const n = taps_of(scale);
    const taps = Array.from({ length: n }, (_, i) => ((i + 0.5) / n - 0.5) / scale);
    const background = view.background.map((v) => Math.round(255 * v));
    const sum = [0, 0, 0];
    for (let y = 0, to = 0; y < height; ++y) {
        const at_y = (y + 0.5 - height / 2) / scale + view.center[1];
        for (let x = 0; x < width; ++x, to += 4) {
            const at_x = (x + 0.5 - width / 2) / scale + view.center[0];
            out[to + 3] = 255;
            if (at_x < 0 || at_y < 0 || at_x >= w || at_y >= h) {
                for (let c = 0; c < 3; ++c) out[to + c] = background[c];
                continue;
            }
            sum[0] = sum[1] = sum[2] = 0;
            for (const dy of taps)
                for (const dx of taps)
                    pixel(x + 0.5 < view.split ? view.other : view.image, at_x + dx, at_y + dy, sum);
            for (let c = 0; c < 3; ++c) out[to + c] = Math.round(sum[c] / (n * n));
            if (view.grid && Math.min(at_x % 1, at_y % 1) * scale < 1) {
                const light = (0.3 * out[to] + 0.6 * out[to + 1] + 0.1 * out[to + 2]) / 255;
                for (let c = 0; c < 3; ++c)
                    out[to + c] = Math.round(0.78 * out[to + c] + (light > 0.45 ? 0 : 0.22 * 255));
            }
        }
    }
}

export class CpuView {
    constructor(canvas) {
        this.name = "2D canvas";
        this.context = canvas.getContext("2d", { alpha: false, willReadFrequently: true });
    }

    draw(view) {
        const { width, height } = this.context.canvas;
        const pixels = this.context.createImageData(width, height);
        render(view, pixels.data, width, height);
        this.context.putImageData(pixels, 0, 0);
    }

    read(x, y) { return [...this.context.getImageData(x, y, 1, 1).data.slice(0, 3)]; }
}
