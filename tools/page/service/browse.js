// Folders of the roots: the sequences in them are opened with a click, with the camera beside them.
import { by_id, h, printable } from "../shared/dom.js";
import { rove } from "../shared/roving.js";
import { counted } from "../shared/words.js";
import { address, get } from "./api.js";
import { load_chain } from "./chains.js";
import { look } from "./look.js";
import { page, state } from "./page.js";

let here = null, asked = 0, mark = () => {};
const listeners = [];

/** What the folder that is open has, for lists of cameras and chains. */
export const folder = () => here;
export const whenFolderChanges = (f) => listeners.push(f);

/** "1-3,7,10-20x5" as numbers. */
function frames_of(text) {
    const frames = [];
    for (const part of text.split(",")) {
        const [, from, to, step] = /^\s*(-?\d+)(?:-(-?\d+)(?:x(\d+))?)?\s*$/.exec(part) ?? [];
        if (from !== undefined)
            for (let i = Number(from); i <= Number(to ?? from); i += Number(step ?? 1)) frames.push(i);
    }
    return frames;
}

const parent_of = (path) => (path.includes("/") ? path.slice(0, path.lastIndexOf("/")) || "/" : ".");

function row(icon, name, detail, attributes, image) {
    return h("li", {}, h("button", { type: "button", class: "entry", tabindex: -1, ...attributes },
        image ?? h("span", { class: "icon", "aria-hidden": "true" }, icon),
        h("span", { class: "name" }, name), h("span", { class: "detail" }, detail)));
}

function open_sequence(sequence) {
    const camera = here.cameras.find((path) => /camera/i.test(path.split("/").at(-1)))
        ?? here.cameras[0] ?? "";
    state.set({ frame: frames_of(sequence.frames)[0] });
    return show_shot(sequence, camera);
}

/** Looks at a sequence through the chains. more: of a job that is edited: {show, send}: further keys of
    requests and jobs; output, frames. */
export function show_shot(sequence, camera, more) {
    page.leave_job?.();
    return look({ name: sequence.path, input: sequence.path, camera, more,
        frames: frames_of(sequence.frames).map((frame) => ({ frame })) }).then(() => {
        mark_open();
        for (const f of listeners) f();
    });
}

function mark_open() {
    for (const button of by_id("entries").querySelectorAll("button"))
        if (button.dataset.path && button.dataset.path === state.get("shot"))
            button.setAttribute("aria-current", "true");
        else button.removeAttribute("aria-current");
}

function draw(focus) {
    const first = ({ frames }) => frames_of(frames)[0];
    by_id("where").textContent = here.folder === "." ? "all shots" : printable(here.folder || "roots");
    by_id("up").disabled = here.parent === null;
    by_id("entries").replaceChildren(
        ...here.folders.map((one) => row("\u25b8", one.name, "", { "data-folder": one.path,
            onclick: () => open_folder(one.path, true) })),
        ...here.sequences.map((one) => row("", one.name,
            `${one.frames.replaceAll(",", ", ")} \u00b7 ${counted(one.count, "frame")}`,
            { "data-path": one.path, onclick: () => open_sequence(one) },
            h("img", { alt: "", loading: "lazy", class: "icon",
                src: address("v1/image", { input: one.path, frame: first(one), side: 120 }) }))),
        ...here.chains.map((path) => row("\u2261", path.split("/").at(-1), "chain", {
            onclick: () => load_chain(path).catch((error) => page.fail(error)) })),
        ...here.studies.map((path) => row("\u2630", path.split("/").at(-1), "study", {
            onclick: () => page.new_job({ kind: "study", study: path }) })));
    by_id("no-entries").hidden = by_id("entries").childElementCount > 0;
    mark();
    mark_open();
    if (focus) (by_id("entries").querySelector("button") ?? by_id("up")).focus();
}

export async function open_folder(path, focus = false) {
    const mine = ++asked;
    try {
        const reply = await get(address("v1/browse", { folder: path || undefined }));
        if (mine !== asked) return false;
        here = reply;
    } catch (error) {
        page.fail(error);
        if (!here && path) await open_folder("");
        return false;
    }
    draw(focus);
    for (const f of listeners) f();
    return true;
}

/** Opens the sequence of a deep link. */
export async function open_shot(path, camera, frame) {
    if (!await open_folder(parent_of(path))) return;
    const found = here.sequences.find((one) => one.path === path);
    if (!found) return page.fail(new Error(`${path}: no such frames`));
    state.set({ frame: frame || frames_of(found.frames)[0] });
    await show_shot(found, camera);
}

export function start_browse() {
    const list = by_id("entries");
    const items = () => [...list.querySelectorAll("button")];
    mark = rove(list, items, { chosen: () => list.querySelector("[aria-current]") ?? undefined });
    list.addEventListener("keydown", (event) => {
        if (event.key === "Backspace" || event.key === "ArrowLeft") up();
        else if (event.key === "ArrowRight" && event.target.dataset.folder) event.target.click();
        else return;
        event.preventDefault();
    });
    const up = () => typeof here?.parent === "string" && open_folder(here.parent, true);
    by_id("up").addEventListener("click", up);
}
