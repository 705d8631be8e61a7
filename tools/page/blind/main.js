// A blind comparison: pairs of images with random sides, and the choices as CSV. The page
// has no names of chains; key.json beside it does.
import { by_id, h, json_of } from "../shared/dom.js";
import { counted } from "../shared/words.js";

const data = json_of("data");
const kWords = { A: "A is better", none: "No difference", B: "B is better" };
const kKeys = { a: "A", 1: "A", b: "B", 2: "B", n: "none", 0: "none" };
const has_truth = data.trials.some(({ truth }) => truth !== null);

// index -1: before the first pair; as many as pairs: after the last.
const state = { index: -1, observer: "", choices: [], since: 0, saved: true, alone: false,
    shown: "left" };

const source = (index) => `data:image/png;base64,${data.images[index]}`;

function csv() {
    const rows = state.choices.flatMap((choice, i) => choice
        ? [[data.comparison, state.observer, i + 1, choice.word, choice.seconds.toFixed(1)].join(",")] : []);
    return ["comparison,observer,trial,choice,seconds", ...rows, ""].join("\n");
}

function save() {
    const address = URL.createObjectURL(new Blob([csv()], { type: "text/csv" }));
    h("a", { href: address, download: `choices-${state.observer}.csv` }).click();
    URL.revokeObjectURL(address);
    state.saved = true;
}

function go(index) {
    state.index = index;
    state.since = performance.now();
    state.shown = "left";
    draw();
}

function choose(word) {
    state.choices[state.index] = { word, seconds: (performance.now() - state.since) / 1000 };
    state.saved = false;
    go(state.index + 1);
}

function show(side) {
    state.shown = side;
    draw();
}

function begin(event) {
    event.preventDefault();
    // A field of a CSV.
    state.observer = by_id("observer").value.trim().replace(/[^\p{L}\p{N} ._-]/gu, "_");
    if (state.observer) go(0);
}

const key = (text) => h("kbd", { "aria-hidden": "true" }, text);

function start() {
    return [
        h("h1", {}, "Which image is better?"),
        h("p", {}, `${counted(data.trials.length, "pair")} of images follow. Each shows one frame, made in `
            + "two ways; which side is which is random for each pair. "
            + (has_truth ? "Choose the one that is closer to the reference."
                : "Choose the one that you would rather see in a film.")),
        h("ul", {},
            h("li", {}, "Keys: A or 1, B or 2; N or 0 for no difference; Backspace to go back."),
            h("li", {}, "F shows one image at a time, in place: the arrow keys change it"
                + (has_truth ? ", R is the reference." : ".")),
            h("li", {}, "Use the browser at 100 %, in a dim room, and do not hurry."),
            h("li", {}, "Save the choices at the end. Nothing leaves this computer.")),
        h("form", { class: "bar", onsubmit: begin },
            h("label", { for: "observer" }, "Your name or a number"),
            h("input", { id: "observer", maxlength: 40, required: true, autocomplete: "off" }),
            h("button", { class: "main" }, "Start")),
    ];
}

function picture(trial, side) {
    const name = { left: "A", right: "B", truth: "Reference" }[side];
    return h("figure", {}, h("figcaption", {}, name),
        h("img", { src: source(trial[side]), alt: `Image ${name}` }));
}

function pair() {
    const trial = data.trials[state.index];
    const chosen = state.choices[state.index]?.word;
    const sides = trial.truth === null ? ["left", "right"] : ["left", "truth", "right"];
    return [
        h("div", { class: "bar" },
            h("b", { id: "place" }, `Pair ${state.index + 1} of ${data.trials.length}`),
            h("progress", { max: data.trials.length, value: state.index, "aria-label": "Pairs seen" }),
            h("button", { onclick: back, disabled: state.index === 0 }, "Back", key("\u232b")),
            h("button", { onclick: flip, "aria-pressed": String(state.alone) }, "One at a time",
                key("F")),
            state.alone && sides.map((side) => h("button",
                { onclick: () => show(side), "aria-pressed": String(state.shown === side) },
                { left: "Show A", right: "Show B", truth: "Show reference" }[side],
                key({ left: "\u2190", right: "\u2192", truth: "R" }[side]))),
            h("button", { class: "end", onclick: save }, "Save choices")),
        h("div", { class: "stage" },
            (state.alone ? [state.shown] : sides).map((side) => picture(trial, side))),
        h("div", { class: "bar choices" }, Object.entries(kWords).map(([word, text]) =>
            h("button", { class: "main", onclick: () => choose(word), id: `choose-${word}`,
                "aria-pressed": String(chosen === word) }, text,
            key({ A: "A", none: "N", B: "B" }[word])))),
    ];
}

function end() {
    return [
        h("h1", {}, "Thank you"),
        h("p", { id: "place" }, `${counted(state.choices.filter(Boolean).length, "choice")} made. Save them `
            + "and send the file to whoever gave you this page."),
        h("div", { class: "bar" },
            h("button", { class: "main", id: "save", onclick: save }, "Save choices"),
            h("button", { onclick: back }, "Back", key("\u232b"))),
    ];
}

function back() {
    if (state.index > 0) go(state.index - 1);
}

function flip() {
    state.alone = !state.alone;
    draw();
}

function draw() {
    by_id("main").replaceChildren(...(state.index < 0 ? start()
        : state.index < data.trials.length ? pair() : end()));
}

addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.repeat || state.index < 0) return;
    const typed = event.key.toLowerCase();
    if (typed === "backspace") return back();
    if (state.index >= data.trials.length) return;
    if (Object.hasOwn(kKeys, typed)) return choose(kKeys[typed]);
    if (typed === "f") return flip();
    if (!state.alone) return;
    if (typed === "arrowleft") show("left");
    if (typed === "arrowright") show("right");
    if (typed === "r" && data.trials[state.index].truth !== null) show("truth");
});
addEventListener("beforeunload", (event) => {
    if (!state.saved) event.preventDefault();
});
draw();
