// The stability matrix: the worst of each row and check, then every failure and known limit with
// its pictures.
import { by_id, h, json_of } from "../shared/dom.js";
import { head, scroll } from "../shared/tables.js";
import { counted } from "../shared/words.js";

const kShownWidth = 320;  // CSS pixels to which pictures grow, in whole steps
const kMaxSteps = 64;

const matrix = json_of("data");
const names = matrix.checks.map(({ name }) => name);

function worst(found) {
    if (!found)
        return h("td", { class: "none" }, h("span", { "aria-hidden": "true" }, "\u2013"),
            h("span", { class: "sr" }, "does not apply"));
    const title = `${found.cell}, bound ${found.bound}`;
    if (found.verdict === "ok") return h("td", { title }, found.value);
    const kind = found.verdict === "limit" ? "limit" : "fail";
    return h("td", { class: kind, title },
        h("a", { href: `#${kind}-${found.entry + 1}` }, `${found.verdict} ${found.value}`));
}

function table() {
    const subjects = [...new Set(matrix.rows.map(({ subject }) => subject))];
    return [
        h("h2", { id: "table" }, "Worst of each row, chain and check"),
        h("p", {}, "Over the cells of the row and both precisions, the value that is furthest " +
            "beyond its bound, or closest to it. ", h("em", {}, "limit"), ": outside the bound, " +
            "known, inside a bound of its own. A dash: the check does not apply."),
        scroll("Worst of each row, chain and check", h("table", { class: "matrix" },
            head(["row"], ...names.map((name) => [h("a", { href: `#check-${name}` }, name)])),
            subjects.map((subject) => h("tbody", {},
                h("tr", {}, h("th", { scope: "rowgroup" }, subject),
                    h("td", { colspan: names.length })),
                matrix.rows.filter((row) => row.subject === subject).map((row) => h("tr", {},
                    h("th", { scope: "row" }, row.row),
                    names.map((name) => worst(row.checks[name])))))))),
    ];
}

function figure(entry, { title, scale, png, width, height }) {
    const steps = Math.min(Math.max(Math.floor(kShownWidth / Math.max(width, 1)), 1), kMaxSteps);
    return h("figure", {}, h("img", {
        loading: "lazy", width: width * steps, height: height * steps,
        alt: `${title} of ${entry.cell}, ${entry.check}; ${scale}`,
        src: `data:image/png;base64,${png}`,
    }),
    h("figcaption", {}, h("b", {}, title), h("br"), `${scale}, ${width} x ${height} px`));
}

const section = (kind, index, title, note, entry) =>
    h("section", { class: `entry ${kind}`, id: `${kind}-${index + 1}` }, h("h3", {}, title),
        h("p", {}, note), entry.place && h("p", { class: "quiet" }, `Shown: ${entry.place}.`),
        entry.pictures.length > 0 && h("div", { class: "pictures" },
            entry.pictures.map((picture) => figure(entry, picture))));

function failures() {
    const all = matrix.failures;
    return [
        h("h2", { id: "failures" }, `Failures (${all.length})`), !all.length && h("p", {}, "None."),
        all.length > matrix.pictured_at_most &&
            h("p", {}, `The first ${matrix.pictured_at_most} are shown with pictures.`),
        all.map((one, i) => section("fail", i,
            `${one.cell}: ${one.check} ${one.value}, bound ${one.bound}`, one.note, one)),
    ];
}

function limits() {
    const all = matrix.limits;
    return [
        h("h2", { id: "limits" }, `Known limits (${all.length})`),
        h("p", {}, all.length ? "Each with its worst cell." : "None was met."),
        all.map((one, i) => section("limit", i,
            `${one.limit.check} ${one.value}, bound ${one.limit.bound} in place of ${one.bound}: ` +
            one.cell,
            `${one.limit.reason}. Met ${counted(one.limit.times, "time")}. Here: ${one.note}.`, one)),
    ];
}

const checks = () => [
    h("h2", { id: "checks" }, "Checks"),
    scroll("Checks", h("table", {}, head(["check"], ["value", "left"]),
        h("tbody", {}, matrix.checks.map(({ name, help }) => h("tr", { id: `check-${name}` },
            h("th", { scope: "row" }, name), h("td", { class: "text" }, help)))))),
];

document.title = `Stability of postchain ${matrix.version}`;
by_id("header").append(h("h1", {}, document.title),
    h("p", { class: "verdict" },
        `${matrix.cells} cells, ${matrix.checked} checks: ${matrix.ok} ok, ` +
        `${matrix.limited} known limits, `, h("strong", {}, `${matrix.failures.length} failed`)),
    h("p", { class: "quiet" }, h("code", {}, matrix.command), h("br"), matrix.renderer));
by_id("main").append(...[table(), failures(), limits(), checks()].flat(2).filter(Boolean));
