// The page of a study, from its report.json: the answer, the tables over all scenes, links to their
// reports. The service shows pages without their pictures (?pictures=apart), and links keep that.
import { by_id, h, json_of } from "../shared/dom.js";
import { head, interval_marks, scroll } from "../shared/tables.js";
import { counted, is_better, number, ranges, way_of } from "../shared/words.js";

const report = json_of("data");
const kDecided = new Set(["a_nearer", "b_nearer"]);
const kFindings = { too_few_families: "too few families", not_decided: "not decided",
    equal: "no difference beyond", a_nearer: "farther", b_nearer: "closer" };
const variants = report.variants.map(({ name }) => name);
const questions = report.pairs.map(({ a, b }) => `${b} against ${a}`);
const conditions = report.pairs.map(({ equal, time_ratio: ratio }) =>
    (equal === "time" && ratio !== null ? `time ${number(ratio, 2)} : 1` : equal && `equal ${equal}`));
const figure = (v) => (v === null || v === undefined ? "" : number(v, 4));
const cell = (v, kind = "num") => h("td", { class: kind }, figure(v));

function verdict() {
    const failed = report.scenes.filter(({ failure }) => failure);
    const files = ["json", "csv", "md"].flatMap((kind, i) => [i ? ", " : "",
        h("a", { href: `report.${kind}` }, `report.${kind}`)]);
    return [
        h("p", { class: "quiet" },
            counted(report.scenes.length - failed.length, "scene"), " measured",
            failed.length > 0 && `, ${failed.length} failed`, `, postchain ${report.version}, commit `,
            h("code", {}, report.revisions.join(", ")), ". ", files),
        h("ul", {}, report.verdict.map((line) => h("li", {}, line))),
        failed.map(({ name, failure }) => h("p", { class: "bad" }, `Failed: ${name}: ${failure}`)),
    ];
}

// A mean of each variant; the closest to ground truth is marked, unless all are equal.
function means(table, values) {
    const known = values.filter((v) => v !== null);
    const best = known.reduce((found, v) => (is_better(table.better, v, found) ? v : found),
        known[0]);
    const equal = values.every((v) => v === values[0]);
    const at = equal ? -1 : values.indexOf(best);
    return values.map((v, i) => cell(v, i === at ? "num best" : "num"));
}

function gain({ gain: mean, interval, families_nearer, families, finding, margin,
    probability_holm, probability_beyond_margin_holm }) {
    if (mean === null) return h("td");
    const p = finding === "equal" ? probability_beyond_margin_holm : probability_holm;
    const text = [figure(mean), interval && ` (${number(interval[0])} to ${number(interval[1])})`,
        ", ", h("span", { class: "count" }, `${families_nearer} of ${families}`)];
    return h("td", {}, kDecided.has(finding) ? h("b", {}, text) : text,
        h("small", { class: "finding" }, kFindings[finding],
            finding === "equal" && ` ${number(margin)}`, p !== null && `, p ${number(p, 2)}`));
}

function overview() {
    return [
        h("h2", {}, "Mean over families"),
        scroll("Mean over families", h("table", {},
            head(["metric"], ...variants.map((name) => [name, "num"]),
                ...questions.map((q, i) => [q, undefined, undefined, conditions[i]])),
            h("tbody", {}, report.tables.map((table) => h("tr", {},
                h("th", { scope: "row", title: table.help }, table.metric,
                    h("small", {}, way_of(table))),
                means(table, table.means), table.pairs.map(gain)))))),
        h("p", { class: "quiet" }, "Blue: the closest to ground truth. Under each question: the gain " +
            "(how much closer to ground truth the first named is, whichever way the metric runs), " +
            "its 95 % interval, and the families in which the first named is closer. The interval " +
            "says how far the mean of these families may be from the mean over many families of " +
            "this kind. Bold: decided, by a t test over families whose probability p, corrected by " +
            "Holm for the number of questions, is below 5 %. No difference beyond: the gain is " +
            "smaller than this margin, by the same criterion; not decided: neither is shown."),
    ];
}

