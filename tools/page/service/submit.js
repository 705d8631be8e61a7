// A new job: a form made from the schema of jobs, common settings first.
import { by_id, h } from "../shared/dom.js";
import { get, post } from "./api.js";
import { canEdit, field } from "./form.js";
import { addJob } from "./jobs.js";
import { editedText } from "./editor.js";

const kShipped = ["balanced", "fast", "best", "paper", "dof_first"];
const kFirst = ["study", "input", "output", "frames", "camera", "truth", "sweep", "under", "on_existing",
    "priority"];
const kElsewhere = ["kind", "chain", "chain_text", "chain_b", "chain_b_text"];
const kExamples = { study: "shots/order.yaml", input: "shots/a.####.exr", output: "out/a.####.exr", frames: "1-100",
    camera: "shots/camera.json" };
const kWords = { study: "Study file", input: "Frames to read", output: "Frames to write", frames: "Which frames",
    camera: "Camera file", truth: "Ground truth", priority: "Priority" };

let schema = null, kind = "run", body = {};

const kindSchema = () => schema.oneOf.find((one) => one.title === kind) || schema.oneOf[0];

function chainField(key, label) {
    const own = h("option", { value: "=editor" }, "the text in the chain editor");
    const file = h("option", { value: "=file" }, "a chain file …");
    const select = h("select", { id: `new-${key}` },
        kShipped.map((name) => h("option", { value: name }, name)), own, file);
    const path = h("input", { type: "text", "aria-label": `${label}: file`, hidden: true,
        placeholder: "chains/shot.yaml", spellcheck: "false" });
    const change = () => {
        path.hidden = select.value !== "=file";
        delete body[key];
        delete body[`${key}_text`];
        if (select.value === "=editor") body[`${key}_text`] = editedText();
        else body[key] = select.value === "=file" ? path.value.trim() : select.value;
    };
    select.addEventListener("change", change);
    path.addEventListener("input", change);
    const given = body[`${key}_text`] !== undefined ? "=editor"
        : body[key] === undefined || kShipped.includes(body[key]) ? body[key] : "=file";
    select.value = given || (key === "chain_b" ? "paper" : "balanced");
    if (given === "=file") path.value = body[key];
    change();
    return h("div", { class: "field" }, h("label", { for: `new-${key}` }, label), select, path,
        h("p", { class: "help" }, "A shipped chain, your own text, or a file under a root."));
}

function form() {
    const own = kindSchema(), required = new Set(own.required || []);
    const change = (key) => (value) => {
        if (value === undefined) delete body[key];
        else body[key] = value;
    };
    const make = (key, wide = false) => field(key, own.properties[key], body[key], change(key), {
        required: required.has(key), label: kWords[key], placeholder: kExamples[key], wide });
    const keys = Object.keys(own.properties).filter((key) => !kElsewhere.includes(key)
        && canEdit(own.properties[key]));
    for (const key of Object.keys(body))
        if (!keys.includes(key) && !key.startsWith("chain")) delete body[key];
    if (kind === "study") { delete body.chain; delete body.chain_text; }
    if (kind !== "ab") { delete body.chain_b; delete body.chain_b_text; }
    const error = h("div", { role: "alert" });
    const button = h("button", { class: "primary" }, "Submit");
    const plan = h("button", { type: "button" }, "Plan only");
    const planned = h("div");
    const ready = () => ({ kind, ...body });
    const attempt = async (who, what) => {
        error.replaceChildren();
        planned.replaceChildren();
        who.disabled = true;
        try {
            await what();
        } catch (refusal) {
            error.replaceChildren(refusal.errors.length
                ? h("ul", {}, refusal.errors.map((one) => h("li", { class: "error" },
                    `${one.path ? `${one.path}: ` : ""}${one.message}`)))
                : h("p", { class: "error" }, refusal.message));
            for (const one of document.querySelectorAll("#new .field"))
                one.classList.toggle("bad", refusal.errors.some((e) =>
                    e.path === one.dataset.key || e.path.startsWith(`${one.dataset.key}[`)));
        }
        who.disabled = false;
    };
    plan.addEventListener("click", () => attempt(plan, async () => {
        const asked = Object.entries(body).filter(([key]) =>
            key !== "priority" && own.properties[key]?.["x-group"] !== "output");
        planned.replaceChildren(...planView(await post("v1/plan", Object.fromEntries(asked))));
    }));
    const made = h("form", { onsubmit: (event) => {
        event.preventDefault();
        attempt(button, async () => {
            const job = await post("v1/jobs", ready());
            addJob(job);
            location.hash = `#jobs/${encodeURIComponent(job.id)}`;
        });
    } },
    h("div", { class: "fields" },
        h("fieldset", { class: "field wide" }, h("legend", { class: "label" }, "What to do"),
            h("div", { class: "choices" }, [["run", "filter the frames"],
                ["ab", "compare two chains"], ["bench", "error against run time"], ["study", "both over several scenes"]].map(([word, what]) =>
                h("label", {}, h("input", { type: "radio", name: "kind", value: word,
                    checked: word === kind, onchange: () => { kind = word; draw(); } }),
                `${word}: ${what}`)))),
        kind === "study" ? null : chainField("chain", kind === "ab" ? "Chain A" : "Chain"),
        kind === "ab" ? chainField("chain_b", "Chain B") : null,
        kFirst.filter((key) => keys.includes(key)).map((key) => make(key))),
    h("details", {}, h("summary", {}, "More settings"),
        h("div", { class: "fields" },
            keys.filter((key) => !kFirst.includes(key)).map((key) => make(key)))),
    h("div", { class: "buttons" }, button, kind === "run" ? plan : null), error, planned);
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
            h("ul", { class: "left-out" }, plan.left_out.map((l) => h("li", {},
                h("span", { class: "what" }, l.what), ` — ${l.reason} `,
                h("span", { class: "help" }, `(${l.rule})`)))));
    })];
}

function draw() {
    by_id("new").replaceChildren(
        h("div", { class: "form-title" }, h("h2", { id: "new-title" }, "New job"),
            h("p", { class: "help" }, "Paths are taken from the first root of the service.")),
        form());
}

export async function showNew() {
    schema = schema || await get("v1/schema/job");
    draw();
}
