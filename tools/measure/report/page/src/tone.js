// How linear values become colors: the tone curves of the picture, the error maps and their
// scales. view.frag holds the same formulas for the GPU.
//
// The error maps have fixed scales, the same for every variant, frame and report, so that two
// pages can be laid side by side. Formulas and epsilons: docs/metrics.md.

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
const limit = (v) => Math.min(Math.max(v, 0), 1);

// Index = `tone` of view.frag. Arguments: linear value times 2^EV, not negative; result 0..1.
export const kTones = [
    {
        key: "display", name: "x/(1+x), \u03b3 2.2",
        help: "the display transform of PSNR and SSIM: (x/(1+x))^(1/2.2)",
        curve: (x) => (x === Infinity ? 1 : (x / (1 + x)) ** (1 / 2.2)),
    },
    {
        key: "aces", name: "ACES",
        help: "the tone mapper of HDR-FLIP (Narkowicz' fit of ACES), then sRGB",
        curve: (x) => {
            const v = 0.6 * Math.min(x, 1e6);
            return srgb(limit((v * (2.51 * v + 0.03)) / (v * (2.43 * v + 0.59) + 0.14)));
        },
    },
    { key: "srgb", name: "sRGB, clipped", help: "no tone mapping: sRGB, clipped at 1",
        curve: (x) => srgb(limit(x)) },
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

// relMSE, SMAPE and the difference follow from the pixels; index = `formula` of view.frag, where 0
// is a stored map. Scales are logarithmic where values span decades.
export const kFormulas = [
    {
        key: "relmse", name: "relMSE", formula: 1, low: 1e-4, high: 10, log: true,
        help: "mean over RGB of (I-R)\u00b2 / (|R| + 0.01)\u00b2",
        error: (i, r) => mean((c) => (i[c] - r[c]) ** 2 / (Math.abs(r[c]) + 0.01) ** 2),
    },
    {
        key: "smape", name: "SMAPE", formula: 2, low: 0, high: 2, log: false,
        help: "mean over RGB of 2|I-R| / (|I| + |R| + 0.02)",
        error: (i, r) => mean((c) =>
            (2 * Math.abs(i[c] - r[c])) / (Math.abs(i[c]) + Math.abs(r[c]) + 0.02)),
    },
    {
        key: "difference", name: "Difference", formula: 3, low: 1e-3, high: 10, log: true,
        help: "largest |I-R| of RGB, linear radiance",
        error: (i, r) => Math.max(...[0, 1, 2].map((c) => Math.abs(i[c] - r[c]))),
    },
];
const mean = (f) => (f(0) + f(1) + f(2)) / 3;

// Maps made with the report. FLIP values are 0..1 by definition.
export const kStoredScale = { formula: 0, low: 0, high: 1, log: false };
export const kStoredHelp = {
    hdr_flip: "the largest FLIP over the report's exposures; made with the report",
    flip: "of linear values clamped to 0..1; made with the report",
};

// Where a value lies on its scale, 0..1.
export function place_on_scale(v, scale) {
    const t = scale.log ? Math.log(v / scale.low) / Math.log(scale.high / scale.low)
        : (v - scale.low) / (scale.high - scale.low);
    return limit(Number.isNaN(t) ? 1 : t);
}
