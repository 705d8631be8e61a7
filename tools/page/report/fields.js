// The members of the report's address.
//
// show, last: "truth", "input" or the number of a variant, from 1.
import { flag, number_between, one_of, one_of_numbers } from "../viewer/state.js";

const boxes = (frames, width, height) => ({
    read: (text) => text.split("_").map((box) => box.split(",").map(Number)).filter(
        ([frame, x, y, w, h]) => frames.includes(frame) && x >= 0 && y >= 0 && w >= 1 && h >= 1 &&
            x + w <= width && y + h <= height && [x, y, w, h].every(Number.isInteger))
        .map(([frame, x, y, w, h]) => ({ frame, x, y, width: w, height: h })),
    write: (list) => list.map((b) => [b.frame, b.x, b.y, b.width, b.height].join()).join("_"),
});

export function fields_of(model) {
    return {
        show: one_of(model.sources.map((s) => s.key)),
        last: one_of(model.sources.map((s) => s.key)),
        frame: one_of_numbers(model.page_frames),
        ev: number_between(-20, 20),
        tone: one_of(model.tones),
        map: one_of(model.maps.map((m) => m.key)),
        pin: flag,
        wipe: number_between(0, 1),  // place of the line; 0: no wipe
        zoom: number_between(0, 64),  // device pixels per picture pixel; 0: the whole picture
        x: number_between(-1e5, 1e5),  // picture pixel at the center of the canvas
        y: number_between(-1e5, 1e5),
        metric: one_of(model.metrics.map((m) => m.name)),
        crops: boxes(model.page_frames, model.width, model.height),
    };
}
