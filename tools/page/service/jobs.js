// The list of jobs: searched by the service, kept up to date by events. Many events cost few
// requests: those of frames are applied as they are, others ask for the first page again.
import { by_id, h, printable, settle } from "../shared/dom.js";
import { rove } from "../shared/roving.js";
import { clock } from "../shared/words.js";
import { address, get, jobPath, remove } from "./api.js";
import { frame_event, job_changed, open_job, shown_job } from "./job.js";
import { nameOf, outputOf, progressOf, shotOf, workOf } from "./job_words.js";
import { page } from "./page.js";

const kPage = 40;          // jobs of a request
const kMinGap = 1500;    // ms between two requests because of events

let jobs = null, next = null, mark = () => {}, asked = 0;  // jobs: null until the service has listed them
let chosen = null;         // ids of the jobs that are chosen, while several are
let anchor = null;         // the one chosen last: Shift chooses up to it
const rows = new Map();    // id -> {item, ...}
const is_open = ({ state }) => state === "queued" || state === "running";

function row(job) {
    let row = rows.get(job.id);
    if (!row) {
        row = { thumbnail: h("img", { alt: "", loading: "lazy", class: "icon" }), name: h("span",
            { class: "name" }), state: h("span"), detail: h("span", { class: "detail" }),
        when: h("span", { class: "when" }), output: h("span", { class: "output" }),
        bar: h("progress", { "aria-hidden": "true" }) };
        row.button = h("button", { type: "button", class: "entry", tabindex: -1, "data-job": job.id,
            onclick: (event) => (chosen ? choose(job.id, event.shiftKey) : open_job(job.id)) },
        row.thumbnail, row.name, row.state, row.detail, row.when, row.output, row.bar);
        row.item = h("li", {}, row.button);
        row.thumbnail.addEventListener("error", () => row.thumbnail.classList.add("none"));
        rows.set(job.id, row);
    }
    row.name.textContent = printable(shotOf(job));
    row.button.title = printable([nameOf(job), outputOf(job)].filter(Boolean).join("\n"));
    row.state.className = `state ${job.state}`;
    row.state.textContent = job.place ? `queued, ${job.place}${kOrdinals[job.place] ?? "th"}` : job.state;
    row.detail.textContent = printable([job.owner, workOf(job), progressOf(job, true)]
        .filter(Boolean).join(" \u00b7 "));
    row.when.textContent = clock(job.created);
    row.output.textContent = outputOf(job) && printable(`\u2192 ${outputOf(job)}`);
    if (chosen) row.button.setAttribute("aria-pressed", chosen.has(job.id));
    else row.button.removeAttribute("aria-pressed");
    row.bar.hidden = job.state !== "running" || !job.frames;
    row.bar.max = job.frames || 1;
    row.bar.value = job.done + job.failed;
    if (job.id === shown_job()) row.button.setAttribute("aria-current", "true");
    else row.button.removeAttribute("aria-current");
    const pictured = `${job.ended ? job.state : job.done > 0}`;
    if (row.pictured !== pictured) {
        row.pictured = pictured;
        row.thumbnail.classList.remove("none");
        row.thumbnail.removeAttribute("src");
        row.thumbnail.src = address(`${jobPath(job.id)}/thumbnail.png`, { side: 120 });
    }
    return row.item;
}
const kOrdinals = { 1: "st", 2: "nd", 3: "rd" };

export function draw_jobs() {
    const list = by_id("job-list");
    const items = (jobs ?? []).map(row);
    if (items.length !== list.children.length || items.some((item, i) => item !== list.children[i])) {
        const held = list.contains(document.activeElement) ? document.activeElement : null;
        list.replaceChildren(...items);
        held?.focus({ preventScroll: true });
    }
    const filtered = by_id("search").value.trim() || by_id("filter").value;
    by_id("no-jobs").hidden = items.length > 0;
    by_id("no-jobs").textContent = !jobs ? "" : filtered ? "No job matches." : "No jobs yet.";
    by_id("older").hidden = !next;
    by_id("many").hidden = !items.length && !chosen;
    draw_choice();
    mark();
}

// ------------------------------------------------------------------------- several jobs at once
const chosen_jobs = (wanted) => (jobs ?? []).filter((job) => chosen?.has(job.id) && wanted(job));

