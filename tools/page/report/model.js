// The report in the form of the page: report.json (docs/report.md) and the list of pictures.
import { is_better } from "../shared/words.js";
import { kMaps, kTones } from "../viewer/tone.js";

const kMapNames = { hdr_flip: "HDR-FLIP", flip: "FLIP", relmse: "relMSE", smape: "SMAPE",
    mse: "MSE", psnr: "PSNR", ssim: "SSIM", tde: "TDE",
    relmse_trimmed: "relMSE trimmed", nonfinite: "non-finite pixels" };
export const metric_name = (key) => kMapNames[key] ?? key.replaceAll("_", " ");

// Short names: "samples=5, preset=39" for "motion_blur.samples=5, fxaa.preset=39" if the last parts
// of all swept keys differ.
function names_of(variants) {
    const last = (key) => key.split(".").at(-1);
    const keys = [...new Set(variants.flatMap((v) => Object.keys(v.sweep)))];
    const unique = new Set(keys.map(last)).size === keys.length;
    const names = variants.map(({ name, sweep }) => (unique && Object.keys(sweep).length
        ? Object.entries(sweep).map(([key, value]) => `${last(key)}=${value}`).join(", ") : name));
    return new Set(names).size === names.length ? names : variants.map((v) => v.name);
}

export function model_of(report, store) {
    const model = { ...report };
    const frames_with = (kind, variant) =>
        report.page_frames.filter((frame) => store.has(kind, variant, frame));

    const names = names_of(report.variants);

    // Sources of the canvas, in the order of the list. key: as in the address; digit: the key of
    // the keyboard; frames: frames with a picture.
    model.sources = report.variants.map((variant, index) => ({
        key: String(index + 1), kind: "color", variant: index, name: names[index],
        digit: index < 9 ? String(index + 1) : "", data: variant,
        frames: frames_with("color", index),
    }));
    const truth_frames = frames_with("truth", -1);
    if (truth_frames.length)
        model.sources.unshift({ key: "truth", kind: "truth", variant: -1, name: "Truth",
            digit: "0", frames: truth_frames });
    const input_frames = frames_with("input", -1);
    if (input_frames.length)
        model.sources.push({ key: "input", kind: "input", variant: -1, name: "Input", digit: "I",
            frames: input_frames,
            // Scored with ground truth only.
            data: report.input_metrics ? { metrics: report.input_metrics } : undefined });
    // Names of variants are shortened.
    model.left_out = report.left_out.map((row) => ({ ...row, variant:
        names[report.variants.findIndex((v) => v.name === row.variant)] ?? row.variant }));
    model.crops = report.crops.map((crop) => {
        const variant = report.variants.findIndex((v) => crop.why.startsWith(`${v.name}: `));
        return variant < 0 ? crop : { ...crop,
            why: names[variant] + crop.why.slice(report.variants[variant].name.length) };
    });
    model.source = (key) => model.sources.find((s) => s.key === key);
    model.variant_sources = model.sources.filter((s) => s.kind === "color");
    model.scored_sources = model.sources.filter((s) => s.data?.metrics);
    // [kind, variant, frame, map] of an error map for ImageStore. The truth has none; variant -1 is
    // the input.
    model.error_map = (source, frame, map) =>
        [source.kind === "truth" ? "none" : "error", source.variant, frame, map];

    // The reference of metrics and error maps (docs/report.md): without ground truth two chains are
    // compared with each other.
    model.reference_kind = report.reference;
    model.measure = report.reference === "a" ? "difference" : "error";
    const kept = store.maps();
    model.maps = kMaps.filter(({ key }) => kept.includes(key))
        .map((map) => ({ name: metric_name(map.key), ...map, ...store.scales[map.key] }));
    model.compared = { truth: "truth", a: report.variants[0]?.name,
        converged: "itself converged" }[report.reference] ?? "truth";
    model.tones = kTones.map((t) => t.key);

    model.metrics = report.metrics.filter((m) => report.variants.some(
        (v) => Number.isFinite(v.metrics?.[m.name]?.mean)));
    model.metric = (name) => model.metrics.find((m) => m.name === name);
    model.mean = (variant, name) => variant.metrics?.[name]?.mean ?? undefined;
    // Is a variant's mean worse than that of the unfiltered input? relMSE cannot say it: see
    // kRelMse in panel.js.
    model.is_relative = (name) => name.startsWith("relmse");
    model.is_worse = (variant, name) => {
        if (model.is_relative(name)) return false;
        const [mean, input] = [model.mean(variant, name),
            report.input_metrics?.[name]?.mean ?? undefined];
        return mean !== undefined && input !== undefined &&
            is_better(model.metric(name)?.better, input, mean);
    };
    model.time = (variant) => variant.timing?.total?.median_ms ?? undefined;
    return model;
}

// Indices into points ({time, error}) that no other beats in both time and error, by time.
export function pareto_of(points, better) {
    const beats = (a, b) =>
        (a.time < b.time && !is_better(better, b.error, a.error)) ||
        (a.time === b.time && is_better(better, a.error, b.error));
    return points.map((_, i) => i)
        .filter((i) => !points.some((other) => beats(other, points[i])))
        .sort((i, j) => points[i].time - points[j].time);
}
