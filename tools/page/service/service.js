// Views, login, and the line to the service.
import { by_id } from "../shared/dom.js";
import { get, listen, logIn, logOut, whenTokenIsNeeded } from "./api.js";
import { showJobs, jobEvent, refreshJobs } from "./jobs.js";
import { showNew } from "./submit.js";
import { showChain } from "./editor.js";

let source = null, asked = false;

function say(text, bad = false) {
    by_id("status").textContent = text;
    by_id("status").classList.toggle("bad", bad);
}

async function readiness() {
    try {
        const answer = await fetch("readyz");
        const ready = await answer.json();
        if (ready.ready) return say(`ready · ${(ready.renderer || "").split(" (")[0]}`);
        say(ready.draining ? "draining: takes no jobs" : `not ready: ${ready.why || ""}`, true);
    } catch {
        say("the service does not answer", true);
    }
}

function connect() {
    source?.close();
    let lost = false;
    source = listen(jobEvent, (state) => {
        if (state === "live") {
            if (lost) refreshJobs();
            lost = false;
            readiness();
        } else {
            lost = true;
            say("connection lost, trying again", true);
            if (state === "refused") setTimeout(start, 3000);
        }
    });
}

function route() {
    if (asked) return;
    const [view, id] = location.hash.slice(1).split("/");
    const chosen = ["jobs", "new", "chain"].includes(view) ? view : "jobs";
    for (const name of ["jobs", "new", "chain"]) by_id(name).hidden = name !== chosen;
    for (const link of document.querySelectorAll("nav a"))
        if (link.hash === `#${chosen}`) link.setAttribute("aria-current", "page");
        else link.removeAttribute("aria-current");
    if (chosen === "jobs") showJobs(id && decodeURIComponent(id));
    if (chosen === "new") showNew();
    if (chosen === "chain") showChain();
}

function askForToken() {
    if (asked) return;
    asked = true;
    source?.close();
    for (const name of ["jobs", "new", "chain"]) by_id(name).hidden = true;
    document.querySelector("nav").hidden = true;
    by_id("logout").hidden = true;
    by_id("login").hidden = false;
    say("");
    by_id("token").focus();
}

async function start() {
    let session;
    try {
        session = await get("v1/session");
    } catch (error) {
        say(error.message, true);
        return setTimeout(start, 3000);
    }
    if (!session.known) return askForToken();
    asked = false;
    by_id("login").hidden = true;
    document.querySelector("nav").hidden = false;
    by_id("logout").hidden = !session.token;
    connect();
    route();
}

by_id("login").querySelector("form").addEventListener("submit", async (event) => {
    event.preventDefault();
    const error = by_id("login").querySelector(".error");
    error.textContent = "";
    asked = true;
    try {
        await logIn(by_id("token").value.trim());
        by_id("token").value = "";
        await start();
    } catch (refusal) {
        error.textContent = refusal.status === 401 ? "This is not the token." : refusal.message;
    }
});
by_id("logout").addEventListener("click", async () => {
    await logOut();
    start();
});
addEventListener("hashchange", route);
addEventListener("pagehide", () => source?.close());
setInterval(() => source?.readyState === EventSource.OPEN && readiness(), 15000);
whenTokenIsNeeded(askForToken);
start();
