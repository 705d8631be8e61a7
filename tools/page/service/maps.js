// Error maps between two pictures on the scales of reports (docs/metrics.md).
import { half_to_float } from "../viewer/tone.js";

const mean_of = (f) => (a, b) => (f(a[0], b[0]) + f(a[1], b[1]) + f(a[2], b[2])) / 3;

export const kErrorMaps = [
    { key: "difference", name: "Difference", low: 1e-3, high: 10, log: true,
        help: "largest difference of RGB, linear radiance",
        of: (a, b) => Math.max(Math.abs(a[0] - b[0]), Math.abs(a[1] - b[1]),
            Math.abs(a[2] - b[2])) },
    { key: "relmse", name: "relMSE", low: 1e-4, high: 10, log: true,
        help: "relative squared error, mean over RGB",
        of: mean_of((x, y) => ((x - y) / (Math.abs(y) + 0.01)) ** 2) },
    { key: "smape", name: "SMAPE", low: 0, high: 2, log: false,
        help: "symmetric relative error, mean over RGB",
        of: mean_of((x, y) => (2 * Math.abs(x - y)) / (Math.abs(x) + Math.abs(y) + 0.02)) },
];

/** Places 0..1 on the scale, in 255 steps; 1 where a value is not finite. */
export function error_map(test, reference, { of, low, high, log }) {
    const { width, height } = test;
    const data = new Uint8Array(width * height);
    const a = [0, 0, 0], b = [0, 0, 0];
    for (let y = 0, i = 0; y < height; ++y) {
        const row = Math.min(Math.floor(((y + 0.5) * reference.height) / height), reference.height - 1);
        for (let x = 0; x < width; ++x, ++i) {
            const j = row * reference.width
                + Math.min(Math.floor(((x + 0.5) * reference.width) / width), reference.width - 1);
            for (let c = 0; c < 3; ++c) {
                a[c] = half_to_float(test.data[3 * i + c]);
                b[c] = half_to_float(reference.data[3 * j + c]);
            }
            const error = of(a, b);
            const place = log ? Math.log(Math.max(error, 1e-30) / low) / Math.log(high / low)
                : (error - low) / (high - low);
            data[i] = Number.isNaN(place) ? 255 : Math.round(255 * Math.min(Math.max(place, 0), 1));
        }
    }
    return { width, height, channels: 1, bits: 8, data };
}
