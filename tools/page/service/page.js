// Shared by the parts of the page: the state of the address, the frames that are shown, and the
// pictures of the viewer.
import { flag, number_between, one_of, any_text, State } from "../viewer/state.js";
import { kTones } from "../viewer/tone.js";
import { kErrorMaps } from "./maps.js";

const kSources = ["before", "a", "b"];
const whole = { read: (text) => (/^-?\d{1,9}$/.test(text) ? Number(text) : undefined),
    write: String };

export const state = new State({
    shot: any_text, camera: any_text, job: any_text, frame: whole,
    show: one_of(kSources), last: one_of(kSources), ev: number_between(-20, 20),
    tone: one_of(kTones.map((t) => t.key)), map: one_of(kErrorMaps.map((m) => m.key)), pin: flag,
    wipe: number_between(0, 1), zoom: number_between(0, 64), x: number_between(-1e5, 1e5),
    y: number_between(-1e5, 1e5),
}, { shot: "", camera: "", job: "", frame: 0, show: "a", last: "before", ev: 0, tone: "display",
    map: "difference", pin: false, wipe: 0.5, zoom: 0, x: 0, y: 0 }, ["shot", "job"]);

// The picture of the viewer, in the form of a report's model. `subject` is what is looked at:
// {name, input, camera, frames: [{frame, state, message}], more, job}; job: undefined for live
// previews.
export const model = {
    // The size of the whole frame; `sized` resolves when it is known.
    width: 16, height: 9, sized: null, subject: null, measure: "difference", sources: [], page_frames: [], maps: kErrorMaps,
    get compared() { return state.get("show") === "b" ? "A" : "before"; },
    source: (key) => model.sources.find((one) => one.key === key),
    error_map: (source, frame, map) =>
        [source.kind === "before" ? "none" : "error", source.kind, frame, map],
};

/** Shared calls, filled in by their modules: show(key), flip(), step_frame(by), say(text), ... */
export const page = { model, state };
