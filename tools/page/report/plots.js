// Error against time, and error over frames, drawn with uPlot.
import { color_of, h, limit } from "../shared/dom.js";
import { milliseconds, number, way_of } from "../shared/words.js";
import { metric_name, pareto_of } from "./model.js";
import { section } from "./panel.js";

const kReach = 28;   // CSS pixels a click may miss a point by
const kFont = "12px system-ui, sans-serif";

// Ticks of a logarithmic axis: 1, 2, 5 of each decade, or evenly spaced if these are too few.
function log_ticks(low, high) {
    const ticks = [];
    for (let decade = Math.floor(Math.log10(low)); decade <= Math.log10(high); ++decade)
        for (const step of high / low > 300 ? [1] : [1, 2, 5]) {
            const v = Number((step * 10 ** decade).toPrecision(1));
            if (v >= low && v <= high) ticks.push(v);
        }
    return ticks.length >= 3 ? ticks : even_ticks(low, high);
}
function even_ticks(low, high) {
    const rough = (high - low) / 5;
    const decade = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((s) => s * decade).find((s) => s >= rough);
    const ticks = [];
    for (let i = Math.ceil(low / step); i * step <= high; ++i)
        ticks.push(Number((i * step).toPrecision(6)));
    return ticks;
}

const tick_text = (v) => (v && (Math.abs(v) < 1e-3 || Math.abs(v) >= 1e5) ? number(v, 1)
    : String(Number(v.toPrecision(3))));

// {scale, axis} of uPlot for values; logarithmic if `log` and all are positive.
function axis_of(values, log, label, size) {
    log = log && values.every((v) => v > 0);
    const [low, high] = [Math.min(...values), Math.max(...values)];
    const pad = log ? Math.max((high / low) ** 0.12, 1.02)
        : (high - low) * 0.08 || Math.abs(high) * 0.1 || 1;
    const range = log ? [low / pad, high * pad] : [low - pad, high + pad];
    return {
        scale: { time: false, distr: log ? 3 : 1, range: () => range },
        axis: {
            label: `${label}${log ? ", log" : ""}`, size, labelSize: 18, font: kFont,
            labelFont: kFont,
            stroke: () => color_of("quiet"), grid: { stroke: () => color_of("grid"), width: 1 },
            ticks: { stroke: () => color_of("line"), width: 1, size: 5 },
            splits: () => (log ? log_ticks : even_ticks)(...range),
            filter: (_, splits) => splits, values: (_, splits) => splits.map(tick_text),
        },
    };
}

// Keeps a plot as wide as its box, and in the colors of the scheme.
function keep_fresh(box, get_plot) {
    new ResizeObserver(() => {
        const plot = get_plot();
        if (plot && box.clientWidth)
            plot.setSize({ width: box.clientWidth, height: box.clientHeight });
    }).observe(box);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () =>
        get_plot()?.redraw(false));
}

// One point of the plot in device pixels.
function place_of(plot, x, y) {
    return [plot.valToPos(x, "x", true), plot.valToPos(y, "y", true)];
}

