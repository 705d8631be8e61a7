// The chains A and B: text, the values that it has, and the six that matter first.
import { address, get, post } from "./api.js";
import { comments_of, yaml_of } from "./yaml.js";

const kKept = "postchain-chains";
export const kTiers = ["fast", "balanced", "best"];
const kLens = { shutter_frames: ["shutter_frames", "shutter_angle_deg"], f_stop: ["f_stop"],
    focus_distance: ["focus_distance", "focus_at"] };

// {name, text, value}; value: undefined while the service has not read the text, or if it is no chain.
const chains = { a: null, b: null };
let shipped = [], schema = null, active = "a", compared = false;
const listeners = [];

export const chainOf = (which) => chains[which];
export const activeChain = () => chains[active];
export const activeKey = () => active;
export const isCompared = () => compared;
export const chainSchema = () => schema;
export const shippedNames = () => shipped.map((one) => one.name);
/** f(why): "value" of a chain, "read" (the values of its text are known), "chosen" or "compared". */
export const whenChainsChange = (f) => listeners.push(f);
const tell = (why) => {
    keep();
    for (const f of listeners) f(why);
};

function keep() {
    try {
        localStorage.setItem(kKept, JSON.stringify({ compared, active,
            ...chains }));
    } catch { /* not kept: nothing depends on it */ }
}
function kept() {
    try {
        return JSON.parse(localStorage.getItem(kKept)) ?? {};
    } catch {
        return {};
    }
}

export async function loadChains() {
    [shipped, schema] = await Promise.all([
        get("v1/chains").then((reply) => reply.chains), get("v1/schema")]);
    const old = kept();
    for (const [key, name] of [["a", "balanced"], ["b", "fast"]]) {
        if (old[key]?.text) chains[key] = { ...old[key] };
        else chains[key] = of_shipped(name);
    }
    compared = Boolean(old.compared);
    active = compared && old.active === "b" ? "b" : "a";
}

function of_shipped(name) {
    const one = shipped.find((chain) => chain.name === name) ?? shipped[0];
    return { name: one.name, text: one.text, value: structuredClone(one.chain) };
}

export function choose(which) {
    active = which;
    tell("chosen");
}
export function compare(on) {
    compared = on;
    if (!on) active = "a";
    tell("compared");
}

export function setText(text) {
    chains[active] = { name: chains[active].name, text, value: undefined };
    tell("value");
}
/** The faults of a text. Values that it has become those of the chains with this text. */
export async function check_text(text) {
    const { diagnostics, chain } = await post("v1/chain/check", { text });
    const unread = Object.values(chains).filter((one) => one.text === text && !one.value && chain);
    for (const one of unread) one.value = structuredClone(chain);
    if (unread.length) tell("read");
    return { diagnostics, chain };
}
/** Another value of the active chain, made from a copy of the present one. */
export function edit(work) {
    const { name, value, text } = chains[active];
    if (!value) return;
    const copy = structuredClone(value);
    work(copy);
    chains[active] = { name, value: copy, text: comments_of(text) + yaml_of(copy) };
    tell("value");
}
export function setChain({ name, value, text = yaml_of(value) }, which = active) {
    chains[which] = { name, text, value: structuredClone(value) };
    tell("value");
}

/** A shipped chain by its name, or a file; lens and shutter stay. */
export async function load_chain(name) {
    const one = shipped.find((chain) => chain.name === name)
        ?? (await get(address("v1/chains", { file: name }))).chains[0];
    const camera = activeChain().value?.camera;
    if (!camera) return setChain({ name, value: one.chain, text: one.text });
    const { postchain, ...rest } = one.chain;
    const value = { postchain, ...rest, camera: { ...camera, ...rest.camera } };
    return setChain({ name, value, text: comments_of(one.text) + yaml_of(value) });
}

export const passName = (pass) => (typeof pass === "string" ? pass : Object.keys(pass)[0]);
export const passValues = (pass) => (typeof pass === "string" ? {} : pass[passName(pass)] ?? {});