// Gains of one question: a line for each family, below it the mean with its interval.
function gain_plot(table, index) {
    const [width, middle, end, top, step] = [760, 400, 220, 30, 20];
    const { a, b, gain: mean, interval } = table.pairs[index];
    const families = table.families.filter(({ gains }) => gains[index] !== null);
    const most = Math.max(...families.map(({ gains }) => Math.abs(gains[index])),
        ...(interval ?? []).map(Math.abs));
    const height = top + (families.length + 1) * step + 8;
    const label = (x, y, anchor, text, kind) =>
        h("text", { x, y, "text-anchor": anchor, class: kind }, text);
    const line = (name, value, i, more) => {
        const y = top + 8 + i * step;
        return [label(8, y + 4, "start", name),
            interval_marks(
                { mean: value, middle, unit: most > 0 ? end / most : 1, end, y, ...more }),
            label(width - 8, y + 4, "end", figure(value), i < families.length && "quiet")];
    };
    return h("svg", { class: "gains", width, height, viewBox: `0 0 ${width} ${height}`, role: "img",
        "aria-label": `gain of ${b} over ${a}` },
    label(middle - 8, 16, "end", `\u2190 ${a} closer`, "quiet"),
    label(middle + 8, 16, "start", `${b} closer \u2192`, "quiet"),
    h("line", { x1: middle, x2: middle, y1: top - 6, y2: height - 4, stroke: "var(--quiet)" }),
    families.flatMap(({ name, gains }, i) =>
        line(name, gains[index], i, { radius: 4, ink: "var(--accent)" })).flat(),
    mean !== null && line(interval ? "mean, 95 %" : "mean", mean, families.length,
        { interval, radius: 6, ink: "var(--text)", width: 2 }).flat());
}

function plots() {
    const table = report.tables.find(({ metric }) => metric === "hdr_flip");
    return table && [h("h2", {}, "Gains of HDR-FLIP by family"),
        report.pairs.map((_, i) => gain_plot(table, i))];
}

function scenes() {
    return [h("h2", {}, "Scenes"), scroll("Scenes", h("table", {},
        head(["scene"], ["family", "left"], ["frames"], ["size"], ["truth", "left"],
            ["reports", "left"]),
        h("tbody", {}, report.scenes.map((scene) => h("tr", {},
            h("th", { scope: "row" }, scene.name), h("td", { class: "left" }, scene.family),
            scene.failure ? h("td", { class: "left bad", colspan: 4 }, "failed") : [
                h("td", {}, ranges(scene.frames)), h("td", {}, `${scene.width}x${scene.height}`),
                h("td", { class: "left" }, scene.truth),
                h("td", { class: "left" }, scene.reports.flatMap((href, i) => [i > 0 && ", ",
                    h("a", { href: href + location.search }, report.kind === "ab" ? questions[i] : "report")])),
            ])))))];
}

function metric(table) {
    const row = (kind, name, values, gains) => h("tr", { class: kind },
        h("th", { scope: "row" }, name), means(table, values), gains.map((v) => cell(v)));
    const rows = table.families.flatMap((family) => [
        ...table.scenes.filter((scene) => scene.family === family.name)
            .map((scene) => row("scene", scene.name, scene.means, scene.gains)),
        family.scenes > 1 && row("family",
            `mean of ${family.name}, ${counted(family.scenes, "scene")}`, family.means,
            family.gains)]);
    return h("details", { open: table.metric === "hdr_flip" },
        h("summary", {}, h("b", {}, table.metric), ` ${table.help} (${way_of(table)})`),
        scroll(table.metric, h("table", {},
            head(["scene"], ...variants.map((name) => [name, "num"]),
                ...questions.map((q) => [`gain of ${q}`])),
            h("tbody", {}, rows, row("mean", "mean over families", table.means,
                table.pairs.map((pair) => pair.gain))))));
}

document.title = report.title;
by_id("main").append(...[
    h("h1", {}, report.title), verdict(), overview(), plots(), scenes(), report.tables.map(metric),
    h("h2", {}, "Chains"),
    report.variants.map(({ name, chain }) => h("details", {}, h("summary", {}, name),
        h("pre", {}, chain))),
    h("h2", {}, "Notes"), h("ul", {}, report.notes.map((note) => h("li", {}, note))),
].flat(2).filter(Boolean));
