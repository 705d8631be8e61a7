"""The page for everybody: contrast, names, sizes and the order of Tab, in headless Chromium.

usage: page_access_test.py POSTCHAIN"""
from service_page import OnTheService, TAB, run


# Text whose contrast with what is behind it is too small (WCAG AA), and controls without a name, with
# a role that does not fit, or too small to touch.
FAULTS = """
const visible = (e) => e.checkVisibility({opacityProperty: true, visibilityProperty: true})
    && e.getClientRects().length;
const channels = (text) => (text.match(/[\\d.]+/g) || [0, 0, 0, 0]).map(Number);
const light = ([r, g, b]) => [r, g, b].map((v) => v / 255).map((v) =>
    v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
const behind = (e) => {
    for (; e; e = e.parentElement) {
        const [r, g, b, a = 1] = channels(getComputedStyle(e).backgroundColor);
        if (a === 1) return [r, g, b];
        if (a > 0) return null;  // partly the picture
    }
    return [255, 255, 255];
};
const faults = [];
const walker = document.createTreeWalker(document.querySelector("dialog[open]") ?? document.body,
    NodeFilter.SHOW_TEXT);
while (walker.nextNode()) {
    const e = walker.currentNode.parentElement;
    if (!walker.currentNode.data.trim() || !visible(e) || e.closest("script, :disabled, .sr, option"))
        continue;
    const style = getComputedStyle(e), back = behind(e);
    if (!back) continue;
    const [a, b] = [light(channels(style.color)), light(back)].sort((x, y) => y - x);
    const large = parseFloat(style.fontSize) >= 24;
    if ((a + 0.05) / (b + 0.05) < (large ? 3 : 4.5))
        faults.push(`contrast ${((a + 0.05) / (b + 0.05)).toFixed(2)}: ${e.outerHTML.slice(0, 80)}`);
}
for (const e of document.querySelectorAll("button, a, input, select, textarea, [role], [tabindex]")) {
    if (!visible(e) || e.closest(".sr")) continue;
    const name = e.getAttribute("aria-label") || e.labels?.length || /\\w/.test(e.textContent)
        || e.getAttribute("aria-labelledby") || e.tagName === "PRE";
    if (!name && e.getAttribute("role") !== "status" && e.getAttribute("role") !== "alert")
        faults.push(`no name: ${e.outerHTML.slice(0, 80)}`);
    if (e.tabIndex > 0) faults.push(`tabindex: ${e.outerHTML.slice(0, 80)}`);
    const box = e.getBoundingClientRect();
    if (e.matches("button") && Math.min(box.width, box.height) < 23.5)
        faults.push(`small: ${e.outerHTML.slice(0, 80)}`);
}
for (const tab of document.querySelectorAll("[aria-controls], [aria-labelledby], [aria-describedby]"))
    for (const key of ["aria-controls", "aria-labelledby", "aria-describedby"])
        for (const id of (tab.getAttribute(key) || "").split(" ").filter(Boolean))
            if (!document.getElementById(id)) faults.push(`${key}: no ${id}`);
const ids = [...document.querySelectorAll("[id]")].map((e) => e.id);
faults.push(...ids.filter((id, i) => ids.indexOf(id) !== i).map((id) => `twice: ${id}`));
return faults;
"""


class Accessible(OnTheService):
    def check(self, where):
        for scheme in ("light", "dark"):
            self.browser.scheme(scheme)
            self.assertEqual(self.browser.run(FAULTS), [], (where, scheme))
            for width in (360, 700, 1280, 2200):
                self.browser.size(width, 800)
                self.assertLessEqual(self.browser.run(
                    "return document.documentElement.scrollWidth - innerWidth;"), 0, (where, width))
            self.browser.size(390, 844)
            self.assertEqual(self.browser.run(FAULTS), [], (where, scheme, "phone"))
            self.browser.size(1280, 900)

    def test_every_screen(self):
        self.open()
        self.check("nothing chosen")
        self.open_shot()
        self.press("Compare with B")
        self.browser.run("for (const d of document.querySelectorAll('#chain details')) d.open = true;")
        self.browser.wait("document.querySelector('.left-out, #plan .help')")
        self.check("a shot")
        self.click("#settings")
        self.browser.wait("document.querySelector('#new form')")
        self.browser.run("for (const d of document.querySelectorAll('#new details')) d.open = true;")
        self.check("the form")
        self.browser.run("document.getElementById('new').close();"
                         "document.getElementById('help').showModal();")
        self.check("keys")
        self.open_job(self.submit(input="broken/f.####.exr", output="out/seen.####.exr"), "failed")
        self.browser.wait("document.querySelector('#fault.bad')")
        self.check("a job")

    def test_the_order_of_tab(self):
        self.open_shot()
        self.browser.run("document.body.tabIndex = -1; document.body.focus();"
                         "document.body.removeAttribute('tabindex');")
        order = []
        for _ in range(60):
            self.browser.keys(TAB)
            at = self.browser.run("""
                const e = document.activeElement, style = getComputedStyle(e);
                const shown = style.outlineStyle !== "none" || e.matches("textarea, iframe");
                return [e === document.body ? "" : e.id || e.className || e.tagName, shown];""")
            if not at[0]:
                break
            self.assertTrue(at[1], at)
            order.append(at[0])
        wanted = ["skip", "new-job", "show-shots", "entry", "canvas", "wipe", "ev", "cell", "load",
                  "output", "submit"]
        at = [order.index(next(one for one in order if one.startswith(name))) for name in wanted]
        self.assertEqual(at, sorted(at), order)
        # A list is one stop.
        self.assertEqual(len([one for one in order if one.startswith("entry")]), 1)
        self.assertEqual(len([one for one in order if one.startswith("cell")]), 1)


if __name__ == "__main__":
    run()
