// The keyboard. Keys act on the whole page, except while a field is being edited; space presses a
// button that has the focus.
import { by_id, h, limit } from "../shared/dom.js";

// The keys of every viewer, and what they do.
const keys_of = ({ measure }) => [
    [["Space"], "flip the last two"],
    [["W"], "wipe between the last two: on, off"],
    [["D"], `hold: ${measure} map`],
    [["E"], `${measure} map on, off`],
    [["M"], `next ${measure} map`],
    [["[", "]"], "exposure down, up by half a stop"],
    [["R"], "exposure back to 0"],
    [[",", "."], "frame before, next frame"],
    [["P"], "play, pause"],
    [["+", "\u2212"], "zoom; also the wheel"],
    [["F"], "fit; also a double click"],
    [["Arrows"], "on the picture: move the cursor, with Shift by 10 pixels"],
    [["Drag"], "move the picture"],
];

/** rows: further keys in words; more: their actions, by key. */
export function bind_keys(page, rows, more) {
    const { model, state } = page;
    const dialog = by_id("help");
    by_id("keys").append(...[...rows, ...keys_of(model)].map(([keys, what]) => h("tr", {},
        h("td", {}, keys.flatMap((key, i) => [
            i ? (keys[0] === "1" ? " \u2026 " : keys[0] === "Shift" || keys[0] === "Alt" ? " + " : " ") : "",
            h("kbd", {}, key)])), h("td", {}, what))));
    const help = () => dialog.open || dialog.showModal();
    by_id("help-open").addEventListener("click", help);
    by_id("skip").addEventListener("click", (event) => {
        event.preventDefault();
        page.viewer.canvas.focus();
    });

    const next_map = () => {
        const at = model.maps.findIndex((m) => m.key === state.get("map"));
        if (model.maps.length) state.set({ map: model.maps[(at + 1) % model.maps.length].key });
    };
    const expose = (by) => state.set({ ev: limit(state.get("ev") + by, -20, 20) });
    const actions = {
        " ": page.flip, d: () => page.viewer.hold(true), w: page.wipe,
        e: () => state.set({ pin: !state.get("pin") }), m: next_map,
        "[": () => expose(-0.5), "]": () => expose(0.5), r: () => state.set({ ev: 0 }),
        ",": () => page.step_frame(-1), ".": () => page.step_frame(1), p: () => page.play(),
        "+": () => page.viewer.zoom_by(1), "=": () => page.viewer.zoom_by(1),
        "-": () => page.viewer.zoom_by(-1), f: () => page.viewer.zoom_fit(), "?": help, ...more,
    };
    const held = new Set([" ", "d", "e", "p", "m", "w", "?"]);  // once per press

    addEventListener("keydown", (event) => {
        if (event.ctrlKey || event.metaKey || event.altKey || dialog.open) return;
        const target = event.target;
        const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
        if (target.matches("select, textarea, input:not([type=range])")) return;
        if (document.querySelector("dialog[open]")) return;
        if (target.matches("button, summary, a") && key === " ") return;
        const action = actions[key];
        if (!action) return;
        event.preventDefault();
        if (event.repeat && held.has(key)) return;
        action();
    });
    addEventListener("keyup", (event) => {
        if (event.key.toLowerCase() === "d") page.viewer.hold(false);
    });
    addEventListener("blur", () => page.viewer.hold(false));

    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    page.viewer.canvas.addEventListener("keydown", (event) => {
        const step = steps[event.key];
        if (!step || event.ctrlKey || event.metaKey || event.altKey) return;
        event.preventDefault();
        const from = page.viewer.cursor ?? { x: model.width >> 1, y: model.height >> 1 };
        const size = event.shiftKey ? 10 : 1;
        const pixel = { x: limit(from.x + step[0] * size, 0, model.width - 1),
            y: limit(from.y + step[1] * size, 0, model.height - 1) };
        page.viewer.point_at(pixel);
        page.read_values?.(pixel);
    });
}
