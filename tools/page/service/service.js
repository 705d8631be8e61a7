// The parts of the page, deep links, and the line to the service.
import { by_id, printable } from "../shared/dom.js";
import { rove } from "../shared/roving.js";
import { get, listen, when_unknown } from "./api.js";
import { folder, open_folder, open_shot, start_browse } from "./browse.js";
import { start_chain_panel } from "./chain_panel.js";
import { loadChains } from "./chains.js";
import { start_film } from "./film.js";
import { open_job, reload_job, shown_job, start_job } from "./job.js";
import { job_event, refresh_jobs, start_jobs } from "./jobs.js";
import { look, look_again, start_look } from "./look.js";
import { page, state } from "./page.js";
import { start_report } from "./report_frame.js";
import { start_send } from "./send.js";
import { new_job } from "./submit.js";

let source = null, started = false;

function say(text, bad = false) {
    by_id("status").textContent = text;
    by_id("status").classList.toggle("bad", bad);
}
/** Shows an error until it is closed, something else is opened or the service answers again. */
page.fail = (error) => {
    by_id("failure").textContent = printable(error.lines?.().join("\n") ?? error.message);
    by_id("failure-box").hidden = false;
};
page.clear_failure = () => { by_id("failure-box").hidden = true; };

async function readiness() {
    try {
        const ready = await (await fetch("readyz")).json();
        if (ready.ready) return say(`ready \u00b7 ${(ready.renderer || "").split(" (")[0]}`);
        say(ready.draining ? "draining: takes no jobs" : `not ready: ${ready.why || ""}`, true);
    } catch {
        say("the service does not answer", true);
    }
}

function read_again() {
    page.clear_failure();
    refresh_jobs();
    reload_job();
    look_again();
}

function connect() {
    source?.close();
    let lost = false;
    source = listen(job_event, (now) => {
        if (now === "live") {
            if (lost) read_again();
            lost = false;
            readiness();
        } else {
            lost = true;
            say("connection lost, trying again", true);
            if (now === "refused") setTimeout(start, 3000);
        }
    });
}

page.show_tab = (name) => {
    for (const one of ["shots", "jobs"]) {
        by_id(one).hidden = one !== name;
        by_id(`show-${one}`).setAttribute("aria-selected", one === name);
        by_id(`show-${one}`).tabIndex = one === name ? 0 : -1;
    }
};

// Opens the shot or job that the address names, or closes the open one.
async function follow_address() {
    const job = state.get("job"), shot = state.get("shot"), frame = state.get("frame");
    if (shot && !job) return open_shot(shot, state.get("camera"), frame);
    if (!folder()) await open_folder("");
    if (job) return open_job(job, frame || undefined);
    page.leave_job();
    page.show_tab("shots");
    return look(null);
}

// The shot or job that is shown, as the address names it.
function shown_address() {
    const { subject } = page.model, job = shown_job() ?? "";
    return { job, shot: job ? "" : subject?.input ?? "", camera: job ? "" : subject?.camera ?? "" };
}

function first_start() {
    started = true;
    start_look();
    start_film();
    start_browse();
    start_jobs();
    start_job();
    start_report();
    start_chain_panel();
    start_send();
    page.show_tab("shots");
    look(null);
    // Another address typed or followed, Back and Forward.
    addEventListener("hashchange", () => {
        if (Object.entries(shown_address()).some(([key, value]) => state.get(key) !== value))
            follow_address();
    });
}

/** Without a user: a proxy logs people in. */
function refuse(refusal) {
    source?.close();
    for (const name of ["work", "new-job"]) by_id(name).hidden = true;
    by_id("refused").hidden = false;
    by_id("refusal").textContent = refusal.status === 403 ? printable(refusal.message) : "";
    say("");
}

async function start() {
    let who;
    try {
        who = await get("v1/user");
    } catch (error) {
        if (error.status === 401) return undefined;  // refuse() was called
        if (error.status === 403) return refuse(error);
        say(error.message, true);
        return setTimeout(start, 3000);
    }
    by_id("work").hidden = false;
    by_id("user").textContent = who.user;
    await loadChains();
    if (!started) first_start();
    connect();
    refresh_jobs();
    return follow_address();
}

// Alt and a digit: to a part of the page.
const kPlaces = { 1: "shots", 2: "jobs", 3: "canvas", 4: "film", 5: "load" };
function go_to(place) {
    if (place === "shots" || place === "jobs") page.show_tab(place);
    const box = by_id(place);
    (box.matches("canvas") ? box : box.querySelector("[tabindex='0'], input:not(:disabled)")
        ?? box).focus();
}

by_id("new-job").addEventListener("click", () => page.new_job({}));
by_id("failure-close").addEventListener("click", page.clear_failure);
for (const name of ["shots", "jobs"])
    by_id(`show-${name}`).addEventListener("click", () => page.show_tab(name));
rove(by_id("tabs"), () => [...by_id("tabs").children], { horizontal: true });
by_id("tabs").addEventListener("focusin", (event) => event.target.click());
addEventListener("keydown", (event) => {
    if (!event.altKey || event.ctrlKey || event.metaKey || !kPlaces[event.key]) return;
    event.preventDefault();
    go_to(kPlaces[event.key]);
});
addEventListener("pagehide", () => source?.close());
setInterval(() => source?.readyState === EventSource.OPEN && readiness(), 15000);
when_unknown(refuse);
Object.assign(page, { new_job, open_job, folder });
globalThis.postchain = page;  // for tests and the console
start();
