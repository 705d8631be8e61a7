// All settings of a new job: a form made from the schema of jobs, common settings first.
import { by_id, h } from "../shared/dom.js";
import { get, post } from "./api.js";
import { canEdit, field } from "./form.js";
import { chainOf, chainTitle, isCompared, shippedNames } from "./chains.js";
import { offer, what_exists } from "./existing.js";
import { left_out } from "./job.js";
import { page } from "./page.js";
import { yaml_of } from "./yaml.js";

const kFirst = ["study", "input", "output", "frames", "camera", "truth", "sweep", "under", "on_existing",
    "priority"];
const kElsewhere = ["kind", "chain", "chain_text", "chain_b", "chain_b_text"];
const kExamples = { study: "shots/order.yaml", input: "shots/a.####.exr", output: "out/a.####.exr", frames: "1-100",
    camera: "shots/camera.json" };
const kWords = { study: "Study file", input: "Frames to read", output: "Frames to write", frames: "Which frames",
    camera: "Camera file", truth: "Ground truth", priority: "Priority", on_existing: "If outputs exist",
    sweep: "Parameters to vary", under: "Error limits" };
// For ab, bench and study.
const kReport = { words: { output: "Folder of the report", on_existing: "If the folder has a report" },
    examples: { output: "out/report" } };

let schema = null, kind = "run", body = {};
let other_output;  // output of the other kind of job: frames while the form writes a report, and back
const writes_report = () => kind !== "run";

function change_kind(word) {
    const before = writes_report();
    kind = word;
    if (writes_report() === before) return;
    [body.output, other_output] = [other_output, body.output];
    if (body.output === undefined) delete body.output;
}

const kindSchema = () => schema.oneOf.find((one) => one.title === kind) || schema.oneOf[0];

function chainField(key, label) {
    const own = ["a", ...(isCompared() ? ["b"] : [])].map((which) =>
        h("option", { value: `=${which}` }, `${which.toUpperCase()}: ${chainTitle(which)}`));
    const file = h("option", { value: "=file" }, "a chain file …");
    const select = h("select", { id: `new-${key}` },
        own, shippedNames().map((name) => h("option", { value: name }, name)), file);
    const path = h("input", { type: "text", "aria-label": `${label}: file`, hidden: true,
        placeholder: "chains/shot.yaml", spellcheck: "false" });
    // A chain of the job that is duplicated, as an object or a text.
    const own_text = body[`${key}_text`] ?? (typeof body[key] === "object"
        ? yaml_of(body[key]) : undefined);
    const change = () => {
        path.hidden = select.value !== "=file";
        delete body[key];
        delete body[`${key}_text`];
        if (select.value === "=kept") body[`${key}_text`] = own_text;
        else if (/^=[ab]$/.test(select.value)) body[`${key}_text`] = chainOf(select.value[1]).text;
        else body[key] = select.value === "=file" ? path.value.trim() : select.value;
    };
    select.addEventListener("change", change);
    path.addEventListener("input", change);
    const known = ["a", "b"].find((which) => own_text !== undefined
        && chainOf(which).text === own_text);
    if (own_text !== undefined && !known) {
        select.append(h("option", { value: "=kept" }, "the job's own chain"));
        select.value = "=kept";
    } else {
        const given = known ? `=${known}`
            : body[key] === undefined ? (key === "chain_b" ? "paper" : "=a")
                : shippedNames().includes(body[key]) ? body[key] : "=file";
        select.value = given;
        if (given === "=file") path.value = body[key];
    }
    change();
    return h("div", { class: "field" }, h("label", { for: `new-${key}` }, label), select, path,
        h("p", { class: "help" }, "The chain beside the picture, a shipped one, or a file under a root."));
}