/** A value of lens or shutter: the chain's, otherwise the one in `resolved`, the plan's camera. */
export function lensValue(key, resolved, chain = activeChain()) {
    const own = chain.value?.camera?.[key];
    if (typeof own === "number") return own;
    for (const pass of chain.value?.passes ?? []) {
        const values = passValues(pass);
        if (typeof values[key] === "number") return values[key];
        if (key === "shutter_frames" && typeof values.shutter_angle_deg === "number")
            return values.shutter_angle_deg / 360;
    }
    return resolved?.[key]?.value;
}
export function setLens(key, number) {
    edit((chain) => {
        const rest = { ...chain.camera, [key]: number };
        const { postchain, ...others } = chain;
        delete others.camera;
        for (const k of Object.keys(chain)) delete chain[k];
        Object.assign(chain, { postchain, camera: rest }, others);
        for (const pass of chain.passes)
            for (const other of kLens[key]) delete passValues(pass)[other];
    });
}
export function unsetLens(key) {
    edit((chain) => {
        if (chain.camera) delete chain.camera[key];
        if (chain.camera && !Object.keys(chain.camera).length) delete chain.camera;
    });
}

// depth_of_field reads no samples with its other method.
const takesSamples = (pass) => passValues(pass).method !== "gilham"
    && schema.$defs[`pass.${passName(pass)}`]?.properties.samples;

export function samples(chain = activeChain()) {
    const pass = chain.value?.passes.find(takesSamples);
    return pass && (passValues(pass).samples ?? takesSamples(pass).default);
}
export function setSamples(count) {
    edit((chain) => {
        chain.passes = chain.passes.map((pass) => {
            const row = takesSamples(pass);
            if (!row) return pass;
            let number = Math.min(Math.max(count, row.minimum), row.maximum);
            if (row.not?.multipleOf === 2 && number % 2 === 0) number += 1;
            return { [passName(pass)]: { ...passValues(pass), samples: number } };
        });
    });
}

export const kOrders = ["together", "lens, then shutter", "shutter, then lens"];
/** Index into kOrders; undefined: only one of them, or another chain. */
export function order(chain = activeChain()) {
    const names = chain.value?.passes.map(passName) ?? [];
    if (names.includes("joint_blur")) return 0;
    const [lens, shutter] = ["depth_of_field", "motion_blur"].map((name) => names.indexOf(name));
    if (lens < 0 || shutter < 0) return undefined;
    return lens < shutter ? 1 : 2;
}
export function setOrder(index) {
    const now = order();
    if (now === index || now === undefined) return;
    const count = samples();
    edit((chain) => {
        const blurs = ["joint_blur", "depth_of_field", "motion_blur"];
        const at = chain.passes.findIndex((pass) => blurs.includes(passName(pass)));
        const former = Object.fromEntries(chain.passes.map((pass) => [passName(pass), pass]));
        const rest = chain.passes.filter((pass) => !blurs.includes(passName(pass)));
        const wanted = index === 0 ? ["joint_blur"]
            : index === 1 ? ["depth_of_field", "motion_blur"] : ["motion_blur", "depth_of_field"];
        rest.splice(at, 0, ...wanted.map((name) => former[name] ?? { [name]: {} }));
        chain.passes = rest;
    });
    if (count !== undefined && (now === 0 || index === 0)) setSamples(count);
}

const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);
/** Index into kTiers of the shipped chain with these passes, or -1. */
export function tier(chain = activeChain()) {
    return kTiers.findIndex((name) =>
        same(shipped.find((one) => one.name === name)?.chain.passes, chain.value?.passes));
}
/** The name of the chain, marked if it is no longer as it was loaded. */
export function chainTitle(which) {
    const { name, value } = chains[which];
    const one = shipped.find((chain) => chain.name === name);
    return !one || same(one.chain, value) ? name : `${name}, edited`;
}
/** "balanced" if the chain is as shipped, else undefined. */
export const shippedName = (which) => {
    const one = shipped.find((chain) => chain.name === chains[which].name);
    return one && same(one.chain, chains[which].value) ? one.name : undefined;
};
