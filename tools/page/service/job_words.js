// A job in words.
import { duration } from "../shared/words.js";

export const basename = (text) => String(text || "").split("/").pop();

/** "run balanced: shot.####.exr" */
export function nameOf(job) {
    const { chain, chain_b, input } = job.about;
    const other = chain_b ? ` / ${basename(chain_b)}` : "";
    return `${job.kind} ${chain ? basename(chain) : "own chain"}${other}: ${basename(input)}`;
}

/** "wheels/sharp": what the job is about, for a list. */
export function shotOf(job) {
    const { input, study } = job.about;
    if (study) return study;
    const path = String(input || job.kind).replace(/^color=([^,]*).*/, "$1");
    return path.split("/").slice(-2).join("/").replace(/[._-]?(#+|@+|%0?\d*d|\$F\d*)?\.\w+$/, "");
}

/** "out/best.####.exr": what it writes. */
export const outputOf = (job) => job.about.output ?? "";

/** "fast", "ab fast / paper" */
export function workOf(job) {
    const word = (chain) => (typeof chain === "string" ? basename(chain) : "own chain");
    const { chain, chain_b } = job.about;
    if (job.kind === "study") return "study";
    return [job.kind === "run" ? "" : job.kind, word(chain),
        job.kind === "ab" ? `/ ${word(chain_b)}` : ""].filter(Boolean).join(" ");
}

/** "34 of 100 frames, 2 failed, 1 min left"; short: without "frames". */
export function progressOf(job, short = false) {
    const parts = [];
    if (job.frames) parts.push(`${job.done} of ${job.frames}${short ? "" : " frames"}`);
    if (job.failed) parts.push(`${job.failed} failed`);
    if (job.state === "running" && job.remaining_s > 0)
        parts.push(`${duration(job.remaining_s)} left`);
    return parts.join(", ");
}
