// A job's report, shown instead of the viewer. Its scripts run in an origin of their own, which reaches
// neither this page nor the service: the pictures that it asks for are fetched and sent from here.
import { by_id, h } from "../shared/dom.js";
import { address, getText } from "./api.js";

let shown = null;  // {frame, path}

export function close_report() {
    shown?.frame.remove();
    shown = null;
    by_id("report").hidden = true;
}

export function open_report(path) {
    close_report();
    const frame = h("iframe", { src: `${path}/report/index.html?pictures=apart`, title: "Report",
        sandbox: "allow-scripts allow-downloads" });
    shown = { frame, path };
    by_id("report").hidden = false;
    by_id("report").append(frame);
}

// "%2e" is a dot to a URL, so that "%2e%2e" would leave the folder.
const is_below = (path) => /^[\w%~-][\w.%~-]*(\/[\w%~-][\w.%~-]*)*$/.test(path)
    && !/%(2e|2f|5c)/i.test(path);

// `page`: the report in the frame, which may be one of a study.
async function text_of({ path }, id, asset, page) {
    const folder = new URL(`${path}/report/`, document.baseURI).pathname;
    const name = String(page).slice(folder.length);
    if (!String(page).startsWith(folder) || !is_below(name)) throw new Error("is not its page");
    if (typeof asset !== "string") return getText(address(folder + name, { picture: id }));
    if (!is_below(asset)) throw new Error("its pictures are not in its folder");
    const file = folder + name.replace(/[^/]*$/, asset);
    return /^postchain_asset\("[^"]*","([^"]*)"\)/.exec(await getText(file))[1];
}

export function start_report() {
    by_id("report-close").addEventListener("click", close_report);
    addEventListener("message", async ({ source, data }) => {
        const mine = shown;
        const id = data?.postchain_wants;
        if (source !== mine?.frame.contentWindow || !/^image-\d+$/.test(id)) return;
        const reply = { postchain_picture: id };
        try {
            reply.text = await text_of(mine, id, data.asset, data.page);
        } catch (error) {
            reply.why = error.message;
        }
        mine.frame.contentWindow?.postMessage(reply, "*");  // its origin has no name
    });
}
