// The chain editor: passes as forms made from the schema, and the text. The text is submitted; the
// forms write it, and follow it while it is JSON.
import { by_id, h, new_id, settle } from "../shared/dom.js";
import { get, picture, post } from "./api.js";
import { canEdit, field } from "./form.js";

const kStart = { postchain: 1, passes: [{ joint_blur: {} }, { fxaa: {} }] };
const kKept = "postchain-chain", kPreview = "postchain-preview";

let schema = null, parts = null, chain = null, opened = new Set([0]);
let text = load(kKept) || write(kStart);
let preview = JSON.parse(load(kPreview) || "{}");

function load(key) {
    try { return localStorage.getItem(key); } catch { return null; }
}
function store(key, value) {
    try { localStorage.setItem(key, value); } catch { /* not kept: nothing depends on it */ }
}

export const editedText = () => text;

/** One line for each parameter, so that a fault's line names it. */
function write(value) {
    return `${JSON.stringify(value, null, 2)}\n`;
}

function parse() {
    try {
        const value = JSON.parse(text);
        return value && Array.isArray(value.passes) ? value : null;
    } catch {
        return null;
    }
}

const nameOf = (pass) => (typeof pass === "string" ? pass : Object.keys(pass)[0]);
const valuesOf = (pass) => (typeof pass === "string" ? {} : pass[nameOf(pass)] || {});

function fromForm() {
    text = write(chain);
    parts.text.value = text;
    changed();
}

function fieldsOf(properties, values, change) {
    return h("div", { class: "fields" }, Object.entries(properties)
        .filter(([, one]) => canEdit(one))
        .map(([key, one]) => field(key, one, values[key], (value) => {
            if (value === undefined) delete values[key];
            else values[key] = value;
            change(values);
        })));
}

function passCard(pass, index) {
    const name = nameOf(pass), values = valuesOf(pass);
    const about = schema.$defs[`pass.${name}`] || { properties: {} };
    const move = (by) => {
        chain.passes.splice(index + by, 0, ...chain.passes.splice(index, 1));
        opened = new Set();
        fromForm();
        drawForms();
    };
    const tool = (label, title, disabled, f) => h("button", { type: "button", class: "small",
        "aria-label": `${title} ${name}`, title, disabled, onclick: (event) => {
            event.preventDefault();
            f();
        } }, label);
    const count = Object.keys(values).length;
    const summary = h("span", { class: "help" }, count ? Object.entries(values)
        .map(([k, v]) => `${k} ${Array.isArray(v) ? v.join(" ") : v}`).join(", ")
        : "all as by default");
    const details = h("details", { open: opened.has(index), ontoggle: () =>
        (details.open ? opened.add(index) : opened.delete(index)) },
    h("summary", {}, `${index + 1}. ${name}`, summary,
        h("span", { class: "tools" },
            tool("↑", "Earlier:", index === 0, () => move(-1)),
            tool("↓", "Later:", index === chain.passes.length - 1, () => move(1)),
            tool("Remove", "Remove", false, () => {
                chain.passes.splice(index, 1);
                opened = new Set();
                fromForm();
                drawForms();
            }))),
    h("div", { class: "body" }, fieldsOf(about.properties, values, (changedValues) => {
        chain.passes[index] = { [name]: changedValues };
        const now = Object.entries(changedValues);
        summary.textContent = now.length ? now.map(([k, v]) =>
            `${k} ${Array.isArray(v) ? v.join(" ") : v}`).join(", ") : "all as by default";
        fromForm();
    })));
    return h("li", { class: "pass card" }, details);
}

function drawForms() {
    chain = parse();
    if (!chain) {
        parts.forms.replaceChildren(h("p", { class: "message" },
            "This text is not JSON, so there are no forms for it. It is still checked and can be run "
            + "(chain files are YAML, which includes JSON)."));
        return;
    }
    const names = Object.keys(schema.$defs).filter((key) => key.startsWith("pass."))
        .map((key) => key.slice(5));
    const select = h("select", { "aria-label": "Pass to add" },
        names.map((name) => h("option", {}, name)));
    const camera = chain.camera || {};
    parts.forms.replaceChildren(
        h("ol", { class: "passes" }, chain.passes.map(passCard)),
        h("div", { class: "add" }, select, h("button", { type: "button", onclick: () => {
            chain.passes.push({ [select.value]: {} });
            opened = new Set([chain.passes.length - 1]);
            fromForm();
            drawForms();
        } }, "Add pass")),
        h("div", { class: "pass card" }, h("details", {},
            h("summary", {}, "camera", h("span", { class: "help" },
                "the lens, if neither the frames nor the camera file state it")),
            h("div", { class: "body" }, fieldsOf(schema.$defs.camera.properties, camera, (values) => {
                if (Object.keys(values).length) chain = { postchain: chain.postchain,
                    camera: values, ...chain };
                else delete chain.camera;
                fromForm();
            })))));
}

function drawGutter(diagnostics = []) {
    const worst = new Map();
    for (const one of diagnostics)
        if (one.line && worst.get(one.line) !== "error") worst.set(one.line, one.severity);
    parts.gutter.replaceChildren(...text.split("\n").map((_, i) =>
        h("div", { class: worst.has(i + 1) ? `${worst.get(i + 1)}-line` : null }, String(i + 1))));
    parts.gutter.scrollTop = parts.text.scrollTop;
}

