// Requests to the service, and its events. Addresses are relative to the page, which a proxy may
// show under a path of its own.

/** An error reply of the service. */
class Refusal extends Error {
    constructor(status, problem) {
        super(problem.detail || problem.title || `HTTP ${status}`);
        this.status = status;
        this.errors = problem.errors || [];
    }
    /** Every fault, a line for each. */
    lines() {
        return this.errors.length ? this.errors
            .map((one) => `${one.path ? `${one.path}: ` : ""}${one.message}`) : [this.message];
    }
}

let on_unknown = () => {};
/** f(refusal): the service does not know the user. */
export function when_unknown(f) { on_unknown = f; }

async function request(method, path, body, { headers = {}, signal } = {}) {
    let answer;
    try {
        answer = await fetch(path, { method, body, signal, headers: body === undefined ? headers
            : { ...headers, "Content-Type": "application/json" } });
    } catch (error) {
        if (error.name === "AbortError") throw error;
        throw new Refusal(0, { detail: "The service does not answer." });
    }
    if (answer.ok) return answer;
    const refusal = new Refusal(answer.status, await answer.json().catch(() => ({})));
    if (answer.status === 401) on_unknown(refusal);
    throw refusal;
}

/** "v1/image?input=...&frame=1": members that are undefined are left out. */
export const address = (path, query) => `${path}?${new URLSearchParams(
    Object.entries(query).filter(([, value]) => value !== undefined))}`;
export const jobPath = (id) => `v1/jobs/${encodeURIComponent(id)}`;

export const get = async (path) => (await request("GET", path)).json();
/** All frames of a job, which come in pages. */
export async function get_frames(id) {
    const frames = [];
    for (let from = 0; from !== null;) {
        const reply = await get(address(`${jobPath(id)}/frames`, { from, limit: 5000 }));
        frames.push(...reply.frames);
        from = reply.next;
    }
    return frames;
}
/** All jobs that a search finds, which come in pages, newest first. */
export async function find_jobs(search) {
    const jobs = [];
    for (let before; before !== null;) {
        const reply = await get(address("v1/jobs", { search, before, limit: 500 }));
        jobs.push(...reply.jobs);
        before = reply.next;
    }
    return jobs;
}
export const getText = async (path) => (await request("GET", path)).text();
export const post = async (path, body) =>
    (await request("POST", path, body === undefined ? undefined : JSON.stringify(body))).json();
export const change = async (path, body) =>
    (await request("PATCH", path, JSON.stringify(body))).json();
export const remove = async (path) => (await request("DELETE", path)).json();
export const getValues = async (path) => (await request("GET", path)).arrayBuffer();

// Identifies this page: its next preview of a lane ends the one before.
const session = Array.from(crypto.getRandomValues(new Uint8Array(16)),
    (byte) => byte.toString(16).padStart(2, "0")).join("");
export const preview = async (body, lane, signal) => (await request("POST", "v1/preview",
    JSON.stringify(body), { signal, headers: { Accept: "image/vnd.postchain",
        "Preview-Session": `${session}-${lane}` } })).arrayBuffer();

/** onEvent({type, job, time, data}); onState("live", "lost", "refused"). */
export function listen(onEvent, onState) {
    const source = new EventSource("v1/events");
    source.onopen = () => onState("live");
    source.onmessage = (message) => onEvent(JSON.parse(message.data));
    source.onerror = () => onState(source.readyState === EventSource.CLOSED ? "refused" : "lost");
    return source;
}
