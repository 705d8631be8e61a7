// The center of the page: the open shot or job in the viewer of reports, with live previews.
import { by_id, h, printable, settle } from "../shared/dom.js";
import { milliseconds, number } from "../shared/words.js";
import { fill_bar } from "../viewer/bar.js";
import { bind_keys } from "../viewer/keys.js";
import { add_moves } from "../viewer/moves.js";
import { overlay } from "../viewer/overlay.js";
import { Viewer } from "../viewer/viewer.js";
import { post } from "./api.js";
import { activeChain, chainTitle, isCompared, whenChainsChange } from "./chains.js";
import { model, page, state } from "./page.js";
import { is_bad, is_finished, Pictures } from "./pictures.js";

const kKeys = [
    [["0", "1", "2"], "before; A or the output; B"],
    [["Alt", "1"], "to the folders; Alt + 2 jobs, 3 picture, 4 frames, 5 chain"],
];

let pictures, marks, took = "";

function sources_of(subject) {
    const frames = { get frames() { return model.page_frames; } };
    const one = (key, digit, name) => Object.assign(Object.create(frames),
        { key, kind: key, digit, name });
    if (!subject) return [];
    if (subject.job) return [one("before", "0", "Before"), one("a", "1", "After")];
    return [one("before", "0", "Before"), one("a", "1", `A ${chainTitle("a")}`),
        ...(isCompared() ? [one("b", "2", `B ${chainTitle("b")}`)] : [])];
}

/** What a picture's error map compares it with. */
page.reference = (key) => (key === "b" ? "a" : "before");

const entry_of = (frame) => model.subject?.frames.find((one) => one.frame === frame);

export async function look(subject) {
    model.subject = subject;
    model.page_frames = subject?.frames.map((one) => one.frame) ?? [];
    refresh_sources();
    show_fault();
    took = "";
    read_values();
    if (!subject) {
        page.follow_frames();
        page.viewer.load();
        return page.looked?.();
    }
    page.clear_failure();
    state.set({ job: subject.job ?? "", shot: subject.job ? "" : subject.input,
        camera: subject.job ? "" : subject.camera ?? "" });
    if (!model.page_frames.includes(state.get("frame"))) {
        const { frames } = subject;
        state.set({ frame: (frames.find(is_bad) ?? frames.find(is_finished) ?? frames[0])?.frame ?? 0 });
    }
    page.follow_frames();
    pictures.known = false;
    model.sized = ask_plan().then(() => {
        if (model.subject === subject) pictures.known = true;
    });
    page.viewer.load();
    await model.sized;
    if (model.subject !== subject) return;
    page.viewer.draw();
    page.looked?.();
}

/** After the service was away: asks again for what failed meanwhile. */
export const look_again = () => model.subject && look(model.subject);

/** New states of the frames of the job that is looked at. */
export function update_frames(frames, jobState) {
    const before = entry_of(state.get("frame"))?.state;
    model.subject.frames = frames;
    model.subject.state = jobState;
    model.page_frames = frames.map((one) => one.frame);
    page.follow_frames();
    if (before !== entry_of(state.get("frame"))?.state) page.viewer.load();
    show_fault();
}

function refresh_sources() {
    model.sources = sources_of(model.subject);
    const has = (key) => model.source(key);
    if (model.subject && !has(state.get("show"))) state.set({ show: "a" });
    if (model.subject && !has(state.get("last"))) state.set({ last: "before" });
    by_id("sources").replaceChildren(...model.sources.map((one) => h("button", {
        type: "button", "data-key": one.key, onclick: () => page.show(one.key),
    }, h("kbd", { "aria-hidden": "true" }, one.digit), ` ${one.name}`)));
    mark_sources();
}
function mark_sources() {
    for (const button of by_id("sources").children)
        button.setAttribute("aria-pressed", button.dataset.key === state.get("show"));
}

