// Regions side by side: those with the largest error, and those chosen with shift and drag. They
// follow exposure, tone curve and error map of the canvas; a click shows the region there.
import { h, settle } from "../shared/dom.js";
import { render } from "../viewer/cpu_view.js";
import { pareto_of } from "./model.js";
import { panel } from "./panel.js";

const kTile = 150;        // CSS pixels, the longer side
const kMaxTiles = 10;    // beyond: truth, the source shown, the one before, and the Pareto set

function columns_of({ model, state }) {
    const all = model.sources.filter((s) => s.frames.length);
    if (all.length <= kMaxTiles) return all;
    const points = model.variant_sources.filter((s) => s.frames.length).map((s) => ({
        key: s.key, time: model.time(s.data), error: model.mean(s.data, state.get("metric")),
    })).filter((p) => p.time !== undefined && p.error !== undefined);
    const front = pareto_of(points, model.metric(state.get("metric"))?.better)
        .map((i) => points[i].key);
    const keys = ["truth", state.get("show"), state.get("last"), ...front];
    const chosen = new Set([...new Set(keys)].filter((key) => model.source(key)?.frames.length)
        .slice(0, kMaxTiles));
    return all.filter((s) => chosen.has(s.key));
}

export function add_crops(page, more) {
    const { model, state, store } = page;
    if (!model.sources.some((s) => s.frames.length)) return;
    const rows = h("div", { class: "crops" });
    const all = model.sources.filter((s) => s.frames.length).length <= kMaxTiles;
    more.append(panel("Crops", [`Regions where the ${model.measure} is largest, and those you choose: `,
        h("kbd", {}, "Shift"), ` + drag on the picture. Same exposure, tone curve and ${model.measure} map `,
        "as above. ", all ? "" : "Shown: truth, the last two, and the Pareto set."], rows));

    let tiles = [];
    const seen = new IntersectionObserver((entries) => {
        for (const entry of entries) {
            const tile = tiles.find((t) => t.canvas === entry.target);
            if (!tile) continue;
            tile.visible = entry.isIntersecting;
            if (tile.visible) paint(tile);
        }
    }, { rootMargin: "200px" });

    async function paint(tile) {
        if (!tile.visible) return;
        const { source, crop, canvas } = tile;
        const map = page.viewer.map();
        const [image, error] = await Promise.all([
            store.load(source.kind, source.variant, crop.frame),
            map && store.load(...model.error_map(source, crop.frame, map.key)),
        ]).catch(() => []);
        if (!image || !canvas.isConnected) return;
        const view = {
            ...page.viewer.view(), image, error,
            center: [crop.x + crop.width / 2, crop.y + crop.height / 2],
            scale: canvas.width / crop.width, grid: false, split: 0,
        };
        const context = canvas.getContext("2d");
        const pixels = context.createImageData(canvas.width, canvas.height);
        render(view, pixels.data, canvas.width, canvas.height);
        context.putImageData(pixels, 0, 0);
    }
    const repaint = settle(() => tiles.forEach(paint), 40);

    function build() {
        seen.disconnect();
        tiles = [];
        const columns = columns_of(page);
        const found = model.crops.filter((c) => model.page_frames.includes(c.frame));
        const chosen = state.get("crops").map((c) => ({ ...c, why: "chosen", chosen: true }));
        rows.replaceChildren(...[...chosen, ...found].map((crop) => {
            const size = kTile / Math.max(crop.width, crop.height);
            const strip = columns.filter((s) => s.frames.includes(crop.frame)).map((source) => {
                const density = devicePixelRatio;
                const canvas = h("canvas", {
                    width: Math.max(1, Math.round(crop.width * size * density)),
                    height: Math.max(1, Math.round(crop.height * size * density)),
                    style: { width: `${crop.width * size}px`, height: `${crop.height * size}px` },
                });
                const tile = { source, crop, canvas };
                tile.button = h("button", {
                    type: "button", class: "tile", title: source.name,
                    style: { width: `${Math.max(crop.width * size, 80) + 2}px` },
                    "aria-label": `Show ${source.name}, frame ${crop.frame}, region at ` +
                        `${crop.x}, ${crop.y}`,
                    onclick: () => {
                        page.show(source.key, { frame: crop.frame });
                        page.viewer.show_region(crop);
                        page.viewer.canvas.scrollIntoView({ block: "nearest" });
                    },
                }, canvas, h("span", {}, source.name));
                tiles.push(tile);
                seen.observe(canvas);
                return tile.button;
            });
            return h("div", { class: "crop-row" }, h("div", { class: "why" },
                h("strong", {}, `Frame ${crop.frame}`),
                `${crop.x}, ${crop.y}, ${crop.width} \u00d7 ${crop.height}`, h("br"), crop.why,
                crop.chosen && h("div", {}, h("button", {
                    type: "button", "aria-label": `Remove the region at ${crop.x}, ${crop.y}`,
                    onclick: () => state.set({ crops: state.get("crops").filter((c) =>
                        c.x !== crop.x || c.y !== crop.y || c.width !== crop.width ||
                        c.height !== crop.height || c.frame !== crop.frame) }),
                }, "Remove"))), h("div", { class: "tiles" }, strip));
        }));
        mark();
    }
    const mark = () => tiles.forEach((tile) =>
        tile.button.setAttribute("aria-pressed", tile.source.key === state.get("show")));

    state.watch(["crops"], build);
    state.watch(all ? ["show"] : ["show", "last", "metric"], all ? mark : build);
    state.watch(["ev", "tone", "map", "pin"], repaint);
    page.on_hold = repaint;
}