function goTo(line, column) {
    const lines = text.split("\n");
    const at = lines.slice(0, line - 1).reduce((sum, l) => sum + l.length + 1, 0)
        + Math.max(0, column - 1);
    parts.text.focus();
    parts.text.setSelectionRange(at, at + Math.max(1, (lines[line - 1] || "").length - column + 1));
    parts.text.scrollTop = Math.max(0, (line - 4) * parseFloat(getComputedStyle(parts.text).lineHeight));
}

const check = settle(async () => {
    const asked = text;
    let found;
    try {
        found = (await post("v1/chain/check", { text })).diagnostics;
    } catch (error) {
        parts.diagnostics.replaceChildren(h("li", { class: "error" }, error.message));
        return;
    }
    if (asked !== text) return;
    drawGutter(found);
    parts.diagnostics.replaceChildren(...(found.length ? found.map((one) => h("li", {}, h("button", {
        type: "button", class: one.severity, onclick: () => one.line && goTo(one.line, one.column),
    }, `${one.line ? `line ${one.line}: ` : ""}${one.path ? `${one.path}: ` : ""}${one.message}`)))
        : [h("li", { class: "ok" }, "The chain is valid.")]));
    if (!found.some((one) => one.severity === "error")) showPreview();
}, 300);

let running = null, shownUrl = "";
const showPreview = settle(async () => {
    if (!preview.input) return;
    running?.abort();
    running = new AbortController();
    const started = performance.now(), mine = running;
    parts.previewState.textContent = "filtering …";
    parts.previewState.className = "help preview-state";
    const body = { chain_text: text, input: preview.input, frame: Number(preview.frame || 1),
        scale: Number(preview.scale || 0.5) };
    if (preview.camera) body.camera = preview.camera;
    try {
        const blob = await picture("v1/preview", body, mine.signal);
        URL.revokeObjectURL(shownUrl);
        shownUrl = URL.createObjectURL(blob);
        parts.picture.replaceChildren(h("img", { src: shownUrl, alt: "the frame, filtered" }));
        parts.previewState.textContent =
            `frame ${body.frame} at scale ${body.scale}, ${Math.round(performance.now() - started)} ms`;
    } catch (error) {
        if (mine.signal.aborted) return;
        parts.previewState.textContent = error.errors?.length ? error.errors
            .map((e) => `${e.path ? `${e.path}: ` : ""}${e.message}`).join("\n") : error.message;
        parts.previewState.className = "error preview-state";
    }
}, 200);

function changed() {
    store(kKept, text);
    drawGutter();
    check();
}

function previewField(key, label, attributes) {
    const id = new_id();
    const input = h("input", { id, ...attributes, oninput: () => {
        preview[key] = input.value.trim();
        store(kPreview, JSON.stringify(preview));
        showPreview();
    } });
    input.value = preview[key] ?? "";
    return h("div", { class: "field" }, h("label", { for: id }, label), input);
}

export async function showChain() {
    if (parts) return;
    schema = await get("v1/schema");
    const textId = new_id();
    parts = { forms: h("div"), gutter: h("div", { class: "gutter mono", "aria-hidden": "true" }),
        text: h("textarea", { id: textId, class: "code", spellcheck: "false", autocomplete: "off",
            autocapitalize: "off", wrap: "off" }),
        diagnostics: h("ul", { class: "diagnostics", role: "status" }),
        picture: h("div", { class: "picture" }, h("p", {}, "Name frames to see one filtered.")),
        previewState: h("p", { class: "help preview-state", role: "status" }) };
    parts.text.value = text;
    parts.text.addEventListener("input", () => {
        text = parts.text.value;
        changed();
        drawForms();
    });
    parts.text.addEventListener("scroll", () => { parts.gutter.scrollTop = parts.text.scrollTop; });
    by_id("chain").replaceChildren(
        h("div", { class: "form-title" }, h("h2", { id: "chain-title" }, "Chain editor"),
            h("p", { class: "help" }, "Passes run from top to bottom. ",
                h("a", { href: "#new" }, "Use it in a new job"), ".")),
        h("div", { class: "editor" },
            h("div", {}, parts.forms),
            h("div", { class: "beside" },
                h("label", { for: textId, class: "label" }, "Text"),
                h("div", { class: "text-pane" }, parts.gutter, parts.text), parts.diagnostics,
                h("h3", {}, "Preview"),
                h("div", { class: "preview-form" },
                    previewField("input", "Frames", { type: "text", placeholder: "shots/a.####.exr",
                        spellcheck: "false" }),
                    previewField("frame", "Frame", { type: "number", step: 1, placeholder: "1" }),
                    previewField("camera", "Camera file", { type: "text",
                        placeholder: "shots/camera.json", spellcheck: "false" }),
                    previewField("scale", "Scale", { type: "number", min: 0.05, max: 1, step: 0.05,
                        placeholder: "0.5" })),
                parts.previewState, parts.picture)));
    drawForms();
    drawGutter();
    check();
}
