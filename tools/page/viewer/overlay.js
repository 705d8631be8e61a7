// Marks over the canvas: the name of the picture, the error scale, the cursor.
import { by_id, h, limit, printable } from "../shared/dom.js";
import { percent } from "../shared/tables.js";
import { number } from "../shared/words.js";
import { kMagma } from "./magma.js";

const kRamp = `linear-gradient(to right, ${Array.from({ length: 33 }, (_, i) => {
    const at = 4 * Math.min(255, i * 8);
    return `rgb(${kMagma.slice(at, at + 3).join()})`;
}).join()})`;

// Decades of a logarithmic scale, quarters of another: both are at equal distances.
function ticks_of({ low, high, log }) {
    const count = log ? Math.round(Math.log10(high / low)) : 4;
    return Array.from({ length: count + 1 }, (_, i) =>
        [i / count, log ? low * 10 ** i : low + (high - low) * i / count]);
}

// The bar of a scale, with a needle at the value under the cursor.
function fill_scale(box, map, compared) {
    box.replaceChildren(
        h("div", {}, `${map.name}, against ${compared}`),
        h("div", { class: "ramp", style: { background: kRamp } }),
        h("div", { class: "ticks" }, ticks_of(map).map(([place, v]) =>
            h("span", { style: { left: percent(place) } },
                v < 1e-3 ? number(v, 1) : String(Number(v.toPrecision(2)))))));
}

export function overlay(page) {
    const { model, state } = page;
    const shown = by_id("shown");
    const scale = by_id("scale");
    const wipe = by_id("wipe");
    let said = "";

    const move_wipe = (to) => state.set({ wipe: limit(to, 0.005, 0.995) });
    wipe.addEventListener("pointerdown", (event) => wipe.setPointerCapture(event.pointerId));
    wipe.addEventListener("pointermove", (event) => {
        if (!wipe.hasPointerCapture(event.pointerId)) return;
        const box = page.viewer.canvas.getBoundingClientRect();
        move_wipe((event.clientX - box.left) / box.width);
    });
    wipe.addEventListener("keydown", (event) => {
        const step = { ArrowLeft: -0.02, ArrowRight: 0.02, Home: -1, End: 1 }[event.key];
        if (!step) return;
        event.preventDefault();
        move_wipe(state.get("wipe") + step);
    });
    page.wipe = () => state.set({ wipe: state.get("wipe") ? 0 : 0.5 });

    function box_to(element, { x, y, width, height }) {
        const [left, top] = page.viewer.from_picture(x, y);
        const [right, bottom] = page.viewer.from_picture(x + width, y + height);
        element.style.cssText = `left:${left}px;top:${top}px;width:${right - left}px;` +
            `height:${bottom - top}px`;
    }

    const marks = {
        drawn() {
            const { viewer } = page;
            if (!viewer) return;
            const source = model.source(state.get("show"));
            const map = viewer.map();
            const note = viewer.shown?.no_map ? `no ${map.name} map of this picture`
                : map ? `${map.name} map` : page.note?.(source) ?? "";
            const wiped = viewer.shown?.other && viewer.wiped();
            shown.replaceChildren(wiped ? `${wiped.name} \u2502 ` : "",
                source?.digit ? `${source.digit}\u2002` : "", source?.name ?? "",
                h("small", {}, note));
            wipe.hidden = !wiped;
            if (wiped) {
                wipe.style.setProperty("--at", percent(state.get("wipe")));
                wipe.setAttribute("aria-valuenow", Math.round(100 * state.get("wipe")));
                wipe.setAttribute("aria-label", `Wipe: ${wiped.name}, ${source.name}`);
            }
            const text = source
                ? `${source.name}${note ? `, ${note}` : ""}, frame ${state.get("frame")}` : "No picture";
            viewer.canvas.setAttribute("aria-label", text);
            if (text !== said && said) page.say(text);
            said = text;

            const drawn_map = viewer.shown?.map;
            scale.hidden = !drawn_map;
            const title = drawn_map && `${drawn_map.key} ${model.compared}`;
            if (drawn_map && scale.dataset.map !== title) {
                scale.dataset.map = title;
                fill_scale(scale, drawn_map, model.compared);
            }
            const zoom = viewer.scale();
            by_id("zoom").textContent = `${state.get("zoom") ? "" : "fit, "}${number(zoom)}\u00d7`;
            by_id("missing").hidden = !viewer.missing;
            by_id("missing").textContent = printable(viewer.missing ?? "");
            marks.cursor(viewer.cursor);
        },
        busy(on) { by_id("canvas").setAttribute("aria-busy", on); },
        cursor(pixel) {
            const place = by_id("place");
            const mark = by_id("pixel");
            place.hidden = mark.hidden = !pixel;
            scale.querySelector(".needle")?.remove();
            if (!pixel) return;
            place.textContent = `x ${pixel.x}  y ${pixel.y}`;
            box_to(mark, { ...pixel, width: 1, height: 1 });
            const source = model.source(state.get("show"));
            const map = page.viewer.shown?.map;
            const at = map && page.viewer.values(source, pixel, map)?.place;
            if (at !== undefined)
                scale.children[1]?.after(
                    h("div", { class: "needle", style: { "--at": percent(at) } }));
        },
        choosing(box) {
            const mark = by_id("choosing");
            mark.hidden = !box;
            if (box) box_to(mark, box);
        },
    };
    return marks;
}
