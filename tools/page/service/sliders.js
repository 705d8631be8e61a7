// The six values that matter first, as sliders of the chain that is edited; which chain that is; and
// chains to load.
import { by_id, h, new_id, printable } from "../shared/dom.js";
import { number } from "../shared/words.js";
import { folder, whenFolderChanges } from "./browse.js";
import { activeKey, activeChain, chainTitle, choose, compare, isCompared, kOrders, kTiers, lensValue,
    load_chain, order, samples, setChain, setLens, setOrder, setSamples, shippedName, shippedNames, tier,
    unsetLens, whenChainsChange } from "./chains.js";
import { resolved } from "./look.js";
import { page } from "./page.js";

const kSamples = [1, 2, 4, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 512];
const nearest = (list, v) => list.reduce((best, one, i) =>
    (Math.abs(Math.log(one / v)) < Math.abs(Math.log(list[best] / v)) ? i : best), 0);
const round = (v) => Number(v.toPrecision(3));

// place of a value on the slider and back; words of the value.
const logarithmic = (low, high) => ({ min: 0, max: 1000,
    place: (v) => (1000 * Math.log(v / low)) / Math.log(high / low),
    value: (place) => round(low * (high / low) ** (place / 1000)) });

let focus = logarithmic(0.1, 100);

const kRows = [
    { key: "shutter_frames", label: "Shutter", unit: "frames", min: 0, max: 200,
        place: (v) => 100 * v, value: (place) => place / 100,
        words: (v) => `${number(v)} fr, ${Math.round(360 * v)}\u00b0` },
    { key: "f_stop", label: "f-stop", ...logarithmic(0.7, 32), words: (v) => `f/${number(v)}` },
    { key: "focus_distance", label: "Focus", get min() { return focus.min; },
        get max() { return focus.max; }, place: (v) => focus.place(v),
        value: (place) => focus.value(place), words: (v) => number(v) },
    { label: "Samples", min: 0, max: kSamples.length - 1, read: samples,
        place: (v) => nearest(kSamples, v), value: (place) => kSamples[place], words: String,
        write: setSamples },
    { label: "Order", min: 0, max: kOrders.length - 1, read: order, place: (v) => v,
        value: (v) => v, words: (v) => kOrders[v], write: setOrder },
    { label: "Quality", min: 0, max: kTiers.length - 1,
        read: () => (tier() < 0 ? undefined : tier()), place: (v) => v, value: (v) => v,
        words: (v) => kTiers[v], unset: "custom", write: (v) => load_chain(kTiers[v]), always: true },
];

const drawn = [];

function slider(row) {
    const id = new_id();
    const input = h("input", { type: "range", id, min: row.min, max: row.max, step: 1 });
    const output = h("output", { for: id });
    const reset = row.key && h("button", { type: "button", class: "reset", hidden: true,
        "aria-label": `${row.label}: back to the camera's value`, title: "Back to the camera's value",
        onclick: () => unsetLens(row.key) }, "\u21ba");
    input.addEventListener("input", () => {
        const value = row.value(input.valueAsNumber);
        if (row.key) setLens(row.key, value);
        else row.write(value);
    });
    drawn.push({ row, input, output, reset });
    return h("div", { class: "slider" }, h("label", { for: id }, row.label), input, output,
        reset || h("span"));
}

function draw() {
    const camera = resolved();
    for (const { row, input, output, reset } of drawn) {
        const value = row.key ? lensValue(row.key, camera) : row.read();
        const known = typeof value === "number" && Number.isFinite(value);
        if (document.activeElement !== input || !known) input.value = known ? row.place(value) : input.min;
        else if (row.value(input.valueAsNumber) !== value) input.value = row.place(value);
        const words = known ? row.words(value) : row.unset ?? (row.key ? "unknown" : "\u2013");
        output.textContent = words;
        input.setAttribute("aria-valuetext", words);
        input.disabled = !activeChain().value || (!known && !row.key && !row.always);
        if (reset) reset.hidden = activeChain().value?.camera?.[row.key] === undefined;
    }
    for (const which of ["a", "b"]) {
        const tab = by_id(`tab-${which}`);
        tab.textContent = printable(`${which.toUpperCase()} ${chainTitle(which)}`);
        tab.setAttribute("aria-pressed", activeKey() === which);
    }
    for (const id of ["tab-b", "swap"]) by_id(id).hidden = !isCompared();
    by_id("compare").setAttribute("aria-pressed", isCompared());
    by_id("compare").textContent = isCompared() ? "Close B" : "Compare with B";
    by_id("load").value = shippedName(activeKey()) ?? "";
}

function fill_load() {
    const select = by_id("load");
    const option = (path, text) => h("option", { value: path }, text);
    select.replaceChildren(option("", "Load a chain \u2026"),
        h("optgroup", { label: "Shipped" }, shippedNames().map((name) => option(name, name))),
        folder()?.chains.length ? h("optgroup", { label: "In this folder" },
            folder().chains.map((path) => option(path, path.split("/").at(-1)))) : "");
    draw();
}

/** A new shot: the slider of the focus covers the depths around its own. */
export function planned_focus() {
    const distance = resolved()?.focus_distance?.value;
    if (typeof distance === "number" && distance > 0 && Number.isFinite(distance))
        focus = logarithmic(distance / 20, distance * 20);
    draw();
}

export function start_sliders() {
    by_id("sliders").replaceChildren(...kRows.map(slider));
    by_id("load").addEventListener("change", (event) => {
        if (event.target.value) load_chain(event.target.value).catch(page.fail);
    });
    for (const which of ["a", "b"]) by_id(`tab-${which}`).addEventListener("click", () => choose(which));
    by_id("compare").addEventListener("click", () => {
        compare(!isCompared());
        if (isCompared()) choose("b");
    });
    by_id("swap").addEventListener("click", () => {
        if (activeChain().value) setChain(activeChain(), activeKey() === "a" ? "b" : "a");
    });
    whenChainsChange(draw);
    whenFolderChanges(fill_load);
    fill_load();
}
