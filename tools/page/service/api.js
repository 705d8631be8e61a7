// Requests to the service, and its events. Addresses are relative to the page, which a proxy may
// show under a path of its own.

/** An error reply of the service. */
export class Refusal extends Error {
    constructor(status, problem) {
        super(problem.detail || problem.title || `HTTP ${status}`);
        this.status = status;
        this.errors = problem.errors || [];
    }
}

let onLogin = () => {};
export function whenTokenIsNeeded(f) { onLogin = f; }

async function request(method, path, body, headers = {}) {
    let answer;
    try {
        answer = await fetch(path, {
            method, headers: body === undefined ? headers
                : { ...headers, "Content-Type": "application/json" }, body,
        });
    } catch {
        throw new Refusal(0, { detail: "The service does not answer." });
    }
    if (answer.ok) return answer;
    if (answer.status === 401) onLogin();
    const problem = await answer.json().catch(() => ({}));
    throw new Refusal(answer.status, problem);
}

export const get = async (path) => (await request("GET", path)).json();
export const post = async (path, body) =>
    (await request("POST", path, body === undefined ? undefined : JSON.stringify(body))).json();
export const remove = async (path) => (await request("DELETE", path)).json();
// Identifies this page: its next preview ends the one before.
const session = Array.from(crypto.getRandomValues(new Uint8Array(16)),
    (byte) => byte.toString(16).padStart(2, "0")).join("");
export const picture = async (path, body, signal) => {
    const answer = await fetch(path, { method: "POST", signal, body: JSON.stringify(body),
        headers: { "Content-Type": "application/json", "Preview-Session": session } });
    if (!answer.ok) throw new Refusal(answer.status, await answer.json().catch(() => ({})));
    return answer.blob();
};
export const logIn = (token) =>
    request("POST", "v1/session", undefined, { Authorization: `Bearer ${token}` });
export const logOut = () => request("DELETE", "v1/session");

/** onEvent({type, job, time, data}); onState("live", "lost", "refused"). */
export function listen(onEvent, onState) {
    const source = new EventSource("v1/events");
    source.onopen = () => onState("live");
    source.onmessage = (message) => onEvent(JSON.parse(message.data));
    source.onerror = () => onState(source.readyState === EventSource.CLOSED ? "refused" : "lost");
    return source;
}
