// The job that is looked at: its frames in the viewer; beside them progress, actions, and what the
// frame took.
import { by_id, h, printable, settle } from "../shared/dom.js";
import { clock, duration, milliseconds } from "../shared/words.js";
import { change, get, get_frames, jobPath, post, remove } from "./api.js";
import { update_film } from "./film.js";
import { basename, nameOf, progressOf } from "./job_words.js";
import { look, update_frames } from "./look.js";
import { page, state } from "./page.js";
import { is_bad } from "./pictures.js";
import { close_report, open_report } from "./report_frame.js";

let job = null, frames = [], parts = null, asked = 0;
let fails = false;  // just now: the failed frame comes into view
export const shown_job = () => job?.id;

function act(label, what, options = {}) {
    return h("button", { type: "button", ...options, onclick: async (event) => {
        event.currentTarget.disabled = true;
        parts.error.textContent = "";
        try {
            await what();
        } catch (error) {
            parts.error.textContent = printable(error.lines?.().join("\n") ?? error.message);
        }
        event.target.disabled = false;
    } }, label);
}

function actions() {
    const path = jobPath(job.id);
    const changed = (now) => { job_changed(now); page.jobs.replace_job(now); };
    const list = [];
    if (job.kind !== "run" && job.state === "done")
        list.push(act("Report", () => open_report(path), { class: "primary" }));
    if (job.state === "queued" || job.state === "running")
        list.push(act("Cancel", async () => changed(await remove(path))));
    if (job.state === "failed" || job.state === "canceled")
        list.push(act("Retry", async () => changed(await post(`${path}/retry`))));
    if (job.kind === "run")
        list.push(act("Preview", () => page.preview_job(job), { title: "Its chain and frames, filtered live" }));
    list.push(act("Duplicate\u2026", () => page.new_job(job.request), { title: "The form, filled in as for this job" }));
    if (job.state === "queued" || job.state === "running") {
        const priority = h("input", { type: "number", min: -100, max: 100, step: 1,
            "aria-label": "Priority", value: job.priority });
        list.push(h("span", { class: "pair" }, priority, act("Set priority", async () =>
            changed(await change(path, { priority: priority.valueAsNumber })))));
    } else {
        list.push(act("Remove", async () => {
            await remove(`${path}/record`);
            page.jobs.drop_job(job.id);
            page.leave_job();
            await look(null);
        }, { title: "From the list; its outputs stay" }));
    }
    return list;
}

/** Who waits, how long it took. */
function times() {
    if (job.place) return `place ${job.place} in the queue, submitted ${clock(job.created)}`;
    if (job.ended && job.started) return `${clock(job.started)}, took ${
        duration((Date.parse(job.ended) - Date.parse(job.started)) / 1000)}`;
    return job.started ? `started ${clock(job.started)}` : `submitted ${clock(job.created)}`;
}

function begin() {
    parts = { state: h("span"), actions: h("div", { class: "buttons" }),
        progress: h("progress", { "aria-label": "frames done" }), line: h("p", { class: "help" }),
        message: h("p"), error: h("p", { class: "error", role: "alert" }),
        frame: h("div", { "aria-live": "off" }) };
    by_id("job").replaceChildren(
        h("div", { class: "title" }, h("h2", {}, nameOf(job)), parts.state),
        h("p", { class: "help" }, [`job ${job.id}`, job.owner, job.priority
            ? `priority ${job.priority}` : ""].filter(Boolean).join(" \u00b7 ")),
        parts.progress, parts.line, parts.message, parts.actions, parts.error, parts.frame,
        ...["chain_text", "chain_b_text"].filter((key) => job.request?.[key]).map((key) =>
            h("details", {}, h("summary", {}, key === "chain_text" ? "Chain" : "Chain B"),
                h("pre", { tabindex: 0 }, job.request[key]))),
        h("details", {}, h("summary", {}, "Request"),
            h("pre", { tabindex: 0 }, JSON.stringify({ ...job.request, chain_text: undefined,
                chain_b_text: undefined }, null, 2))));
    by_id("job").hidden = false;
    by_id("chain").hidden = true;
}

function draw() {
    parts.state.className = `state ${job.state}`;
    parts.state.textContent = job.state;
    parts.progress.hidden = !job.frames;
    parts.progress.max = job.frames || 1;
    parts.progress.value = job.done;
    parts.line.textContent = [progressOf(job), times()].filter(Boolean).join(" \u00b7 ");
    const text = [job.verdict, job.message].filter(Boolean).join("\n");
    parts.message.hidden = !text;
    parts.message.className = job.state === "failed" ? "message bad" : "message";
    parts.message.textContent = printable(text);
    const kind = [job.state, job.done > 0].join();
    if (parts.kind === kind) return;  // a button may have the focus
    parts.kind = kind;
    parts.actions.replaceChildren(...actions());
}

/** Looks at a job, at a frame of it if one is given. */
export async function open_job(id, frame) {
    const mine = ++asked;
    let found;
    try {
        found = await Promise.all([get(jobPath(id)), get_frames(id)]);
        if (mine !== asked) return undefined;  // another one was opened since
    } catch (error) {
        return page.fail(error.status === 404 ? new Error(`There is no job ${id}.`) : error);
    }
    close_report();
    job = found[0];
    frames = found[1];
    begin();
    draw();
    page.jobs.draw_jobs();
    page.show_tab("jobs");
    const bad = first_bad();
    state.set({ job: id, shot: "", camera: "", show: "a", last: "before",
        frame: frame ?? (job.state === "failed" && bad ? bad.frame : 0) });
    await look(frames.length ? subject() : null);
    state.set({ job: id });
    show_frame();
    if (job.kind !== "run" && job.state === "done") open_report(jobPath(id));
}
const first_bad = () => frames.find(is_bad);
const subject = () => ({ name: `job ${job.id}`, job: job.id, input: job.request.input,
    camera: job.request.camera ?? "", state: job.state, frames });