function draw_choice() {
    by_id("choose").setAttribute("aria-pressed", Boolean(chosen));
    for (const name of ["choose-all", "cancel-chosen", "remove-chosen"]) by_id(name).hidden = !chosen;
    const open = chosen_jobs(is_open).length, ended = chosen_jobs((job) => job.ended).length;
    by_id("cancel-chosen").textContent = `Cancel ${open}`;
    by_id("cancel-chosen").disabled = !open;
    by_id("remove-chosen").textContent = `Remove ${ended}`;
    by_id("remove-chosen").disabled = !ended;
}

function choose(id, up_to) {
    const ids = jobs.map((job) => job.id), from = ids.indexOf(anchor), to = ids.indexOf(id);
    if (up_to && from >= 0)
        for (const one of ids.slice(Math.min(from, to), Math.max(from, to) + 1)) chosen.add(one);
    else if (!chosen.delete(id)) chosen.add(id);
    anchor = id;
    draw_jobs();
}

async function each_chosen(wanted, work) {
    const faults = [];
    for (const job of chosen_jobs(wanted))
        await work(job).catch((error) => faults.push(`job ${job.id}: ${error.message}`));
    chosen = null;
    draw_jobs();
    if (faults.length) page.fail(new Error(faults.join("\n")));
}

function start_choice() {
    by_id("choose").addEventListener("click", () => {
        chosen = chosen ? null : new Set();
        draw_jobs();
    });
    by_id("choose-all").addEventListener("click", () => {
        const all = jobs.every((job) => chosen.has(job.id));
        chosen = new Set(all ? [] : jobs.map((job) => job.id));
        draw_jobs();
    });
    by_id("cancel-chosen").addEventListener("click", () => each_chosen(is_open, async (job) => {
        const now = await remove(jobPath(job.id));
        job_changed(now);
        replace_job(now);
    }));
    by_id("remove-chosen").addEventListener("click", () => each_chosen((job) => job.ended, async (job) => {
        await remove(`${jobPath(job.id)}/record`);
        drop_job(job.id);
        if (job.id === shown_job()) page.leave_job();
    }));
}

async function load(before) {
    const mine = ++asked;
    const reply = await get(address("v1/jobs", { limit: kPage, before,
        search: by_id("search").value.trim() || undefined,
        state: by_id("filter").value || undefined })).catch((error) => page.fail(error));
    if (!reply || mine !== asked) return;
    jobs = before ? [...jobs ?? [], ...reply.jobs] : reply.jobs;
    next = reply.next;
    for (const job of reply.jobs) job_changed(job);
    draw_jobs();
}

// At once, then at most once in a while.
let timer = 0, last = 0;
export function refresh_jobs() {
    if (timer) return;
    timer = setTimeout(() => {
        timer = 0;
        last = performance.now();
        load();
    }, Math.max(50, last + kMinGap - performance.now()));
}

export function job_event({ type, job: id, data }) {
    frame_event(type, id, data);
    const job = jobs?.find((one) => one.id === id);
    if (type !== "frame" || !job) {
        if (type !== "progress" && type !== "frame_failed") refresh_jobs();
        return;
    }
    for (const key of ["frames", "done", "failed"])
        if (typeof data[key] === "number") job[key] = data[key];
    row(job);
}

export function add_job(job) {
    jobs = [job, ...(jobs ?? []).filter((one) => one.id !== job.id)];
    draw_jobs();
}
export function replace_job(job) {
    jobs = (jobs ?? []).map((one) => (one.id === job.id ? job : one));
    draw_jobs();
}
export function drop_job(id) {
    jobs = (jobs ?? []).filter((one) => one.id !== id);
    draw_jobs();
}

export function start_jobs() {
    const list = by_id("job-list");
    mark = rove(list, () => [...list.querySelectorAll("button")],
        { chosen: () => list.querySelector("[aria-current]") ?? undefined });
    by_id("search").addEventListener("input", settle(() => load(), 250));
    by_id("search").addEventListener("keydown", (event) => {
        if (event.key !== "ArrowDown") return;
        event.preventDefault();
        list.querySelector("button")?.focus();
    });
    by_id("filter").addEventListener("change", () => load());
    by_id("older").addEventListener("click", () => load(next));
    start_choice();
    page.jobs = { add_job, replace_job, drop_job, draw_jobs };
}