// The plan of the chosen chain; it has the size of the frames.
async function ask_plan() {
    const { subject } = model;
    if (subject.job) return size_of_job(subject);
    const frames = String(state.get("frame")), { text } = activeChain();
    const is_old = () => model.subject !== subject || activeChain().text !== text;
    const body = { ...subject.more?.show, input: subject.input, frames, chain_text: text,
        ...(subject.camera && { camera: subject.camera }) };
    try {
        const reply = (await post("v1/plan", body)).frames[0];
        if (is_old()) return pictures.known ? undefined : take_size(subject, frames);
        if (reply?.plan) Object.assign(model, { width: reply.plan.width, height: reply.plan.height });
        else await take_size(subject, frames);
        page.planned?.(reply, "");
    } catch (error) {
        if (!is_old()) page.planned?.(null, error.lines?.().join("\n") ?? error.message);
        if (model.subject === subject) await take_size(subject, frames);
    }
    return undefined;
}

// The size of a frame that a chain that does nothing can read.
async function take_size(subject, frames) {
    const reply = await post("v1/plan", { input: subject.input, frames,
        chain: { postchain: 1, passes: [] } }).catch(() => null);
    const read = reply?.frames[0]?.plan;
    if (read && model.subject === subject)
        Object.assign(model, { width: read.width, height: read.height });
    return Boolean(read);
}

// The frame may be damaged: then another one has the size.
async function size_of_job(subject) {
    const done = subject.frames.find(is_finished)?.frame;
    for (const frame of new Set([state.get("frame"), done, subject.frames[0].frame]))
        if (frame !== undefined && await take_size(subject, String(frame))) return;
}

function chains_changed(why) {
    if (!model.subject) return;
    page.planned?.(null, "");  // it was the plan of another chain
    refresh_sources();
    if (why === "compared") state.set(isCompared() ? { show: "b", last: "a" }
        : { show: "a", last: "before" });
    if (why !== "chosen") page.viewer.load();
    if (!model.subject.job) ask_plan();
}

// ----------------------------------------------------------------------------------- values
function read_values(pixel) {
    const box = by_id("values");
    if (!pixel || !model.subject) return box.replaceChildren(took);
    const parts = model.sources.map((one) => {
        const values = page.viewer.values(one, pixel);
        return values && h("span", {}, h("b", {}, one.key === "before" ? "before"
            : model.subject.job ? "after" : one.key.toUpperCase()),
        ` ${values.rgb.map((v) => number(v)).join("  ")}`);
    });
    box.replaceChildren(...parts.filter(Boolean));
}

/** Why the frame of a job has no output; it is shown as it came in. */
function show_fault() {
    const entry = entry_of(state.get("frame"));
    const fault = by_id("fault");
    fault.hidden = !model.subject?.job || !entry || is_finished(entry);
    if (fault.hidden) return;
    const what = { quarantined: "failed", missing: "is not on disk",
        waiting: { canceled: "was not filtered: the job is canceled",
            failed: "was not filtered: the job ended before" }[model.subject.state] ?? "waits to be filtered" };
    fault.className = entry.state === "waiting" ? "" : "bad";
    fault.textContent = printable(`Frame ${entry.frame} ${what[entry.state] ?? entry.state}${
        entry.message ? `: ${entry.message}` : "."}`);
}

export function start_look() {
    pictures = new Pictures(page);
    page.pictures = pictures;
    add_moves(page);
    marks = overlay(page);
    page.viewer = new Viewer(by_id("canvas"), model, pictures, state, {
        cursor: (pixel) => { marks.cursor(pixel); read_values(pixel); },
        drawn: () => {
            marks.drawn();
            if (!model.subject) by_id("missing").textContent = state.get("job")
                ? "This job has no frames to show yet." : "Choose frames on the left.";
        },
        held: () => undefined, busy: (on) => marks.busy(on), choosing: () => undefined,
    });
    page.read_values = read_values;
    fill_bar(page);
    by_id("maps").hidden = false;
    bind_keys(page, kKeys, { 0: () => page.show("before"), 1: () => page.show("a"),
        2: () => page.show("b") });
    page.previewed = (kind, ms, scale) => {
        took = `${kind.toUpperCase()}: ${milliseconds(ms)}${scale < 1 ? `, 1/${1 / scale} size` : ""}`;
        if (!page.viewer.cursor) read_values();
    };
    state.watch(["show"], mark_sources);
    state.watch(["zoom"], settle(() => page.viewer.load(), 200));
    state.watch(["frame"], show_fault);
    state.watch(["frame"], settle(() => {
        if (model.subject && !model.subject.job) ask_plan();
    }, 500));
    whenChainsChange(chains_changed);
}
