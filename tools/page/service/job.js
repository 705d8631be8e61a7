// One job: progress, actions, report, frames with their pictures, passes and their times.
import { by_id, h, settle } from "../shared/dom.js";
import { clock, duration, milliseconds } from "../shared/words.js";
import { get, post, remove } from "./api.js";
import { basename, nameOf, progressOf } from "./job_words.js";

const kMostRows = 1000; // frames in the list
let shown = null;       // id
let frame = null;       // number of the chosen frame
let parts = {};

function actions(job) {
    const act = (label, what) => h("button", { type: "button", onclick: async (event) => {
        event.target.disabled = true;
        try {
            parts.changed(await what());
        } catch (error) {
            parts.error.textContent = error.message;
            event.target.disabled = false;
        }
    } }, label);
    const path = `v1/jobs/${encodeURIComponent(job.id)}`;
    const list = [];
    if (job.state === "queued" || job.state === "running")
        list.push(act("Cancel", () => remove(path)));
    if (job.state === "failed" || job.state === "canceled")
        list.push(act("Retry", () => post(`${path}/retry`)));
    if (job.kind !== "run" && job.state === "done") list.push(reportButton(path));
    return list;
}

function reportButton(path) {
    const open = parts.report.childElementCount > 0;
    return h("button", { type: "button", class: "primary", "aria-expanded": String(open),
        onclick: (event) => {
            const closes = parts.report.childElementCount > 0;
            // The report's scripts run in an origin of their own and cannot reach this page.
            parts.report.replaceChildren(...(closes ? [] : [h("iframe", {
                src: `${path}/report/index.html`, title: "Report",
                sandbox: "allow-scripts allow-downloads" })]));
            event.target.textContent = closes ? "Open report" : "Close report";
            event.target.setAttribute("aria-expanded", String(!closes));
        } }, open ? "Close report" : "Open report");
}

/** Beside the bar: who waits, how long it took. */
function timesOf(job) {
    if (job.state === "queued") return `submitted ${clock(job.created)}`;
    if (job.ended && job.started)
        return `${clock(job.started)}, took ${duration((Date.parse(job.ended) - Date.parse(job.started)) / 1000)}`;
    return job.started ? `started ${clock(job.started)}` : `submitted ${clock(job.created)}`;
}

function begin(job, changed) {
    shown = job.id;
    frame = null;
    parts = {
        changed,
        title: h("h2", {}, nameOf(job)), state: h("span"), actions: h("div", { class: "actions" }),
        progress: h("progress", { "aria-label": "frames done" }), line: h("p", { class: "progress-line" }),
        message: h("p"), error: h("p", { class: "error", role: "alert" }), report: h("div"),
        frames: h("div"), list: h("ul", { class: "frame-list", "aria-label": "Frames" }),
        detail: h("div", { "aria-live": "off" }),
    };
    parts.frames.append(h("h3", {}, "Frames"),
        h("div", { class: "frames" }, parts.list, parts.detail));
    parts.frames.hidden = true;
    by_id("job").replaceChildren(
        h("div", { class: "title" }, parts.title, parts.state, parts.actions),
        parts.progress, parts.line, parts.message, parts.error, parts.report, parts.frames,
        h("details", {}, h("summary", {}, "Request"),
            h("pre", {}, JSON.stringify(job.request, null, 2))));
    loadFrames(job.id);
}

/** changed(job) is called after an action with the job's new state. */
export function showJob(job, changed, fresh = false) {
    if (job.id !== shown) begin(job, changed);
    else if (fresh) loadFrames(job.id);
    parts.state.className = `state ${job.state}`;
    parts.state.textContent = job.state;
    parts.actions.replaceChildren(...actions(job));
    parts.progress.hidden = !job.frames;
    parts.progress.max = job.frames || 1;
    parts.progress.value = job.done + job.failed;
    parts.line.replaceChildren(h("span", {}, progressOf(job)), h("span", {}, timesOf(job)));
    const text = [job.verdict, job.message].filter(Boolean).join("\n");
    parts.message.hidden = !text;
    parts.message.className = job.state === "failed" ? "message bad" : "message";
    parts.message.textContent = text;
}

let known = [];
async function loadFrames(id) {
    const answer = await get(`v1/jobs/${encodeURIComponent(id)}/frames`).catch(() => null);
    if (!answer || id !== shown) return;
    known = answer.frames;
    drawFrames();
}
const reload = settle(() => shown && loadFrames(shown), 400);
export function frameEvent() { reload(); }

