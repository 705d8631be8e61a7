// Sentences that explain the tables.
import { h } from "../shared/dom.js";

// The two intervals of ab; report.md says the same (report_text.cpp).
export const explain_intervals = (bootstrap) => h("details", { class: "explain", open: true },
    h("summary", {}, "How to read the intervals"),
    h("p", {}, h("b", {}, "t-interval, over frames: "), "how far the mean of these frames may be ",
        "from the mean over many frames of this kind. The more the frames disagree and the fewer ",
        "they are, the wider it is. An interval that contains 0 leaves open which of the two is ",
        "better; of 20 metrics without any difference one lies outside by chance."),
    h("p", {}, h("b", {}, "tile interval (bootstrap), within these frames: "), "each frame is ",
        `cut into tiles${bootstrap ? ` of ${bootstrap.tile_px} pixels` : ""}, and tiles are drawn `,
        "again and again at random, some of them twice and some not at all. An interval on one ",
        "side of 0 says that the difference does not come from a few places of these frames; it ",
        "says nothing about other frames."));

export const kRelMse = "relMSE misleads if a bright edge is slightly out of place: on a dark " +
    "surface the error is divided by almost nothing, and a few such pixels decide the mean. It " +
    "is never marked as worse; read HDR-FLIP and PSNR.";

export const kWorse = "Underlined in red: worse than the unfiltered input.";
