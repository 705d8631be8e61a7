// Form fields made from JSON Schema: one for each property, with its range and its help.
import { h, new_id } from "../shared/dom.js";

const types = (schema) => [schema.type].flat().filter((t) => t !== "null");

/** "1 to 1023, default 25" */
function rangeOf(schema) {
    const parts = [];
    if (schema.minimum !== undefined && schema.maximum !== undefined)
        parts.push(`${schema.minimum} to ${schema.maximum}`);
    else if (schema.minimum !== undefined) parts.push(`at least ${schema.minimum}`);
    if (schema.default !== undefined && schema.default !== null)
        parts.push(`default ${schema.default}`);
    return parts.join(", ");
}

export function canEdit(schema) {
    const kind = types(schema)[0];
    if (schema.enum || ["integer", "number", "boolean", "string"].includes(kind)) return true;
    return kind === "array" && schema.items?.type === "string";
}

/** The field's value as JSON; undefined: empty, the default. */
function read(input, schema) {
    const text = input.value.trim();
    const kind = types(schema)[0];
    if (text === "") return undefined;
    if (schema.enum) return schema.enum.find((v) => String(v) === text);
    if (kind === "boolean") return text === "true";
    if (kind === "integer" || kind === "number") return Number(text);
    if (kind === "array") return text.split("\n").map((line) => line.trim()).filter(Boolean);
    return text;
}

const written = (value) => (Array.isArray(value) ? value.join("\n") : String(value ?? ""));

/** A labeled field; change(value) is called with each typed value. */
export function field(key, schema, value, change, options) {
    const id = new_id(), helpId = new_id(), kind = types(schema)[0];
    const attributes = { id, "aria-describedby": helpId, required: options.required };
    let input;
    if (schema.enum || kind === "boolean") {
        const words = schema.enum || [true, false];
        const unset = schema.default === undefined || schema.default === null
            ? "not set" : `default (${schema.default})`;
        input = h("select", attributes, h("option", { value: "" }, unset),
            words.filter((w) => w !== null).map((w) => h("option", { value: w }, String(w))));
    } else if (kind === "array") {
        input = h("textarea", { ...attributes, rows: 2, spellcheck: "false" });
    } else if (kind === "integer" || kind === "number") {
        input = h("input", { ...attributes, type: "number", min: schema.minimum,
            max: schema.maximum, step: kind === "integer" ? 1 : "any", placeholder: schema.default });
    } else {
        input = h("input", { ...attributes, type: "text", spellcheck: "false",
            autocomplete: "off", placeholder: options.placeholder });
    }
    input.value = written(value);
    input.addEventListener("change", () => change(read(input, schema)));
    if (input.tagName !== "SELECT") input.addEventListener("input", () => change(read(input, schema)));
    const range = schema.enum || kind === "boolean" ? "" : rangeOf(schema);
    // The schema's sentence ends with the same range, for readers of the schema.
    const help = (schema.description || "").split("; ")
        .filter((part) => !/^(an? (integer|number|text)|one of|true or false)\b/.test(part))
        .join("; ").replace(/ \((IN|OUT|FILE|DIR|RANGE|NAME|SIZE|RULES)\)/g, "");
    return h("div", { class: options.wide ? "field wide" : "field", "data-key": key },
        h("label", { for: id }, options.label || key,
            options.required ? h("span", { class: "required", "aria-hidden": "true" }, " *") : null),
        input,
        h("p", { id: helpId, class: "help" }, [help, range].filter(Boolean).join(" — ")));
}