function drawFrames() {
    parts.frames.hidden = known.length === 0;
    const held = parts.list.contains(document.activeElement);
    const top = parts.list.scrollTop;
    parts.list.replaceChildren(...known.slice(0, kMostRows).map((f) => h("li", {}, h("button", {
        type: "button", "aria-pressed": String(f.frame === frame), "data-frame": f.frame,
        title: f.message || null, onclick: () => choose(f.frame),
    }, h("span", {}, String(f.frame)),
    h("span", { class: `state ${f.state}` }, f.state.replace("_", " "))))),
    ...(known.length > kMostRows ? [h("li", { class: "help" },
        `the first ${kMostRows} of ${known.length}`)] : []));
    parts.list.scrollTop = top;
    if (held) parts.list.querySelector(`[data-frame="${frame}"]`)?.focus();
    if (frame === null && known.length)
        choose((known.find((f) => f.state === "written" || f.state === "skipped") || known[0]).frame);
    else if (known.find((f) => f.frame === frame)?.state !== parts.detail.dataset.state)
        choose(frame);
}

function image(path, text, ready) {
    const box = h("div", { class: "picture" });
    if (!ready) box.append(h("p", {}, "not yet written"));
    else box.append(h("img", { src: path, alt: text, decoding: "async",
        onerror: () => box.replaceChildren(h("p", {}, "no picture")) }));
    return h("figure", {}, h("figcaption", {}, text), box);
}

async function choose(number) {
    frame = number;
    for (const button of parts.list.querySelectorAll("button"))
        button.setAttribute("aria-pressed", String(Number(button.dataset.frame) === number));
    const path = `v1/jobs/${encodeURIComponent(shown)}/frames/${number}`;
    const one = await get(path).catch(() => null);
    if (!one || frame !== number) return;
    const ready = one.state === "written" || one.state === "skipped";
    parts.detail.dataset.state = one.state;
    parts.detail.replaceChildren(
        h("div", { class: "pair" }, image(`${path}/before.png`, `Frame ${number}, before`, true),
            image(`${path}/after.png`, `Frame ${number}, after`, ready)),
        ...(one.message ? [h("p", { class: one.state === "written" ? "message" : "message bad" },
            one.message)] : []),
        ...(one.sidecar ? sidecar(one.sidecar) : []),
        h("p", { class: "help" }, [basename(one.output),
            one.attempts > 1 ? `${one.attempts} attempts` : ""].filter(Boolean).join(", ")));
}

function sidecar(side) {
    const times = side.times_ms || {}, plan = side.plan || {};
    const rows = [["read", times.read, true], ["convert", times.convert, true],
        ...(times.passes || []).map((p) => [p.name, p.ms, false]), ["write", times.write, true]]
        .filter(([, ms]) => typeof ms === "number");
    const longest = Math.max(...rows.map(([, ms]) => ms), 1e-6);
    const table = h("table", {}, h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "step"),
        h("th", { scope: "col", class: "num" }, "time"), h("th", {}))),
    h("tbody", {}, rows.map(([name, ms, io]) => {
        const bar = h("div");
        bar.style.width = `${(100 * ms) / longest}%`;
        return h("tr", {}, h("td", {}, name), h("td", { class: "num" }, milliseconds(ms)),
            h("td", { class: io ? "bar io" : "bar" }, bar));
    })));
    const left = (plan.left_out || []).map((one) => h("li", {},
        h("span", { class: "what" }, one.what), ` — ${one.reason} `,
        h("span", { class: "help" }, `(${one.rule})`)));
    return [h("h3", {}, "Times"), table,
        h("h3", {}, "Left out, and why"),
        left.length ? h("ul", { class: "left-out" }, left)
            : h("p", { class: "help" }, "Nothing: this frame needs all of the chain."),
        ...Object.entries(plan.missing_neighbors || {}).map(([side_, why]) =>
            h("p", { class: "help" }, `No frame ${side_}: ${why}.`)),
        ...(side.warnings || []).map((text) => h("p", { class: "message" }, text)),
        h("details", {}, h("summary", {}, "Sidecar"),
            h("pre", {}, JSON.stringify(side, null, 1)))];
}