export function add_pareto(page, more) {
    const { model, state } = page;
    // The first of two variants as reference has no error.
    if (model.reference_kind === "a") return;
    if (!model.variant_sources.some((s) => model.time(s.data) !== undefined)) return;
    const box = h("div", { class: "plot pareto", tabindex: "0", role: "img" });
    const tip = h("div", { class: "tip", hidden: true });
    const about = h("p", { class: "about" });
    more.append(section("panel", "Error against time", about, box));
    let plot;
    let points = [];
    let front = [];

    function draw(u) {
        const c = u.ctx;
        const density = devicePixelRatio;
        c.save();
        c.strokeStyle = color_of("accent");
        c.globalAlpha = 0.55;
        c.lineWidth = 1.5 * density;
        c.beginPath();
        front.forEach((i, order) => {
            const [x, y] = place_of(u, points[i].time, points[i].error);
            if (order) c.lineTo(x, place_of(u, points[i].time, points[front[order - 1]].error)[1]);
            c[order ? "lineTo" : "moveTo"](x, y);
        });
        c.stroke();
        c.globalAlpha = 1;
        c.font = `${12 * density}px system-ui, sans-serif`;
        c.textAlign = "left";
        c.textBaseline = "alphabetic";
        // No label on a point.
        const taken = points.map((p) => {
            const [x, y] = place_of(u, p.time, p.error);
            const r = 6 * density;
            return { left: x - r, top: y - r, right: x + r, bottom: y + r };
        });
        const order = points.map((_, i) => i).sort((a, b) => rank(a) - rank(b));
        for (const i of order) {
            const [x, y] = place_of(u, points[i].time, points[i].error);
            const shown = points[i].key === state.get("show");
            c.beginPath();
            c.arc(x, y, (shown ? 6 : 4.5) * density, 0, 2 * Math.PI);
            c.fillStyle = color_of(front.includes(i) ? "accent" : "gray");
            c.fill();
            if (shown || points[i].key === state.get("last")) {
                c.strokeStyle = color_of(shown ? "text" : "second");
                c.lineWidth = 2 * density;
                c.beginPath();
                c.arc(x, y, (shown ? 9 : 7.5) * density, 0, 2 * Math.PI);
                c.stroke();
            }
            if (rank(i) < 3) label(u, i, x, y, taken);
        }
        c.restore();
    }
    // Labels go to the shown point, then to the Pareto set; the rest would crowd a large sweep.
    const rank = (i) => (points[i].key === state.get("show") ? 0
        : front.includes(i) ? 1 : points.length <= 12 ? 2 : 3);
    // A label that covers no other: to the right above the line, otherwise elsewhere around the
    // point, otherwise none.
    function label(u, i, x, y, taken) {
        const c = u.ctx;
        const density = devicePixelRatio;
        const width = c.measureText(points[i].name).width;
        const [gap, height] = [8 * density, 15 * density];
        for (const [left, top] of [[x + gap, y - height - gap / 4], [x + gap, y + gap / 2],
            [x - width - gap, y - height - gap / 4], [x - width - gap, y + gap / 2],
            [x - width / 2, y + 1.5 * gap], [x - width / 2, y - height - 1.5 * gap]]) {
            const area = { left, top, right: left + width, bottom: top + height };
            const inside = left > u.bbox.left && area.right < u.bbox.left + u.bbox.width &&
                top > u.bbox.top && area.bottom < u.bbox.top + u.bbox.height;
            if (!inside || taken.some((t) => t.left < area.right && area.left < t.right &&
                t.top < area.bottom && area.top < t.bottom)) continue;
            taken.push(area);
            c.fillStyle = color_of(front.includes(i) ? "text" : "quiet");
            c.fillText(points[i].name, left, top + height * 0.75);
            return;
        }
    }

    // Index of the point nearest to a place of the plot (CSS pixels), or -1.
    function nearest(x, y) {
        let best = -1;
        let distance = kReach;
        points.forEach((p, i) => {
            const d = Math.hypot(plot.valToPos(p.time, "x") - x, plot.valToPos(p.error, "y") - y);
            if (d < distance) [best, distance] = [i, d];
        });
        return best;
    }
    function hover(event) {
        const i = event.type === "mouseleave" ? -1 : nearest(event.offsetX, event.offsetY);
        tip.hidden = i < 0;
        if (i < 0) return;
        const { name, error, time } = points[i];
        tip.textContent = `${name}: ${number(error)} in ${milliseconds(time)}`;
        const left = plot.over.offsetLeft + plot.valToPos(points[i].time, "x");
        const room = box.clientWidth - tip.clientWidth;
        tip.style.left = `${limit(left - tip.clientWidth / 2, 0, room)}px`;
        tip.style.top = `${plot.over.offsetTop + plot.valToPos(points[i].error, "y") - 38}px`;
    }

    function build() {
        const metric = model.metric(state.get("metric"));
        // A variant that failed in some frames has means over fewer.
        points = model.variant_sources.filter((s) => !s.data.failure).map((s) => ({
            key: s.key, name: s.name, time: model.time(s.data),
            error: metric && model.mean(s.data, metric.name),
        })).filter((p) => p.time !== undefined && p.error !== undefined)
            .sort((a, b) => a.time - b.time);
        plot?.destroy();
        plot = undefined;
        box.replaceChildren(tip);
        if (!points.length) {
            about.textContent = "No variant has both a time and this error.";
            return;
        }
        front = pareto_of(points, metric.better);
        const name = metric_name(metric.name);
        const input = model.source("input")?.data;
        about.textContent = `${name} against ${model.compared}: ${way_of(metric, model.reference_kind)}. ` +
            (input && model.mean(input, metric.name) !== undefined
                ? `The unfiltered input has ${number(model.mean(input, metric.name))}. ` : "") +
            "On the line: no other variant is both " +
            "faster and closer. A click shows the picture." +
            (model.variant_sources.some((s) => s.data.timing?.trustworthy === false)
                ? " Not all times are to be trusted: see below." : "");
        const words = front.map((i) =>
            `${points[i].name} ${number(points[i].error)} in ${milliseconds(points[i].time)}`);
        box.setAttribute("aria-label", `${name} against time. Pareto set: ${words.join("; ")}. ` +
            "Left and right arrow keys choose a point.");
        const x = axis_of(points.map((p) => p.time), true, "time per frame, ms", 36);
        const y = axis_of(points.map((p) => p.error), metric.better === "lower", name, 54);
        plot = new uPlot({
            width: box.clientWidth || 400, height: box.clientHeight || 300, legend: { show: false },
            cursor: { x: false, y: false, drag: { x: false, y: false }, points: { show: false } },
            padding: [8, 12, 0, 0], scales: { x: x.scale, y: y.scale }, axes: [x.axis, y.axis],
            series: [{}, { paths: () => null, points: { show: false } }], hooks: { draw: [draw] },
        }, [points.map((p) => p.time), points.map((p) => p.error)], box);
        plot.over.addEventListener("click", (event) => {
            const i = nearest(event.offsetX, event.offsetY);
            if (i >= 0) page.show(points[i].key);
        });
        plot.over.addEventListener("mousemove", hover);
        plot.over.addEventListener("mouseleave", hover);
        page.pareto = { plot, points, front };
    }
    box.addEventListener("keydown", (event) => {
        const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
        if (!step || !points.length) return;
        event.preventDefault();
        const at = points.findIndex((p) => p.key === state.get("show"));
        page.show(points[limit(at + step, 0, points.length - 1)].key);
    });
    state.watch(["metric"], build);
    state.watch(["show", "last"], () => plot?.redraw(false));
    keep_fresh(box, () => plot);
}

