// One row of pixels over time: the ground truth above, the variants below it, a line for each frame.
// What flickers shows as steps between lines.
import { h } from "../shared/dom.js";
import { render } from "../viewer/cpu_view.js";
import { panel } from "./panel.js";

const kLine = 8;         // CSS pixels a frame
const kMaxSlices = 10;   // beyond: the truth and the picture shown

export function add_slices(page, more) {
    const { model, state, store } = page;
    const frame = model.scored_frames[0];
    const all = model.sources.filter((s) => store.has("slice", s.variant, frame) &&
        (s.kind === "color" || s.kind === "truth"));
    if (!model.slice || !all.length) return;
    const { row, left, width } = model.slice;
    const rows = h("div", { class: "slices" });
    more.append(panel("One row over time", [`Row ${row}, pixels ${left} to ${left + width - 1}, where the ground `,
        `truth changes most. Each line is a frame, ${model.scored_frames[0]} to ${model.scored_frames.at(-1)}, at the `,
        "exposure and tone curve above. What flickers shows as steps that the truth does not have."], rows));

    async function paint(source, canvas) {
        const image = await store.load("slice", source.variant, frame);
        const context = canvas.getContext("2d");
        const pixels = context.createImageData(canvas.width, canvas.height);
        render({
            ...page.viewer.view(), image, error: undefined, other: undefined, center: [image.width / 2, image.height / 2],
            size: [image.width, image.height], scale: 1, grid: false, split: 0,
        }, pixels.data, canvas.width, canvas.height);
        context.putImageData(pixels, 0, 0);
    }
    function build() {
        const shown = all.length <= kMaxSlices ? all
            : all.filter((s) => s.kind === "truth" || s.key === state.get("show"));
        const height = model.scored_frames.length;
        rows.replaceChildren(...shown.flatMap((source) => {
            const canvas = h("canvas", { width, height, role: "img", style: { height: `${kLine * height}px` },
                "aria-label": `${source.name}: row ${row} over ${height} frames` });
            paint(source, canvas);
            return [h("span", {}, source.name), canvas];
        }));
    }
    state.watch(all.length <= kMaxSlices ? ["ev", "tone"] : ["ev", "tone", "show"], build);
}
