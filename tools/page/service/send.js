// From the picture to a job: the frames that are looked at, through the chosen chain, into a folder
// beside them; and from a job back to the picture.
import { by_id, h, printable } from "../shared/dom.js";
import { ranges } from "../shared/words.js";
import { get, post } from "./api.js";
import { show_shot, open_folder } from "./browse.js";
import { activeKey, chainOf, chainTitle, compare, isCompared, load_chain, setChain, shippedName,
    whenChainsChange } from "./chains.js";
import { next_version, offer, what_exists } from "./existing.js";
import { left_out } from "./job.js";
import { model, page, state } from "./page.js";
import { yaml_of } from "./yaml.js";

let suggested = "";    // the output, until it is typed over
let filled = {};       // the shot that the fields are about

const parts_of = (path) => {
    const at = path.lastIndexOf("/");
    return [at < 0 ? "" : path.slice(0, at + 1), path.slice(at + 1)];
};

// "shots/sharp.####.exr" --> "shots/out/sharp_balanced.####.exr"
function suggestion() {
    if (model.subject.more?.output) return model.subject.more.output;
    const [folder, name] = parts_of(model.subject.input);
    const dot = name.search(/\.|$/);
    const word = chainTitle(activeKey()).replace(/\.\w+$/, "").replace(/\W+/g, "_");
    return `${folder}out/${name.slice(0, dot)}_${word}${name.slice(dot)}`;
}

function fill() {
    const { subject } = model;
    by_id("send").hidden = !subject || Boolean(subject.job);
    by_id("submit").textContent = `Submit job${isCompared() ? ` with ${activeKey().toUpperCase()}` : ""}`;
    if (!subject || subject.job) return;
    const output = by_id("output"), frames = by_id("which"), { input, more } = subject;
    if (input !== filled.input || more !== filled.more) {
        filled = { input, more };
        output.value = "";
        frames.value = more?.frames ?? "";
        by_id("send-error").textContent = "";
        by_id("existing").replaceChildren();
    }
    if (!output.value || output.value === suggested) output.value = suggested = suggestion();
    frames.placeholder = ranges(model.page_frames).replaceAll(" ", "");
    const cameras = [...new Set([...(page.folder()?.cameras ?? []), subject.camera].filter(Boolean))];
    by_id("camera").replaceChildren(h("option", { value: "" }, "of the frames"),
        ...cameras.map((path) => h("option", { value: path }, path)));
    by_id("camera").value = subject.camera;
}

const chain_key = (which, key) => (shippedName(which) ? { [key]: shippedName(which) }
    : { [`${key}_text`]: chainOf(which).text });

function request(which) {
    const { subject } = model;
    return { ...subject.more?.send, ...chain_key(which, "chain"), input: subject.input,
        output: by_id("output").value.trim(), mkdir: true,
        ...(subject.camera && { camera: subject.camera }),
        ...(by_id("which").value.trim() && { frames: by_id("which").value.trim() }) };
}

// more: keys that replace keys of the form.
async function submit(more = {}) {
    const button = by_id("submit"), error = by_id("send-error"), choices = by_id("existing");
    button.disabled = true;
    error.textContent = "";
    choices.replaceChildren();
    const body = { ...request(activeKey()), ...more };
    try {
        const job = await post("v1/jobs", body);
        page.jobs.add_job(job);
        await page.open_job(job.id);
    } catch (refusal) {
        error.textContent = printable(what_exists(refusal) ?? refusal.lines?.().join("\n") ?? refusal.message);
        choices.replaceChildren(...await offer(refusal, body, submit));
    }
    button.disabled = false;
}

/** A job's frames and chain with live previews. */
page.preview_job = async (job) => {
    const { kind, chain, chain_text, input, camera = "", output, frames, ...others } = job.request;
    const frame = state.get("frame");
    // Further keys are sent again; those of reading and planning count for previews too.
    const { properties } = (await get("v1/schema/job")).oneOf.find((one) => one.title === "run");
    const show = Object.fromEntries(Object.entries(others).filter(([key]) => key === "set"
        || ["input", "plan"].includes(properties[key]?.["x-group"])));
    const [folder] = parts_of(input);
    await open_folder(folder.replace(/\/$/, "") || ".");
    const found = page.folder()?.sequences.find((one) => one.path === input);
    if (!found) throw new Error(`${input}: no such frames`);
    if (typeof chain === "string") await load_chain(chain, "a");
    else setChain({ name: `job ${job.id}`, text: chain_text ?? yaml_of(chain) }, "a");
    page.leave_job();
    compare(false);
    state.set({ frame });
    await show_shot(found, camera, { send: others, show, output: await next_version(output), frames });
    page.show_tab("shots");
};

export function start_send() {
    by_id("send").addEventListener("submit", (event) => {
        event.preventDefault();
        submit();
    });
    by_id("settings").addEventListener("click", () => page.new_job({ ...request("a"),
        ...(isCompared() && { kind: "ab", ...chain_key("b", "chain_b"),
            output: by_id("output").value.replace(/[^/]*$/, "report"), mkdir: undefined }) }));
    by_id("camera").addEventListener("change", () => {
        const { subject } = model;
        show_shot({ path: subject.input, frames: ranges(model.page_frames) }, by_id("camera").value,
            subject.more);
    });
    const former = page.looked;
    page.looked = () => {
        former?.();
        fill();
    };
    whenChainsChange(fill);
    page.planned = (reply, why) => {
        const one = reply?.plan;
        const error = why || reply?.error || "";
        by_id("plan-error").textContent = printable(error);
        by_id("plan").replaceChildren(...(one ? [h("p", {}, one.passes.map((pass) => pass.pass
            + (pass.left_out ? " (left out)" : "")).join(", then ")),
        ...(reply.warnings ?? []).map((text) => h("p", { class: "message" }, text)),
        h("h3", {}, "Left out, and why"), left_out(one)] : []));
    };
}
