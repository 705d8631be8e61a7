// How linear values become colors: the tone curves of the picture (view.frag has the same for the
// GPU) and the scales of the error maps. The scales are the same for every variant, frame and
// report, so that two pages can be compared side by side.
import { limit } from "../shared/dom.js";

const kHalfToFloat = new Float32Array(65536);
for (let bits = 0; bits < 65536; ++bits) {
    const sign = bits & 0x8000 ? -1 : 1;
    const exponent = (bits >> 10) & 31;
    const fraction = bits & 1023;
    kHalfToFloat[bits] = exponent === 31 ? (fraction ? NaN : sign * Infinity)
        : exponent === 0 ? sign * fraction * 2 ** -24
            : sign * (1 + fraction / 1024) * 2 ** (exponent - 15);
}

// Float of an IEEE 754 binary16 pattern.
export const half_to_float = (bits) => kHalfToFloat[bits];

const srgb = (v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);
const unit = (v) => limit(v, 0, 1);

// Index = `tone` of view.frag. Arguments: linear value times 2^EV, not negative; result 0..1.
export const kTones = [
    {
        key: "display", name: "Soft (Reinhard)",
        help: "highlights roll off gently; the display transform of PSNR and SSIM: (x/(1+x))^(1/2.2)",
        curve: (x) => (x === Infinity ? 1 : (x / (1 + x)) ** (1 / 2.2)),
    },
    {
        key: "aces", name: "Filmic (ACES)",
        help: "contrast as of film; the tone mapper of HDR-FLIP (Narkowicz' fit of ACES), then sRGB",
        curve: (x) => {
            const v = 0.6 * Math.min(x, 1e6);
            return srgb(unit((v * (2.51 * v + 0.03)) / (v * (2.43 * v + 0.59) + 0.14)));
        },
    },
    { key: "srgb", name: "None (sRGB)", help: "no tone curve: sRGB, clipped at 1",
        curve: (x) => srgb(unit(x)) },
];

// 8-bit value of each half pattern: what a channel shows at this exposure.
export function tone_table(tone, ev) {
    const table = new Uint8Array(65536);
    const gain = 2 ** ev;
    for (let bits = 0; bits < 65536; ++bits) {
        const v = kHalfToFloat[bits];
        table[bits] = Math.round(255 * kTones[tone].curve(Math.max(0, v) * gain));
    }
    return table;  // NaN: 0
}

// Error maps in the order of the list. They are made with the report, and so are their scales, of
// which those of FLIP are 0 to 1. Formulas: docs/metrics.md.
export const kMaps = [
    { key: "hdr_flip", low: 0, high: 1, help: "the largest FLIP over the report's exposures" },
    { key: "flip", low: 0, high: 1, help: "of linear values clamped to 0..1" },
    { key: "relmse", help: "relative squared error, mean over RGB" },
    { key: "smape", help: "symmetric relative error, mean over RGB" },
    { key: "difference", name: "Difference", help: "largest difference of RGB, linear radiance" },
];

// The error at a place (0..1) of a scale. At the lower end of a logarithmic scale it is 0 or too
// small for the scale.
export function error_of(place, { low, high, log }) {
    if (!log) return low + (high - low) * place;
    return place > 0 ? low * (high / low) ** place : 0;
}
