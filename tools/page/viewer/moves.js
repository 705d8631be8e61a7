// Calls that change the picture of a page with a viewer.
import { by_id, printable } from "../shared/dom.js";

/** Adds show(), flip(), step_frame() and say() to a page with `model` and `state`. */
export function add_moves(page) {
    const { model, state } = page;
    // Shows a source; the one shown before is the other half of the flip.
    page.show = (key, more = {}) => {
        if (!model.source(key)) return;
        const before = state.get("show");
        state.set({ show: key, ...(key === before ? {} : { last: before }), ...more });
    };
    page.flip = () => page.show(state.get("last"));
    page.step_frame = (by) => {
        const frames = model.page_frames;
        const at = frames.indexOf(state.get("frame"));
        if (frames.length) state.set({ frame: frames[(at + by + frames.length) % frames.length] });
    };
    page.say = (text) => { by_id("live").textContent = printable(text); };
}
