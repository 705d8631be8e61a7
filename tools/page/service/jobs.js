// The list of jobs, kept up to date by events, and the chosen one beside it.
import { by_id, h } from "../shared/dom.js";
import { clock } from "../shared/words.js";
import { get } from "./api.js";
import { frameEvent, showJob } from "./job.js";
import { basename, nameOf, progressOf } from "./job_words.js";

const jobs = new Map(); // id -> job, newest first
let chosen = null, next = null, loaded = false;
const waiting = new Set(); // ids to ask for

function row(job) {
    const shown = job.state === "running" && job.frames > 0;
    return h("li", {}, h("a", { href: `#jobs/${encodeURIComponent(job.id)}`,
        "aria-current": job.id === chosen ? "true" : null },
    h("span", { class: "name", title: nameOf(job) }, nameOf(job)),
    h("span", { class: `state ${job.state}` }, job.state),
    h("span", { class: "detail" }, progressOf(job) || basename(job.request?.output)),
    h("span", { class: "when" }, clock(job.created)),
    shown ? h("progress", { max: job.frames, value: job.done + job.failed,
        "aria-label": "progress" }) : null));
}

function draw() {
    const filter = by_id("filter").value;
    const shown = [...jobs.values()].filter((job) => !filter || job.state === filter)
        .sort((a, b) => b.created.localeCompare(a.created));
    const had = by_id("job-list").contains(document.activeElement) && document.activeElement.hash;
    by_id("job-list").replaceChildren(...shown.map(row));
    if (had) document.querySelector(`#job-list a[href="${CSS.escape(had)}"]`)?.focus();
    by_id("no-jobs").hidden = shown.length > 0;
    by_id("no-jobs").firstChild.textContent = filter ? `No jobs are ${filter}. ` : "No jobs yet. ";
    by_id("older").hidden = !next;
}

function keep(job) {
    jobs.set(job.id, job);
    if (job.id === chosen) showJob(job, addJob);
}

async function load(before = "") {
    const answer = await get(`v1/jobs?limit=100${before ? `&before=${before}` : ""}`);
    for (const job of answer.jobs) keep(job);
    next = answer.next;
    loaded = true;
    draw();
}

// A job with many events is asked for once in a while, not once for each of them.
async function ask() {
    const ids = [...waiting];
    waiting.clear();
    for (const job of await Promise.all(ids.map((id) => get(`v1/jobs/${id}`).catch(() => null))))
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
        const job = await get(`v1/jobs/${encodeURIComponent(chosen)}`).catch(() => null);
        if (job) jobs.set(job.id, job);
    }
    if (!chosen && jobs.size) chosen = [...jobs.values()]
        .sort((a, b) => b.created.localeCompare(a.created))[0].id;
    draw();
    if (jobs.has(chosen)) showJob(jobs.get(chosen), addJob, true);
    else by_id("job").replaceChildren(h("p", { class: "help" },
        chosen ? "There is no such job." : "Choose a job, or submit one."));
}

by_id("filter").addEventListener("change", draw);
by_id("older").addEventListener("click", () => load(next));