function form() {
    const own = kindSchema(), required = new Set(own.required || []);
    const change = (key) => (value) => {
        if (value === undefined) delete body[key];
        else body[key] = value;
    };
    const make = (key, wide = false) => field(key, own.properties[key], body[key], change(key), {
        required: required.has(key), wide,
        label: (writes_report() && kReport.words[key]) || kWords[key],
        placeholder: (writes_report() && kReport.examples[key]) || kExamples[key] });
    const keys = Object.keys(own.properties).filter((key) => !kElsewhere.includes(key)
        && canEdit(own.properties[key]));
    for (const key of Object.keys(body))
        if (!keys.includes(key) && !key.startsWith("chain")) delete body[key];
    if (kind === "study") { delete body.chain; delete body.chain_text; }
    if (kind !== "ab") { delete body.chain_b; delete body.chain_b_text; }
    const error = h("div", { role: "alert" });
    const button = h("button", { class: "primary" }, "Submit");
    const plan = h("button", { type: "button" }, "Plan only");
    const planned = h("div"), choices = h("div", { class: "buttons" });
    const attempt = async (who, what) => {
        error.replaceChildren();
        planned.replaceChildren();
        choices.replaceChildren();
        who.disabled = true;
        try {
            await what();
        } catch (refusal) {
            const short = what_exists(refusal);
            error.replaceChildren(refusal.errors.length && !short
                ? h("ul", {}, refusal.errors.map((one) => h("li", { class: "error" },
                    `${one.path ? `${one.path}: ` : ""}${one.message}`)))
                : h("p", { class: "error" }, short ?? refusal.message));
            for (const one of document.querySelectorAll("#new .field"))
                one.classList.toggle("bad", refusal.errors.some((e) =>
                    e.path === one.dataset.key || e.path.startsWith(`${one.dataset.key}[`)));
            choices.replaceChildren(...await offer(refusal, { kind, ...body }, submit));
        }
        who.disabled = false;
    };
    // more: keys that replace keys of the form.
    const submit = (more = {}) => attempt(button, async () => {
        const job = await post("v1/jobs", { kind, ...body, ...more });
        page.jobs.add_job(job);
        by_id("new").close();
        page.open_job(job.id);
    });
    plan.addEventListener("click", () => attempt(plan, async () => {
        const asked = Object.entries(body).filter(([key]) =>
            key !== "priority" && own.properties[key]?.["x-group"] !== "output");
        planned.replaceChildren(...planView(await post("v1/plan", Object.fromEntries(asked))));
    }));
    const made = h("form", { onsubmit: (event) => {
        event.preventDefault();
        submit();
    } },
    h("div", { class: "fields" },
        h("fieldset", { class: "field wide" }, h("legend", { class: "label" }, "What to do"),
            h("div", { class: "choices" }, [["run", "filter the frames"],
                ["ab", "compare two chains"], ["bench", "error against run time"], ["study", "both over several scenes"]].map(([word, what]) =>
                h("label", {}, h("input", { type: "radio", name: "kind", value: word,
                    checked: word === kind, autofocus: word === kind, onchange: () => { change_kind(word); draw(); } }),
                `${word}: ${what}`)))),
        kind === "study" ? null : chainField("chain", kind === "ab" ? "Chain A" : "Chain"),
        kind === "ab" ? chainField("chain_b", "Chain B") : null,
        kFirst.filter((key) => keys.includes(key)).map((key) => make(key))),
    h("details", {}, h("summary", {}, "More settings"),
        h("div", { class: "fields" },
            keys.filter((key) => !kFirst.includes(key)).map((key) => make(key)))),
    h("div", { class: "buttons" }, button, kind === "run" ? plan : null,
        h("button", { type: "button", onclick: () => by_id("new").close() }, "Close")),
    error, choices, planned);
    return made;
}

/** The passes of each frame, and what is left out and why. */
function planView(answer) {
    return [h("h3", {}, "Plan"), ...answer.frames.slice(0, 20).map((one) => {
        const plan = one.plan || { passes: [], left_out: [] };
        const order = plan.passes.map((p) => p.pass + (p.left_out ? " (left out)" : ""));
        return h("div", { class: "card" },
            h("p", {}, h("strong", {}, `Frame ${one.frame}`), one.plan
                ? `, ${plan.width} × ${plan.height}: ${order.join(", then ")}` : ""),
            one.error ? h("p", { class: "error" }, one.error) : null,
            (one.warnings || []).map((text) => h("p", { class: "help" }, text)),
            left_out(plan));
    })];
}

function draw() {
    by_id("new").replaceChildren(
        h("div", { class: "form-title" }, h("h2", {}, "New job"),
            h("p", { class: "help" }, "Paths are taken from the first root of the service.")),
        form());
}

/** The form, filled in with a job's request. */
export async function new_job(request) {
    schema = schema || await get("v1/schema/job");
    ({ kind = "run", ...body } = structuredClone(request));
    other_output = undefined;
    draw();
    by_id("new").showModal();
}
