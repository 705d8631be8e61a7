// The strip of frames below the picture: thumbnails and states. Only the cells in sight exist.
import { by_id, h, printable, settle } from "../shared/dom.js";
import { address, jobPath } from "./api.js";
import { model, page, state } from "./page.js";
import { is_bad, is_finished } from "./pictures.js";

const kCell = 112;   // CSS pixels
const kAhead = 2;    // cells outside the sight
const kWords = { written: "written", skipped: "kept", missing: "missing",
    quarantined: "failed" };

const kLeft = { canceled: "canceled", failed: "left" };  // by the job that did not filter it

const cells = new Map();  // frame -> {box, image, word, source}
const strip = () => by_id("film");
const track = () => by_id("film-track");

const index_of = (frame) => model.page_frames.indexOf(frame);

function source_of(entry) {
    const { subject } = model;
    if (subject.job) return address(`${jobPath(subject.job)}/frames/${entry.frame}/${
        is_finished(entry) ? "after" : "before"}.png`, { side: 160 });
    return address("v1/image", { input: subject.input, frame: entry.frame, side: 160 });
}

function cell_of(entry) {
    const cell = { image: h("img", { alt: "", draggable: "false" }), word: h("span") };
    cell.image.addEventListener("error", () => cell.image.classList.add("none"));
    cell.box = h("button", { type: "button", class: "cell", "data-frame": entry.frame, tabindex: -1,
        onclick: () => state.set({ frame: entry.frame }) },
    cell.image, h("span", { class: "number" }, h("span", { class: "sr" }, "Frame "),
        String(entry.frame)), cell.word);
    return cell;
}

function fill(cell, entry, index) {
    const chosen = entry.frame === state.get("frame");
    const word = kWords[entry.state] ?? (entry.state && (kLeft[model.subject.state] ?? "waiting")) ?? "";
    cell.box.style.left = `${index * kCell}px`;
    cell.box.className = `cell ${entry.state ?? ""}`;
    cell.word.className = entry.state ? `state ${entry.state}` : "";
    cell.word.textContent = word;
    cell.box.title = printable(entry.message || "");
    cell.box.tabIndex = chosen ? 0 : -1;
    if (chosen) cell.box.setAttribute("aria-current", "true");
    else cell.box.removeAttribute("aria-current");
}

// Pictures are asked for when the strip rests.
const load_images = settle(() => {
    for (const [frame, cell] of cells) {
        const entry = model.subject?.frames[index_of(frame)];
        const source = entry && source_of(entry);
        if (!source || cell.source === source) continue;
        cell.source = source;
        cell.image.classList.remove("none");
        cell.image.src = source;
    }
}, 120);

function draw() {
    const frames = model.subject?.frames ?? [];
    const box = strip();
    by_id("film-box").hidden = !frames.length;
    track().style.width = `${frames.length * kCell}px`;
    const from = Math.max(0, Math.floor(box.scrollLeft / kCell) - kAhead);
    const to = Math.min(frames.length, Math.ceil((box.scrollLeft + box.clientWidth) / kCell) + kAhead);
    const chosen = index_of(state.get("frame"));
    const wanted = new Set();
    for (let i = from; i < to; ++i) wanted.add(i);
    if (chosen >= 0) wanted.add(chosen);  // it may have the focus
    const kept = new Set([...wanted].map((i) => frames[i].frame));
    for (const [frame, cell] of cells)
        if (!kept.has(frame)) {
            cell.box.remove();
            cells.delete(frame);
        }
    for (const i of [...wanted].sort((a, b) => a - b)) {
        const entry = frames[i];
        let cell = cells.get(entry.frame);
        if (!cell) {
            cell = cell_of(entry);
            cells.set(entry.frame, cell);
            track().append(cell.box);
        }
        fill(cell, entry, i);
    }
    const bad = frames.filter(is_bad);
    by_id("next-bad").hidden = !bad.length;
    by_id("next-bad").textContent = `${bad.length} failed`;
    by_id("next-bad").setAttribute("aria-label", `${bad.length} failed frames: show the next one`);
    load_images();
}

function show_chosen() {
    const box = strip(), at = index_of(state.get("frame")) * kCell;
    if (at < box.scrollLeft) box.scrollLeft = Math.max(0, at - kCell);
    else if (at + kCell > box.scrollLeft + box.clientWidth)
        box.scrollLeft = at + 2 * kCell - box.clientWidth;
    draw();
}

/** Other frames: begins anew. */
function new_film() {
    for (const { box } of cells.values()) box.remove();
    cells.clear();
    draw();
    show_chosen();
}
export const update_film = draw;

export function start_film() {
    const box = strip();
    box.addEventListener("scroll", draw, { passive: true });
    new ResizeObserver(show_chosen).observe(box);
    box.addEventListener("keydown", (event) => {
        if (event.ctrlKey || event.metaKey || event.altKey || !model.page_frames.length) return;
        const last = model.page_frames.length - 1, at = index_of(state.get("frame"));
        const page_of = Math.max(1, Math.floor(box.clientWidth / kCell) - 1);
        const to = { ArrowLeft: at - 1, ArrowRight: at + 1, Home: 0, End: last,
            PageUp: at - page_of, PageDown: at + page_of }[event.key];
        if (to === undefined) return;
        event.preventDefault();
        state.set({ frame: model.page_frames[Math.min(Math.max(to, 0), last)] });
        cells.get(state.get("frame"))?.box.focus({ preventScroll: true });
    });
    by_id("next-bad").addEventListener("click", () => {
        const bad = model.subject.frames.filter(is_bad);
        const at = index_of(state.get("frame"));
        state.set({ frame: (bad.find((one) => index_of(one.frame) > at) ?? bad[0]).frame });
    });
    state.watch(["frame"], () => model.subject && show_chosen());
    page.looked = new_film;
}