export function add_frames_plot(page, more) {
    const { model, state } = page;
    if (model.frames.length < 2 || !model.metrics.length) return;
    const sources = model.scored_sources;
    const input = sources.find((s) => s.kind === "input");
    const box = h("div", { class: "plot" });
    const about = h("p", { class: "about" });
    const legend = h("div", { class: "legend" });
    const alone = !more.querySelector(".pareto");
    more.append(section(alone ? "panel wide" : "panel", model.measure === "error" ? "Error over frames" : "Difference over frames", about, legend, box));
    let plot;

    const color = (key) => color_of(key === state.get("show") ? "accent"
        : key === state.get("last") ? "second" : "gray");
    function build() {
        const metric = model.metric(state.get("metric"));
        const columns = sources.map((s) => model.frames.map(
            (_, i) => s.data.metrics[metric.name]?.frames?.[i] ?? null));
        const values = columns.flat().filter((v) => v !== null);
        plot?.destroy();
        plot = undefined;
        box.replaceChildren();
        const way = way_of(metric, model.reference_kind);
        about.textContent = `${metric_name(metric.name)} of each frame (${way}). ` +
            "A click shows the frame.";
        if (!values.length) return;
        const y = axis_of(values, false, metric_name(metric.name), 54);
        const x = axis_of(model.frames, false, "frame", 36);
        x.axis.splits = () => {
            const step = Math.ceil(model.frames.length / 12);
            return model.frames.filter((_, i) => i % step === 0);
        };
        x.axis.values = (_, splits) => splits.map(String);
        plot = new uPlot({
            width: box.clientWidth || 400, height: box.clientHeight || 300, legend: { show: false },
            cursor: { drag: { x: false, y: false }, y: false }, padding: [8, 12, 0, 0],
            scales: { x: x.scale, y: y.scale }, axes: [x.axis, y.axis],
            series: [{}, ...sources.map((s) => ({
                label: s.name, width: 1.5, stroke: () => color(s.key),
                dash: s === input ? [5, 4] : undefined,
                points: { show: true, size: 6, width: 1.5, fill: () => color_of("panel") },
            }))],
            hooks: { draw: [(u) => {
                const x_at = u.valToPos(state.get("frame"), "x", true);
                u.ctx.fillStyle = color_of("text");
                u.ctx.globalAlpha = 0.25;
                u.ctx.fillRect(x_at - 1, u.bbox.top, 2, u.bbox.height);
                u.ctx.globalAlpha = 1;
            }] },
        }, [model.frames, ...columns], box);
        plot.over.addEventListener("click", (event) => {
            const at = plot.posToVal(event.offsetX, "x");
            const frames = [...model.page_frames]
                .sort((a, b) => Math.abs(a - at) - Math.abs(b - at));
            if (frames.length) state.set({ frame: frames[0] });
        });
    }
    state.watch(["metric"], build);
    state.watch(["show", "last", "frame"], () => {
        plot?.redraw(true);
        legend.replaceChildren(...["show", "last"].map((part) => sources.find(
            (s) => s.key === state.get(part))).filter((s, i, all) => s && all.indexOf(s) === i)
            .map((s) => h("span", {}, h("i", { style: { "--color": color(s.key) } }), s.name)),
        ...(input ? [h("span", {}, "dashed: the unfiltered input")] : []));
    });
    keep_fresh(box, () => plot);
}
