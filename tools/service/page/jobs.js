// The list of jobs, kept up to date by events, and the chosen one beside it.
import { get } from "./api.js";
import { $, clock, duration, el } from "./dom.js";
import { frameEvent, showJob } from "./job.js";

const jobs = new Map(); // id -> job, newest first
let chosen = null, next = null, loaded = false;
const waiting = new Set(); // ids to ask for

export const basename = (text) => String(text || "").split("/").pop();

/** "run balanced: shot.####.exr" */
export function nameOf(job) {
    const request = job.request || {};
    const chain = typeof request.chain === "string" ? basename(request.chain) : "own chain";
    const other = typeof request.chain_b === "string" ? ` / ${basename(request.chain_b)}` : "";
    return `${job.kind} ${chain}${other}: ${basename(request.input)}`;
}

/** "34 of 100 frames, 2 failed, 1 min left" */
export function progressOf(job) {
    const parts = [];
    if (job.frames) parts.push(`${job.done} of ${job.frames} frames`);
    if (job.failed) parts.push(`${job.failed} failed`);
    if (job.state === "running" && job.remaining_s > 0)
        parts.push(`${duration(job.remaining_s)} left`);
    return parts.join(", ");
}

function row(job) {
    const shown = job.state === "running" && job.frames > 0;
    return el("li", {}, el("a", { href: `#jobs/${encodeURIComponent(job.id)}`,
        "aria-current": job.id === chosen ? "true" : null },
    el("span", { class: "name", title: nameOf(job) }, nameOf(job)),
    el("span", { class: `state ${job.state}` }, job.state),
    el("span", { class: "detail" }, progressOf(job) || basename(job.request?.output)),
    el("span", { class: "when" }, clock(job.created)),
    shown ? el("progress", { max: job.frames, value: job.done + job.failed,
        "aria-label": "progress" }) : null));
}

function draw() {
    const filter = $("filter").value;
    const shown = [...jobs.values()].filter((job) => !filter || job.state === filter)
        .sort((a, b) => b.created.localeCompare(a.created));
    const had = $("job-list").contains(document.activeElement) && document.activeElement.hash;
    $("job-list").replaceChildren(...shown.map(row));
    if (had) document.querySelector(`#job-list a[href="${CSS.escape(had)}"]`)?.focus();
    $("no-jobs").hidden = shown.length > 0;
    $("no-jobs").firstChild.textContent = filter ? `No jobs are ${filter}. ` : "No jobs yet. ";
    $("older").hidden = !next;
}

function keep(job) {
    jobs.set(job.id, job);
    if (job.id === chosen) showJob(job);
}

async function load(before = "") {
    const answer = await get(`/v1/jobs?limit=100${before ? `&before=${before}` : ""}`);
    for (const job of answer.jobs) keep(job);
    next = answer.next;
    loaded = true;
    draw();
}

// A job with many events is asked for once in a while, not once for each of them.
async function ask() {
    const ids = [...waiting];
    waiting.clear();
    for (const job of await Promise.all(ids.map((id) => get(`/v1/jobs/${id}`).catch(() => null))))
        if (job) keep(job);
    draw();
}
let timer = 0;
export function jobEvent(event) {
    waiting.add(event.job);
    if (event.job === chosen) frameEvent(event);
    if (!timer) timer = setTimeout(() => { timer = 0; ask(); }, 250);
}

export const refreshJobs = () => load();
export const addJob = (job) => { keep(job); draw(); };

export async function showJobs(id) {
    chosen = id || chosen;
    if (!loaded) await load();
    if (chosen && !jobs.has(chosen)) {
        const job = await get(`/v1/jobs/${encodeURIComponent(chosen)}`).catch(() => null);
        if (job) jobs.set(job.id, job);
    }
    if (!chosen && jobs.size) chosen = [...jobs.values()]
        .sort((a, b) => b.created.localeCompare(a.created))[0].id;
    draw();
    if (jobs.has(chosen)) showJob(jobs.get(chosen), true);
    else $("job").replaceChildren(el("p", { class: "help" },
        chosen ? "There is no such job." : "Choose a job, or submit one."));
}

$("filter").addEventListener("change", draw);
$("older").addEventListener("click", () => load(next));
