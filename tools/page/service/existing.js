// Outputs that exist, or that a waiting job is going to write: what a user can do about it.
import { h } from "../shared/dom.js";
import { address, find_jobs, get } from "./api.js";

const kVersion = /_v(\d+)$/;

const folder_of = (path) => path.slice(0, path.lastIndexOf("/") + 1);
// "out/a_v002.####.exr": the name before the version, the version, the rest.
function parts_of(output) {
    const folder = folder_of(output), name = output.slice(folder.length);
    const dot = name.search(/\.|$/), stem = name.slice(0, dot);
    return { start: folder + stem.replace(kVersion, ""), version: kVersion.exec(stem)?.[1],
        rest: name.slice(dot) };
}

/** "out/a.####.exr" --> "out/a_v002.####.exr": the first version above all on disk and in jobs. */
export async function next_version(output) {
    const { start, version, rest } = parts_of(output), folder = folder_of(output);
    const [here, jobs] = await Promise.all([
        get(address("v1/browse", { folder: folder.replace(/\/$/, "") || "." })).catch(() => null),
        find_jobs(start).catch(() => [])]);
    const names = [output, ...[...here?.sequences ?? [], ...here?.folders ?? []].map((one) => one.path),
        ...jobs.map((one) => one.about.output)];
    const last = Math.max(...names.filter((name) => typeof name === "string").map(parts_of)
        .filter((one) => one.start === start).map((one) => Number(one.version ?? 1)));
    return `${start}_v${String(last + 1).padStart(version?.length ?? 3, "0")}${rest}`;
}

/** What exists, without the API's remedies; undefined: the refusal has another reason. */
export const what_exists = (refusal) => refusal.errors?.find((one) =>
    one.path === "on_existing")?.message.split("; ")[0];

/** Buttons if `refusal` is about what exists: again(more) submits `body` with other keys. */
export async function offer(refusal, body, again) {
    if (!what_exists(refusal)) return [];
    const version = await next_version(body.output);
    const button = (label, more, title) => h("button", { type: "button", title,
        onclick: () => again(more) }, label);
    const is_run = (body.kind ?? "run") === "run";
    return [
        button(`Write ${version.slice(folder_of(version).length)}`, { output: version }, "The next version"),
        button("Replace", { on_existing: "overwrite" }, "The files that exist"),
        is_run && button("Only what is missing", { on_existing: "skip" },
            "Keeps outputs that this chain made of these frames, and replaces none")].filter(Boolean);
}
