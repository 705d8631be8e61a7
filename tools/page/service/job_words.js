// A job in words.
import { duration } from "../shared/words.js";

export const basename = (text) => String(text || "").split("/").pop();

/** "run balanced: shot.####.exr" */
export function nameOf(job) {
    const request = job.request || {};
    const chain = typeof request.chain === "string" ? basename(request.chain) : "own chain";
    const other = typeof request.chain_b === "string" ? ` / ${basename(request.chain_b)}` : "";
    return `${job.kind} ${chain}${other}: ${basename(request.input)}`;
}

/** "34 of 100 frames, 2 failed, 1 min left" */
export function progressOf(job) {
    const parts = [];
    if (job.frames) parts.push(`${job.done} of ${job.frames} frames`);
    if (job.failed) parts.push(`${job.failed} failed`);
    if (job.state === "running" && job.remaining_s > 0)
        parts.push(`${duration(job.remaining_s)} left`);
    return parts.join(", ");
}
