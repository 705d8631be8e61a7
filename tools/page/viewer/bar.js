// The controls below the canvas.
import { by_id, h } from "../shared/dom.js";
import { number } from "../shared/words.js";
import { kTones } from "./tone.js";

const kFramesPerSecond = 12;

export function fill_bar(page) {
    const { model, state } = page;
    const slider = by_id("frame");
    slider.addEventListener("input", () =>
        state.set({ frame: model.page_frames[slider.valueAsNumber] }));
    // Called by a page whose frames have changed.
    page.follow_frames = () => {
        by_id("frames").hidden = model.page_frames.length < 2;
        slider.max = Math.max(0, model.page_frames.length - 1);
        slider.value = model.page_frames.indexOf(state.get("frame"));
    };
    page.follow_frames();
    state.watch(["frame"], () => {
        slider.value = model.page_frames.indexOf(state.get("frame"));
        slider.setAttribute("aria-valuetext", `frame ${state.get("frame")}`);
        by_id("frame-number").textContent = state.get("frame");
    });

    const play = by_id("play");
    let playing = false;
    async function run() {
        while (playing) {
            const next = performance.now() + 1000 / kFramesPerSecond;
            page.step_frame(1);
            await page.viewer.loaded;
            await new Promise((done) => setTimeout(done, Math.max(0, next - performance.now())));
        }
    }
    page.play = () => {
        if (model.page_frames.length < 2) return;
        playing = !playing;
        play.setAttribute("aria-pressed", playing);
        play.textContent = playing ? "\u23f8\ufe0e" : "\u25b6\ufe0e";
        if (playing) run();
    };
    play.addEventListener("click", page.play);

    const ev = by_id("ev");
    ev.addEventListener("input", () => state.set({ ev: ev.valueAsNumber }));
    state.watch(["ev"], () => {
        ev.value = state.get("ev");
        by_id("ev-number").textContent =
            `${state.get("ev") > 0 ? "+" : ""}${number(state.get("ev"))} EV`;
    });
    const tone = by_id("tone");
    tone.append(...kTones.map((t) => h("option", { value: t.key, title: t.help }, t.name)));
    tone.addEventListener("change", () => state.set({ tone: tone.value }));
    state.watch(["tone"], () => (tone.value = state.get("tone")));

    // Without ground truth a map shows a difference, not an error.
    const map = by_id("map");
    map.labels[0].textContent = model.measure === "error" ? "Error map" : "Difference map";
    by_id("maps").hidden = !model.maps.length;
    map.append(...model.maps.map((m) => h("option", { value: m.key, title: m.help }, m.name)));
    map.addEventListener("change", () => state.set({ map: map.value }));
    state.watch(["map"], () => (map.value = state.get("map")));
    by_id("pin").addEventListener("click", () => state.set({ pin: !state.get("pin") }));
    state.watch(["pin"], () => by_id("pin").setAttribute("aria-pressed", state.get("pin")));

    by_id("wipe-on").addEventListener("click", () => page.wipe());
    state.watch(["wipe"], () =>
        by_id("wipe-on").setAttribute("aria-pressed", state.get("wipe") > 0));
    by_id("zoom-fit").addEventListener("click", () => page.viewer.zoom_fit());
    by_id("zoom-one").addEventListener("click", () => page.viewer.zoom_to(1));
    by_id("zoom-in").addEventListener("click", () => page.viewer.zoom_by(1));
    by_id("zoom-out").addEventListener("click", () => page.viewer.zoom_by(-1));
    // As in the list: after a click the picture gets the focus.
    for (const button of document.querySelectorAll(".bar button"))
        button.addEventListener("pointerup", () =>
            page.viewer.canvas.focus({ preventScroll: true }));
}
