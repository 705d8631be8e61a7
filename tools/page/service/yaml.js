// A chain's values as the text of a chain file.
const kWidth = 90;  // longest line of a pass in one line
const kPlain = /^[A-Za-z_][\w./-]*$/;
const kWord = /^(true|false|null|yes|no|on|off)$/i;

const text = (word) => (kPlain.test(word) && !kWord.test(word) ? word : JSON.stringify(word));
const flow = (value) => (Array.isArray(value) ? `[${value.map(flow).join(", ")}]`
    : value && typeof value === "object"
        ? `{${Object.entries(value).map(([key, one]) => `${text(key)}: ${flow(one)}`).join(", ")}}`
        : typeof value === "string" ? text(value) : String(value));

const is_map = (value) => value && typeof value === "object" && !Array.isArray(value)
    && Object.keys(value).length > 0;
const rows = (map, indent) => Object.entries(map)
    .map(([key, one]) => `${indent}${text(key)}: ${flow(one)}`);

function pass_rows(pass) {
    const line = typeof pass === "string" ? text(pass) : flow(pass).slice(1, -1);
    if (line.length <= kWidth || !is_map(pass)) return [`  - ${line}`];
    const [[name, values]] = Object.entries(pass);
    return [`  - ${text(name)}:`, ...rows(values, "      ")];
}

export function yaml_of(chain) {
    const lines = Object.entries(chain).flatMap(([key, value]) => (
        key === "passes" && value.length ? ["passes:", ...value.flatMap(pass_rows)]
            : is_map(value) ? [`${text(key)}:`, ...rows(value, "  ")]
                : rows({ [key]: value }, "")));
    return `${lines.join("\n")}\n`;
}
