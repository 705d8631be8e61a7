// The chains A and B: shipped chains, chain files, or a job's own one. Their values are edited elsewhere.
import { address, get } from "./api.js";
import { basename } from "./job_words.js";

const kKept = "postchain-chains";

const chains = { a: null, b: null };  // {name, text}
let shipped = [], active = "a", compared = false;
const listeners = [];

export const chainOf = (which) => chains[which];
/** "balanced", "night.yaml", "job 12" */
export const chainTitle = (which) => basename(chains[which].name);
export const activeChain = () => chains[active];
export const activeKey = () => active;
export const isCompared = () => compared;
export const shippedNames = () => shipped.map((one) => one.name);
const isShipped = (name) => shippedNames().includes(name);
/** "balanced" if the chain is a shipped one, else undefined. */
export const shippedName = (which) => (isShipped(chains[which].name) ? chains[which].name : undefined);

/** f(why): a chain was "loaded", another one was "chosen", or B was opened or closed ("compared"). */
export const whenChainsChange = (f) => listeners.push(f);
function tell(why) {
    try {
        localStorage.setItem(kKept, JSON.stringify({ compared, active, ...chains }));
    } catch { /* not kept: nothing depends on it */ }
    for (const f of listeners) f(why);
}
function kept() {
    try {
        return JSON.parse(localStorage.getItem(kKept)) ?? {};
    } catch {
        return {};
    }
}

export function choose(which) {
    active = which;
    tell("chosen");
}
export function compare(on) {
    compared = on;
    active = on ? "b" : "a";
    tell("compared");
}
export function setChain({ name, text }, which = active) {
    chains[which] = { name, text };
    tell("loaded");
}

/** A shipped chain by its name, or a file. */
async function read_chain(file) {
    const { name, text } = shipped.find((one) => one.name === file)
        ?? (await get(address("v1/chains", { file }))).chains[0];
    return { name, text };
}
export const load_chain = async (name, which = active) => setChain(await read_chain(name), which);

/** Files may have been edited since; one that cannot be read stays as it was. */
export async function read_files_again() {
    for (const [which, { name, text }] of Object.entries(chains)) {
        const now = /[./]/.test(name) && await read_chain(name).catch(() => undefined);
        if (now && now.text !== text && chains[which].name === name) setChain(now, which);
    }
}

export async function loadChains() {
    shipped = (await get("v1/chains")).chains;
    const old = kept();
    for (const [which, usual] of [["a", "balanced"], ["b", "fast"]]) {
        const { name, text } = old[which] ?? {};
        chains[which] = text && !isShipped(name) ? { name, text }
            : await read_chain(isShipped(name) ? name : usual);
    }
    compared = Boolean(old.compared);
    active = compared && old.active === "b" ? "b" : "a";
    await read_files_again();
}
