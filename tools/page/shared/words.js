// Numbers, times and metrics in words.

// `digits` significant digits, no longer than a column: "0.123", "1.23e-7", "12 300".
export function number(v, digits = 3) {
    if (v === null || v === undefined) return "\u2013";
    if (!Number.isFinite(v)) return Number.isNaN(v) ? "NaN" : v > 0 ? "\u221e" : "\u2212\u221e";
    if (v === 0) return "0";
    const size = Math.abs(v);
    const text = size >= 1e5 || size < 1e-3 ? size.toExponential(digits - 1).replace("e+", "e")
        : size >= 10 ** digits ? size.toFixed(0)
            : size.toPrecision(digits);
    return (v < 0 ? "\u2212" : "") + text.replace("e-", "e\u2212");
}

// A count with the prefix of its size: "2.30 kB", "5.18 k", "144".
export function short(v, unit = "") {
    const step = v < 1000 ? 0 : Math.min(4, Math.floor(Math.log10(v) / 3));
    const text = step ? number(v / 1000 ** step) : String(v);
    const suffix = ["", "k", "M", "G", "T"][step] + unit;
    return suffix ? `${text}\u2009${suffix}` : text;
}

// A difference: always with its sign.
export const signed = (v) => (v > 0 ? "+" : "") + number(v);

// "1 frame", "2 frames"
export const counted = (n, noun) => `${n} ${noun}${n === 1 ? "" : "s"}`;

export const milliseconds = (v) => (v === undefined || v === null ? "\u2013"
    : v >= 1e4 ? `${number(v / 1000)} s` : `${number(v)} ms`);

export function duration(seconds) {
    if (seconds < 60) return `${Math.max(1, Math.round(seconds))} s`;
    if (seconds < 3600) return `${Math.round(seconds / 60)} min`;
    return `${Math.floor(seconds / 3600)} h ${Math.round((seconds % 3600) / 60)} min`;
}

// "14:03" of today, otherwise with its date.
export function clock(text) {
    const time = new Date(text);
    const today = time.toDateString() === new Date().toDateString();
    return time.toLocaleString([], today ? { hour: "2-digit", minute: "2-digit" }
        : { month: "short", day: "numeric", hour: "2-digit", minute: "2-digit" });
}

// "1-3, 5"
export function ranges(frames) {
    const parts = [];
    for (const frame of frames) {
        const last = parts.at(-1);
        if (last && last[1] === frame - 1) last[1] = frame;
        else parts.push([frame, frame]);
    }
    return parts.map(([from, to]) => (from === to ? `${from}` : `${from}-${to}`)).join(", ");
}

// Which way a metric is better.
const kWays = { lower: "lower is better", higher: "higher is better", one: "best at 1" };
const kLikeness = { lower: "lower is more alike", higher: "higher is more alike", one: "alike at 1" };
// `reference` of a report: against its first chain ("a") no way is better.
export const way_of = (metric, reference) =>
    (reference === "a" ? kLikeness : kWays)[metric?.better] ?? "";

// True when a is better than b.
export function is_better(better, a, b) {
    if (better === "higher") return a > b;
    if (better === "one") return Math.abs(a - 1) < Math.abs(b - 1);
    return a < b;
}
