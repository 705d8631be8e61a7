// The list of jobs: searched by the service, kept up to date by events. Many events cost few
// requests: those of frames are applied as they are, others ask for the first page again.
import { by_id, h, printable, settle } from "../shared/dom.js";
import { rove } from "../shared/roving.js";
import { clock } from "../shared/words.js";
import { address, get, jobPath } from "./api.js";
import { frame_event, job_changed, open_job, shown_job } from "./job.js";
import { nameOf, outputOf, progressOf, shotOf, workOf } from "./job_words.js";
import { page } from "./page.js";

const kPage = 40;          // jobs of a request
const kMinGap = 1500;    // ms between two requests because of events

let jobs = null, next = null, mark = () => {}, asked = 0;  // jobs: null until the service has listed them
const rows = new Map();    // id -> {item, ...}

function row(job) {
    let row = rows.get(job.id);
    if (!row) {
        row = { thumbnail: h("img", { alt: "", loading: "lazy", class: "icon" }), name: h("span",
            { class: "name" }), state: h("span"), detail: h("span", { class: "detail" }),
        when: h("span", { class: "when" }), output: h("span", { class: "output" }),
        bar: h("progress", { "aria-hidden": "true" }) };
        row.button = h("button", { type: "button", class: "entry", tabindex: -1, "data-job": job.id,
            onclick: () => open_job(job.id) },
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
    mark();
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
    page.jobs = { add_job, replace_job, drop_job, draw_jobs };
}
