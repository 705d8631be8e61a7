// The rest of a chain, behind "more": passes as forms made from the schema, and the text. The text is
// submitted; the forms write it, and follow it when the service has read it.
import { by_id, h, new_id, settle } from "../shared/dom.js";
import { activeChain, chainSchema, check_text, edit, passName, passValues, setText,
    whenChainsChange } from "./chains.js";
import { canEdit, field } from "./form.js";

let parts = null, opened = new Set(), written = "", drawn;  // drawn: the values that the forms show

function fieldsOf(properties, values, change) {
    return h("div", { class: "fields" }, Object.entries(properties)
        .filter(([, one]) => canEdit(one))
        .map(([key, one]) => field(key, one, values[key], (value) => {
            if (value === undefined) delete values[key];
            else values[key] = value;
            change(values);
        })));
}

const words = (values) => Object.entries(values)
    .map(([k, v]) => `${k} ${Array.isArray(v) ? v.join(" ") : v}`).join(", ") || "all as by default";

// A change by a form, which shows it already.
function from_form(work) {
    edit((chain) => {
        work(chain);
        drawn = JSON.stringify(chain);
    });
}

function passCard(pass, index, count) {
    const name = passName(pass);
    const about = chainSchema().$defs[`pass.${name}`] || { properties: {} };
    const change = (work) => {
        opened = new Set();
        edit(work);
    };
    const move = (by) => change((chain) =>
        chain.passes.splice(index + by, 0, ...chain.passes.splice(index, 1)));
    const tool = (label, title, disabled, f) => h("button", { type: "button", class: "small",
        "aria-label": `${title} ${name}`, title, disabled, onclick: f }, label);
    const summary = h("span", { class: "help" }, words(passValues(pass)));
    const details = h("details", { open: opened.has(index), ontoggle: () =>
        (details.open ? opened.add(index) : opened.delete(index)) },
    h("summary", {}, `${index + 1}. ${name}`, summary),
    h("div", { class: "body" }, h("div", { class: "buttons" },
        tool("\u2191", "Earlier:", index === 0, () => move(-1)),
        tool("\u2193", "Later:", index === count - 1, () => move(1)),
        tool("Remove", "Remove", false, () => change((chain) => chain.passes.splice(index, 1)))),
    fieldsOf(about.properties, { ...passValues(pass) }, (values) => {
        summary.textContent = words(values);
        from_form((chain) => { chain.passes[index] = { [name]: { ...values } }; });
    })));
    return h("li", { class: "pass" }, details);
}

function drawForms() {
    const chain = activeChain().value;
    drawn = JSON.stringify(chain);
    if (!chain) {
        parts.forms.replaceChildren(h("p", { class: "message" },
            "The text has no list of passes yet."));
        return;
    }
    const names = Object.keys(chainSchema().$defs).filter((key) => key.startsWith("pass."))
        .map((key) => key.slice(5));
    const select = h("select", { "aria-label": "Pass to add" },
        names.map((name) => h("option", {}, name)));
    parts.forms.replaceChildren(
        h("ol", { class: "passes" }, chain.passes.map((pass, i) =>
            passCard(pass, i, chain.passes.length))),
        h("div", { class: "buttons" }, select, h("button", { type: "button", onclick: () => {
            opened = new Set([chain.passes.length]);
            edit((now) => now.passes.push({ [select.value]: {} }));
        } }, "Add pass")),
        h("div", { class: "pass" }, h("details", { open: opened.has("camera"), ontoggle: (event) =>
            (event.target.open ? opened.add("camera") : opened.delete("camera")) },
        h("summary", {}, "camera", h("span", { class: "help" },
            "the lens, if neither the frames nor the camera file state it")),
        h("div", { class: "body" }, fieldsOf(chainSchema().$defs.camera.properties,
            { ...chain.camera }, (values) => from_form((now) => {
                if (Object.keys(values).length) now.camera = { ...values };
                else delete now.camera;
            }))))));
}

function drawGutter(diagnostics = []) {
    const worst = new Map();
    for (const one of diagnostics)
        if (one.line && worst.get(one.line) !== "error") worst.set(one.line, one.severity);
    parts.gutter.replaceChildren(...activeChain().text.split("\n").map((_, i) =>
        h("div", { class: worst.has(i + 1) ? `${worst.get(i + 1)}-line` : null }, String(i + 1))));
    parts.gutter.scrollTop = parts.text.scrollTop;
}

function goTo(line, column) {
    const lines = activeChain().text.split("\n");
    const at = lines.slice(0, line - 1).reduce((sum, l) => sum + l.length + 1, 0)
        + Math.max(0, column - 1);
    parts.text.closest("details").open = true;
    parts.text.focus();
    parts.text.setSelectionRange(at, at + Math.max(1, (lines[line - 1] || "").length - column + 1));
    parts.text.scrollTop = Math.max(0, (line - 4) * parseFloat(getComputedStyle(parts.text).lineHeight));
}

const check = settle(async () => {
    const { text } = activeChain();
    let found;
    try {
        found = (await check_text(text)).diagnostics;
    } catch (error) {
        if (activeChain().text !== text) return;
        parts.diagnostics.replaceChildren(h("li", { class: "error" }, error.message));
        return;
    }
    if (activeChain().text !== text) return;
    drawGutter(found);
    parts.diagnostics.replaceChildren(...(found.map((one) => h("li", {}, h("button", {
        type: "button", class: one.severity, onclick: () => one.line && goTo(one.line, one.column),
    }, `${one.line ? `line ${one.line}: ` : ""}${one.path ? `${one.path}: ` : ""}${one.message}`)))));
}, 500);

function changed(why) {
    const { text, value } = activeChain();
    if (JSON.stringify(value) !== drawn) drawForms();
    if (why === "read") return;
    if (text !== written) parts.text.value = text;
    written = text;
    if (why === "chosen") parts.diagnostics.replaceChildren();  // faults of the other chain
    drawGutter();
    check();
}

export function start_editor() {
    const textId = new_id();
    parts = { forms: h("div"), gutter: h("div", { class: "gutter mono", "aria-hidden": "true" }),
        text: h("textarea", { id: textId, class: "code", spellcheck: "false", autocomplete: "off",
            autocapitalize: "off", wrap: "off" }),
        diagnostics: by_id("diagnostics") };
    parts.text.addEventListener("input", () => {
        written = parts.text.value;
        setText(written);
    });
    parts.text.addEventListener("scroll", () => { parts.gutter.scrollTop = parts.text.scrollTop; });
    by_id("passes").replaceChildren(parts.forms);
    by_id("text").replaceChildren(h("label", { for: textId, class: "sr" }, "Text of the chain"),
        h("div", { class: "text-pane" }, parts.gutter, parts.text));
    drawForms();
    changed();
    whenChainsChange(changed);
}
