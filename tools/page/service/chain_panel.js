// Beside the picture: the choice of the chains A and B, the text of the chosen one, and its faults.
import { by_id, h, printable } from "../shared/dom.js";
import { post } from "./api.js";
import { folder, whenFolderChanges } from "./browse.js";
import { activeChain, activeKey, chainTitle, choose, compare, isCompared, load_chain, read_files_again,
    shippedNames, whenChainsChange } from "./chains.js";
import { basename } from "./job_words.js";
import { page } from "./page.js";

function draw_choice() {
    by_id("a-or-b").hidden = !isCompared();
    for (const which of ["a", "b"]) {
        const tab = by_id(`tab-${which}`);
        tab.textContent = printable(`${which.toUpperCase()} ${chainTitle(which)}`);
        tab.setAttribute("aria-pressed", activeKey() === which);
    }
    by_id("compare").setAttribute("aria-pressed", isCompared());
    by_id("compare").textContent = isCompared() ? "Close B" : "Compare with B";
    const { name } = activeChain(), files = folder()?.chains ?? [];
    const group = (label, names) => names.length > 0 && h("optgroup", { label },
        names.map((one) => h("option", { value: one }, basename(one))));
    const others = [name].filter((one) => ![...shippedNames(), ...files].includes(one));
    by_id("load").replaceChildren(...[group("Shipped", shippedNames()), group("In this folder", files),
        group("Other", others)].filter(Boolean));
    by_id("load").value = name;
}

// faults: of the service's check, with severity, line, path and message.
function draw_text(faults) {
    by_id("text").replaceChildren(...activeChain().text.trimEnd().split("\n").map((text, i) =>
        h("span", { class: faults.filter((one) => one.line === i + 1).map((one) => one.severity).join(" ") },
            `${text}\n`)));
    by_id("diagnostics").replaceChildren(...faults.map((one) => h("li", { class: one.severity },
        `${one.line ? `line ${one.line}: ` : ""}${one.path ? `${one.path}: ` : ""}${one.message}`)));
}

async function draw() {
    draw_choice();
    draw_text([]);
    const { text } = activeChain();
    const faults = (await post("v1/chain/check", { text }).catch(() => ({}))).diagnostics ?? [];
    if (text === activeChain().text) draw_text(faults);
}

export function start_chain_panel() {
    by_id("load").addEventListener("change", (event) => load_chain(event.target.value).catch((error) => {
        draw_choice();
        page.fail(error);
    }));
    for (const which of ["a", "b"]) by_id(`tab-${which}`).addEventListener("click", () => choose(which));
    by_id("compare").addEventListener("click", () => compare(!isCompared()));
    addEventListener("focus", read_files_again);
    whenChainsChange(draw);
    whenFolderChanges(draw_choice);
    draw();
}