page.leave_job = () => {
    ++asked;
    if (!job) return;
    close_report();
    job = null;
    state.set({ job: "" });
    by_id("job").hidden = true;
    by_id("chain").hidden = false;
    page.jobs.draw_jobs();
};

/** A new state of some job, perhaps of a list: without its request. */
export function job_changed(now) {
    if (now.id !== job?.id) return;
    const ended = now.state !== job.state;
    fails = ended && now.state === "failed";
    job = { ...job, ...now };
    draw();
    if (ended) {
        load_frames();
        if (job.kind !== "run" && job.state === "done") open_report(jobPath(job.id));
    }
}

const load_frames = settle(async () => {
    if (!job) return;
    const { id } = job;
    const all = await get_frames(id).catch(() => null);
    if (!all || id !== job?.id) return;
    const first = !frames.length;
    frames = all;
    if (fails) state.set({ frame: first_bad()?.frame ?? state.get("frame") });
    fails = false;
    if (first && frames.length) await look(subject());
    else if (frames.length) update_frames(frames, job.state);
    update_film();
    show_frame();
}, 300);

/** After the service was away. */
export const reload_job = () => job && load_frames();

/** An event: a finished frame is entered without a request. */
export function frame_event(type, id, data) {
    if (id !== job?.id) return;
    if (type === "frame") {
        const at = frames.findIndex((one) => one.frame === data.frame);
        if (at < 0) return load_frames();
        frames = frames.with(at, { ...frames[at], state: data.state ?? frames[at].state,
            filter_ms: data.filter_ms ?? frames[at].filter_ms });
        for (const key of ["frames", "done", "failed"])
            if (typeof data[key] === "number") job[key] = data[key];
        draw();
        update_frames(frames, job.state);
        update_film();
        if (data.frame === state.get("frame")) show_frame();
    } else if (["frames", "quarantined"].includes(type)) {
        load_frames();
    }
}

// Times and plan of the frame that is looked at.
const show_frame = settle(async () => {
    if (!job || !frames.length) return parts?.frame.replaceChildren();
    const { id } = job, number = state.get("frame");
    const one = await get(`${jobPath(id)}/frames/${number}`).catch(() => null);
    if (!one || id !== job?.id || number !== state.get("frame")) return undefined;
    return parts.frame.replaceChildren(
        h("h3", {}, `Frame ${number}`),
        h("p", { class: "help" }, ["written", "skipped"].includes(one.state)
            ? h("a", { href: `${jobPath(id)}/frames/${number}/output`, download: "" }, basename(one.output))
            : basename(one.output), one.attempts > 1 ? `, ${one.attempts} attempts` : ""),
        one.message ? h("p", { class: one.state === "written" ? "message" : "message bad" },
            one.message) : "",
        ...(one.sidecar ? sidecar(one.sidecar) : []));
}, 250);

/** What a plan left out, and why. */
export function left_out(plan) {
    const rows = (plan.left_out ?? []).map((one) => h("li", {}, h("span", { class: "what" },
        one.what), ` \u2014 ${one.reason} `, h("span", { class: "help" }, `(${one.rule})`)));
    return rows.length ? h("ul", { class: "left-out" }, rows)
        : h("p", { class: "help" }, "Nothing: this frame needs all of the chain.");
}

function sidecar(side) {
    const times_ms = side.times_ms || {}, plan = side.plan || {};
    const rows = [["read", times_ms.read, true], ["convert", times_ms.convert, true],
        ...(times_ms.passes || []).map((p) => [p.name, p.ms, false]), ["write", times_ms.write, true]]
        .filter(([, ms]) => typeof ms === "number");
    const longest = Math.max(...rows.map(([, ms]) => ms), 1e-6);
    return [h("table", {}, h("caption", { class: "sr" }, "Times"), h("thead", {}, h("tr", {},
        h("th", { scope: "col" }, "step"), h("th", { scope: "col", class: "num" }, "time"),
        h("th", { scope: "col" }, h("span", { class: "sr" }, "share")))),
    h("tbody", {}, rows.map(([name, ms, io]) => h("tr", {}, h("td", {}, name),
        h("td", { class: "num" }, milliseconds(ms)), h("td", { class: io ? "bar io" : "bar" },
            h("div", { style: { width: `${(100 * ms) / longest}%` } })))))),
    h("h3", {}, "Left out, and why"), left_out(plan),
    ...Object.entries(plan.missing_neighbors || {}).map(([where, why]) =>
        h("p", { class: "help" }, `No frame ${where}: ${why}.`)),
    ...(side.warnings || []).map((text) => h("p", { class: "message" }, text)),
    h("details", {}, h("summary", {}, "Sidecar"),
        h("pre", { tabindex: 0 }, JSON.stringify(side, null, 1)))];
}

export function start_job() {
    state.watch(["frame"], () => job && show_frame());
}
