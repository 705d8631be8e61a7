"""The page in headless Chromium, on the real service: from the folders to a picture, to a job, to its
report, by mouse and by keyboard.

usage: page_test.py POSTCHAIN      AXE_CORE=axe.min.js in the environment runs axe as well"""
import array
import json
import math
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "page"))
from browser import Browser, RIGHT, SOFTWARE_GL  # noqa: E402
from server import Server  # noqa: E402

PROGRAM = None
TOKEN = "0123456789abcdef"
HOSTILE = "<img hostile src onerror>"
TAB, ENTER, LEFT, DOWN, ALT = "\ue004", "\ue007", "\ue012", "\ue015", "\ue00a"
SHOT = "shot=shots/sharp.%23%23%23%23.exr&camera=shots/camera.json"
SHOWN = ("postchain.viewer?.shown?.image && "
         "document.getElementById('canvas').getAttribute('aria-busy') !== 'true'")


def half(bits):
    return struct.unpack("<e", struct.pack("<H", bits))[0]


def values_of(data):
    """Width, height, channels and rows of a picture as the service sends it to a page."""
    assert data[:4] == b"PPIC"
    width, height, channels = struct.unpack("<III", data[4:16])
    planes = zlib.decompress(data[16:])
    count = width * height * channels
    steps = [planes[i] << 8 | planes[count + i] for i in range(count)]
    image = array.array("H", bytes(2 * count))
    for c in range(channels):
        above = 0
        for y in range(height):
            left = above
            for x in range(width):
                left = (left + steps[(c * height + y) * width + x]) & 0xffff
                image[(y * width + x) * channels + c] = left
                if x == 0:
                    above = left
    return width, height, channels, image


class OnTheService(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = pathlib.Path(cls.folder.name)
        subprocess.run([PROGRAM, "scene", "wheels", "-o", str(cls.path / "shots"), "--frames", "1-3",
                        "--size", "160x90", "--device", "software", "-q"], check=True)
        (cls.path / "broken").mkdir()
        for frame in (1, 2, 3):
            data = (cls.path / f"shots/sharp.000{frame}.exr").read_bytes()
            (cls.path / f"broken/f.000{frame}.exr").write_bytes(
                data[:len(data) // 2] if frame == 2 else data)
        (cls.path / "out").mkdir()
        (cls.path / "token").write_text(TOKEN + "\n")
        cls.server = Server([PROGRAM, "serve", "--root", str(cls.path), "--store",
                             str(cls.path / "jobs.sqlite"), "--port", "0", "--device", "software"])
        cls.base = f"http://127.0.0.1:{cls.server.port}/"
        cls.browser = Browser(SOFTWARE_GL)
        cls.browser.size(1280, 900)

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()
        assert cls.server.stop() == 143
        cls.folder.cleanup()

    def setUp(self):
        self.browser.size(1280, 900)
        self.browser.scheme("light")

    def open(self, state=""):
        self.browser.open(self.base + "#" + state)
        self.browser.wait("globalThis.postchain?.viewer && document.querySelector('.entry')",
                          seconds=60)

    def open_shot(self, more=""):
        self.open(SHOT + more)
        self.browser.run("localStorage.clear();")
        self.open(SHOT + more)
        self.browser.wait(f"{SHOWN} && postchain.model.subject", seconds=60)

    def click(self, selector):
        self.browser.wait("document.querySelector(args[0])?.checkVisibility()", selector)
        self.browser.run("document.querySelector(args[0]).click();", selector)

    def press(self, text):
        self.browser.wait("[...document.querySelectorAll('button')].some((b) => "
                          "b.textContent === args[0] && b.checkVisibility() && !b.disabled)", text)
        self.browser.run("[...document.querySelectorAll('button')].find((b) => "
                         "b.textContent === args[0] && b.checkVisibility()).click();", text)

    def text(self, selector):
        return self.browser.run("return document.querySelector(args[0])?.innerText ?? null;", selector)

    def state(self, key):
        return self.browser.run("return postchain.state.get(args[0]);", key)

    def focused(self):
        return self.browser.run("const e = document.activeElement; return e.id || e.dataset.frame || "
                                "e.dataset.path || e.dataset.folder || e.className;")

    def slide(self, label, place):
        self.browser.run("""
            const input = [...document.querySelectorAll(".slider")].find((one) =>
                one.querySelector("label").textContent === args[0]).querySelector("input");
            input.value = args[1];
            input.dispatchEvent(new Event("input", {bubbles: true}));""", label, place)

    def chain(self, which="a"):
        kept = json.loads(self.browser.run("return localStorage.getItem('postchain-chains');"))
        return json.loads(kept[which]["text"])

    def value(self, key, x, y):
        return self.browser.run("const v = postchain.viewer.values(postchain.model.source(args[0]), "
                                "{x: args[1], y: args[2]}); return v && v.rgb;", key, x, y)

    def place(self, x, y):
        """A pixel of the frame, in the window."""
        return self.browser.run("""
            const box = document.getElementById("canvas").getBoundingClientRect();
            const [x, y] = postchain.viewer.from_picture(args[0] + 0.5, args[1] + 0.5);
            return [box.left + x, box.top + y];""", x, y)

    def submit(self, **body):
        status, _, answer = self.server.ask("POST", "/v1/jobs", {
            "input": "shots/sharp.####.exr", "camera": "shots/camera.json", "chain": "fast",
            "on_existing": "overwrite", **body})
        self.assertEqual(status, 202, answer)
        return json.loads(answer)["id"]

    def done(self, job, state="done"):
        self.browser.wait("document.querySelector(`#job .state.${args[0]}`)", state, seconds=120)


class Picture(OnTheService):
    def test_from_the_folders_to_a_job_without_typing(self):
        self.open()
        self.browser.run("localStorage.clear();")
        self.open()
        self.click("[data-folder=shots]")
        self.click("[data-path='shots/sharp.####.exr']")
        self.browser.wait(SHOWN, seconds=60)
        self.assertEqual(self.state("camera"), "shots/camera.json")
        self.browser.wait("location.hash.includes('shots/sharp.%23%23%23%23.exr')")
        before = self.value("before", 80, 45)
        self.browser.wait("document.querySelectorAll('.slider output')[1].innerText.startsWith('f/')")
        # A slider changes the chain and the picture.
        after = self.browser.wait("postchain.viewer.values(postchain.model.source('a'), {x: 80, y: 45})"
                                  "?.rgb", seconds=60)
        self.slide("Shutter", 0)
        self.slide("f-stop", 1000)
        self.assertEqual(self.chain()["camera"]["shutter_frames"], 0)
        self.assertEqual(self.chain()["camera"]["f_stop"], 32)
        self.browser.wait(f"{SHOWN} && JSON.stringify(postchain.viewer.values("
                          "postchain.model.source('a'), {x: 80, y: 45})?.rgb) !== args[0]",
                          json.dumps(after).replace(" ", ""), seconds=60)
        self.press("\u21ba")
        self.assertNotIn("shutter_frames", self.chain()["camera"])
        self.press("\u21ba")
        self.assertNotIn("camera", self.chain())
        # Submitted as it is shown, beside the frames.
        self.browser.run("document.getElementById('which').value = '1-2';")
        self.press("Submit job")
        self.done("the job")
        self.assertTrue((self.path / "shots/out/sharp_balanced.0002.exr").exists())
        self.browser.wait(f"{SHOWN} && postchain.viewer.shown.frame === 1")
        self.browser.wait("document.querySelectorAll('.cell.written').length === 2")
        self.browser.wait("document.querySelector('#job table')")
        self.assertIn("joint_blur", self.text("#job table"))
        # The preview was what the job wrote.
        for a, b in zip(self.value("a", 80, 45), after):
            self.assertAlmostEqual(a, b, delta=0.002 * max(1, abs(a)))
        self.assertEqual(self.value("before", 80, 45), before)
        self.assertEqual(self.browser.errors(), [])

    def test_wipe_error_map_and_values(self):
        self.open_shot("&frame=2")
        self.browser.wait("postchain.viewer.shown.other", seconds=60)
        # Left of the line the frame before, on the screen.
        left, right = (self.browser.run("return postchain.viewer.read(args[0], 45);", x)
                       for x in (30, 130))
        self.browser.keys("w")
        self.browser.wait("!postchain.viewer.shown.other")
        self.assertEqual(self.browser.run("return postchain.viewer.read(130, 45);"), right)
        self.browser.keys("0")
        self.browser.wait("postchain.viewer.shown.source.key === 'before'")
        self.assertEqual(self.browser.run("return postchain.viewer.read(30, 45);"), left)
        self.browser.keys(" ", "e")
        self.browser.wait("postchain.viewer.shown.error", seconds=60)
        data = self.browser.run("return postchain.viewer.shown.error.data[45 * 160 + 80];")
        difference = max(abs(a - b) for a, b in zip(self.value("a", 80, 45),
                                                    self.value("before", 80, 45)))
        expected = 255 * min(max(math.log10(max(difference, 1e-30) / 1e-3) / 4, 0), 1)
        self.assertAlmostEqual(data, expected, delta=1)
        self.browser.keys("e")
        self.browser.mouse(self.place(60, 45))
        self.browser.wait("document.getElementById('values').innerText.includes('before')")
        self.assertEqual(self.browser.errors(), [])

    def test_click_to_focus(self):
        self.open_shot("&frame=1")
        data = self.server.ask("POST", "/v1/preview", {
            "chain": {"postchain": 1, "passes": []}, "plane": "depth", "frame": 1,
            "input": "shots/sharp.####.exr"}, {"Accept": "image/vnd.postchain"}, timeout=60)[2]
        width, _, channels, image = values_of(data)
        self.assertEqual(channels, 1)
        # In the middle of a surface, beside the line of the wipe.
        x, y = next((x, y) for y in range(10, 80, 5) for x in [*range(10, 65, 5), *range(95, 150, 5)]
                    if max(near := [half(image[(y + b) * width + x + a]) for a in range(-2, 3)
                                    for b in range(-2, 3)]) < 1.01 * min(near))
        distance = half(image[y * width + x])
        self.press("Focus by click")
        self.browser.mouse(self.place(x, y), "down", "up")
        self.browser.wait("JSON.parse(localStorage.getItem('postchain-chains'))?.a.text"
                          ".includes('focus_distance')", seconds=60)
        self.assertAlmostEqual(self.chain()["camera"]["focus_distance"], distance,
                               delta=0.02 * distance)
        self.browser.keys("o")
        self.assertEqual(self.browser.run("return document.getElementById('focus-on')"
                                          ".getAttribute('aria-pressed');"), "false")

    def test_order_quality_and_the_rest(self):
        self.open_shot()
        names = "return JSON.parse(localStorage.getItem('postchain-chains')).a.text;"
        self.slide("Order", 1)
        passes = [next(iter(one)) for one in self.chain()["passes"]]
        self.assertEqual(passes, ["depth_of_field", "motion_blur", "fxaa"])
        self.slide("Samples", 5)
        self.assertEqual([one[name]["samples"] for one, name in zip(self.chain()["passes"], passes[:2])],
                         [16, 17])  # motion blur takes odd numbers
        self.slide("Order", 2)
        self.assertEqual([next(iter(one)) for one in self.chain()["passes"]],
                         ["motion_blur", "depth_of_field", "fxaa"])
        self.slide("Quality", 2)
        self.browser.wait("JSON.parse(localStorage.getItem('postchain-chains')).a.text"
                          ".includes('\"starts\": 8')")
        # Behind "more": a form made from the schema, and the text with its faults.
        self.browser.run("for (const d of document.querySelectorAll('#chain > details, .pass details'))"
                         " d.open = true;")
        self.browser.run("""
            const label = [...document.querySelectorAll(".pass label")].find(
                (one) => one.textContent === "max_blur_px");
            const input = document.getElementById(label.htmlFor);
            input.value = "99999";
            input.dispatchEvent(new Event("change"));""")
        self.assertIn('"max_blur_px": 99999', self.browser.run(names))
        self.browser.wait("document.querySelector('.diagnostics .error')")
        message = self.text(".diagnostics .error")
        line = int(self.text(".gutter .error-line"))
        self.assertIn("max_blur_px", self.browser.run(names).split("\n")[line - 1])
        self.assertTrue(message.startswith(f"line {line}: passes[0].max_blur_px: 99999"), message)
        self.click(".diagnostics .error")
        self.assertEqual(self.browser.run("const t = document.activeElement; return t.value.slice(0, "
                                          "t.selectionStart).split('\\n').length;"), line)
        # A text that is YAML has no forms, and is checked too.
        self.browser.run("""
            const area = document.querySelector("#text textarea");
            area.value = "postchain: 1\\npasses:\\n  - fxaa: {preset: 99}\\n";
            area.dispatchEvent(new Event("input", {bubbles: true}));""")
        self.browser.wait("document.querySelector('.gutter .error-line')?.innerText === '3'")
        self.browser.run("document.getElementById('load').value = 'fast';"
                         "document.getElementById('load').dispatchEvent(new Event('change'));")
        self.browser.wait("document.querySelector('#plan p')?.innerText.startsWith('joint_blur')",
                          seconds=30)
        self.browser.errors()  # refused previews

    def test_two_chains_side_by_side(self):
        self.open_shot("&frame=2")
        self.press("Compare with B")
        self.browser.wait("postchain.viewer.shown?.source.key === 'b' && postchain.viewer.shown.other "
                          f"&& {SHOWN}", seconds=60)
        self.assertIn("A balanced \u2502 2", self.text("#shown"))
        a, b = self.value("a", 80, 45), self.value("b", 80, 45)
        self.assertNotEqual(a, b)
        self.slide("Quality", 2)  # of B
        self.browser.wait(f"{SHOWN} && JSON.stringify(postchain.viewer.values("
                          "postchain.model.source('b'), {x: 80, y: 45})?.rgb) !== args[0]",
                          json.dumps(b).replace(" ", ""), seconds=60)
        self.assertEqual(self.value("a", 80, 45), a)
        # Both go into the form of a comparison.
        self.click("#settings")
        self.browser.wait("document.querySelector('#new input[value=ab]:checked')")
        self.assertEqual(self.browser.run("return document.getElementById('new-chain_b').value;"),
                         "best")
        self.browser.run("document.getElementById('new').close();")
        self.press("Close B")
        self.assertEqual(self.browser.errors(), [])

    def test_a_link_leads_to_a_frame(self):
        self.open_shot("&frame=3&ev=1&wipe=0&zoom=2&x=40&y=45")
        self.assertEqual([self.state(key) for key in ("frame", "ev", "wipe", "zoom")], [3, 1, 0, 2])
        self.browser.wait("postchain.viewer.shown?.frame === 3")
        self.assertEqual(self.text(".cell[aria-current] .number").split(), ["Frame", "3"])
        job = self.submit(output="out/link.####.exr")
        self.open(f"job={job}&frame=2")
        self.done(job)
        self.browser.wait(f"{SHOWN} && postchain.viewer.shown.frame === 2", seconds=60)
        self.assertEqual(self.state("frame"), 2)
        self.open("job=99999")
        self.browser.wait("!document.getElementById('failure-box').hidden")
        self.assertEqual(self.text("#failure"), "There is no job 99999.")
        self.browser.errors()

    def test_by_keyboard_alone(self):
        self.open()
        self.browser.run("localStorage.clear();")
        self.browser.keys(("down", ALT), "1", ("up", ALT))
        self.browser.wait("document.activeElement.classList.contains('entry')")
        self.browser.run("document.querySelectorAll('#entries button')[0].focus();")
        while self.focused() != "shots":
            before = self.focused()
            self.browser.keys(DOWN)
            self.assertNotEqual(self.focused(), before)
        self.browser.keys(ENTER)
        self.browser.wait("document.activeElement.dataset.path")
        while self.focused() != "shots/sharp.####.exr":
            self.browser.keys(DOWN)
        self.browser.keys(ENTER)
        self.browser.wait(SHOWN, seconds=60)
        self.browser.keys(("down", ALT), "4", ("up", ALT))
        self.browser.wait("document.activeElement.dataset.frame === '1'")
        self.browser.keys(RIGHT)
        self.assertEqual([self.state("frame"), self.focused()], [2, "2"])
        self.browser.keys(("down", ALT), "5", ("up", ALT))
        self.browser.keys(RIGHT)
        self.assertEqual(self.chain()["camera"]["shutter_frames"], 0.51)
        self.browser.keys(("down", ALT), "3", ("up", ALT))
        self.assertEqual(self.focused(), "canvas")
        self.browser.keys(RIGHT, "]", "w")
        self.assertEqual([self.state("ev"), self.state("wipe")], [0.5, 0])
        # Up again, and over the tabs to the jobs.
        self.browser.run("document.querySelector('#entries [aria-current]').focus();")
        self.browser.keys(LEFT)
        self.browser.wait("document.activeElement.dataset.folder")
        self.browser.run("document.getElementById('show-shots').focus();")
        self.browser.keys(RIGHT)
        self.assertFalse(self.browser.run("return document.getElementById('jobs').hidden;"))
        self.browser.keys(TAB)
        self.assertEqual(self.focused(), "search")


class Jobs(OnTheService):
    def test_a_failed_frame_is_in_view(self):
        job = self.submit(input="broken/f.####.exr", output="out/bad.####.exr")
        self.open(f"job={job}")
        self.done(job, "failed")
        self.browser.wait("document.querySelector('#fault.bad')?.checkVisibility()", seconds=30)
        self.assertIn("Frame 2 failed: broken/f.0002.exr: truncated", self.text("#fault"))
        states = self.browser.run("return [...document.querySelectorAll('.cell .state')]"
                                  ".map((one) => one.innerText);")
        self.assertEqual(sorted(states), ["failed", "written", "written"])
        cell = self.browser.run("""
            const [cell, film] = [document.querySelector(".cell[aria-current]"),
                document.getElementById("film")].map((one) => one.getBoundingClientRect());
            return cell.left >= film.left && cell.right <= film.right;""")
        self.assertTrue(cell)
        # To another frame and back by the button.
        self.browser.keys(".")
        self.browser.wait(f"{SHOWN} && postchain.viewer.shown.frame === 3")
        self.assertTrue(self.browser.run("return document.getElementById('fault').hidden;"))
        self.click("#next-bad")
        self.assertEqual(self.state("frame"), 2)
        self.browser.errors()  # the damaged frame

    def test_search_is_the_services(self):
        for i in range(45):
            self.submit(output=f"out/many{i}.####.exr", frames="1", priority=-5)
        first = self.submit(input="broken/f.####.exr", output="out/needle.####.exr", frames="1",
                            priority=-50)
        for i in range(45, 90):
            self.submit(output=f"out/many{i}.####.exr", frames="1", priority=-5)
        try:
            self.open()
            self.browser.keys(("down", ALT), "2", ("up", ALT))
            self.browser.wait("document.querySelectorAll('#job-list .entry').length === 40")
            self.assertIsNone(self.browser.run(
                "return document.querySelector(`[data-job='${args[0]}']`);", first))
            # One of them has a place in the queue.
            self.assertRegex(self.text("#job-list .state.queued"), r"^queued, \d+(st|nd|rd|th)$")
            self.browser.run("document.getElementById('search').focus();")
            self.browser.keys(*"needle")
            self.browser.wait("document.querySelectorAll('#job-list .entry').length === 1")
            self.assertEqual(self.browser.run("return document.querySelector('#job-list .entry')"
                                              ".dataset.job;"), first)
            self.assertEqual(self.text("#job-list .name"), "broken/f")
            self.browser.keys(*" nowhere")
            self.browser.wait("document.getElementById('no-jobs').checkVisibility()")
            self.assertEqual(self.text("#no-jobs"), "No job matches.")
        finally:
            for job in json.loads(self.server.ask("GET", "/v1/jobs?limit=500&state=queued")[2])["jobs"]:
                self.server.ask("DELETE", f"/v1/jobs/{job['id']}")

    def test_requests_are_bounded(self):
        """One page that watches a job of 60 frames; the page before this one made 397 in 10 s."""
        for frame in range(1, 61):
            link = self.path / f"long/f.{frame:04}.exr"
            link.parent.mkdir(exist_ok=True)
            link.write_bytes((self.path / f"shots/sharp.000{1 + frame % 3}.exr").read_bytes())
        job = self.submit(input="long/f.####.exr", output="out/long.####.exr")
        self.open(f"job={job}")
        self.browser.run("performance.setResourceTimingBufferSize(2000);"
                         "performance.clearResourceTimings(); globalThis.begun = performance.now();")
        self.done(job)
        self.browser.run("await new Promise((done) => setTimeout(done, 3000));")
        names, seconds = self.browser.run(
            "return [performance.getEntriesByType('resource').map((one) => one.name), "
            "(performance.now() - begun) / 1000];")
        pictures = [name for name in names if ".png" in name]
        others = [name for name in names if ".png" not in name]
        # Cells in sight, each before and after; the viewer; the thumbnail of the list.
        self.assertLess(len(pictures), 50, pictures)
        # The list at most every 1.5 s, a frame's sidecar, the readiness.
        self.assertLess(len(others), 15 + 1.5 * seconds, (seconds, others))
        # A slider that moves for two seconds: a preview every 150 ms at most, and the last is shown.
        self.open_shot()
        self.browser.run("""
            performance.clearResourceTimings();
            globalThis.begun = performance.now();
            const input = document.querySelector(".slider input");
            for (let i = 0; i < 200; ++i) {
                input.value = i;
                input.dispatchEvent(new Event("input", {bubbles: true}));
                await new Promise((done) => setTimeout(done, 10));
            }""")
        self.browser.wait(f"{SHOWN} && !postchain.pictures.drafts", seconds=60)
        names, seconds = self.browser.run(
            "return [performance.getEntriesByType('resource').map((one) => one.name), "
            "(performance.now() - begun) / 1000];")
        previews = [name for name in names if name.endswith("v1/preview")]
        self.assertLess(len(previews), 3 + seconds / 0.15)
        self.assertGreater(len(previews), 1)
        self.browser.errors()  # previews that newer ones ended

    def test_cancel_retry_edit_duplicate_remove(self):
        job = self.submit(chain="best", output="out/best.####.exr", set=["joint_blur.samples=1023"])
        self.open(f"job={job}")
        self.press("Cancel")
        self.done(job, "canceled")
        self.press("Retry")
        self.browser.wait("['queued', 'running', 'done'].includes("
                          "document.querySelector('#job .title .state').innerText)")
        self.server.ask("DELETE", f"/v1/jobs/{job}")
        self.browser.wait("document.querySelector('#job .state.canceled, #job .state.done')", seconds=60)
        # The form, filled in.
        self.press("Duplicate\u2026")
        self.browser.wait("document.getElementById('new').open")
        values = self.browser.run("return [...document.querySelectorAll('#new input')]"
                                  ".map((one) => one.value);")
        self.assertIn("out/best.####.exr", values)
        self.browser.run("document.getElementById('new').close();")
        # Its chain and frames with live preview.
        self.press("Edit")
        self.browser.wait("!postchain.model.subject.job && "
                          f"postchain.model.subject.input === 'shots/sharp.####.exr' && {SHOWN}",
                          seconds=60)
        self.assertIn("128", json.dumps(self.chain()))
        # Also when its frame has been planned.
        self.browser.run("await postchain.model.sized; await new Promise((done) => setTimeout(done, 50));")
        self.assertEqual(self.browser.run("return document.getElementById('output').value;"),
                         "out/best.####.exr")
        # Its other keys count for previews, as far as they take them, and for the next job.
        self.assertEqual(self.browser.run("return postchain.model.subject.more;"), {
            "frames": None,
            "send": {"on_existing": "overwrite", "set": ["joint_blur.samples=1023"]},
            "show": {"set": ["joint_blur.samples=1023"]},
            "output": "out/best.####.exr"})
        self.browser.run("document.querySelector('#entries [data-path]').click();")
        self.browser.wait("!postchain.model.subject.more")
        self.browser.wait("document.getElementById('output').value.startsWith('shots/out/')")
        self.open(f"job={job}")
        self.press("Remove")
        self.browser.wait("!postchain.state.get('job')")
        self.assertEqual(self.server.ask("GET", f"/v1/jobs/{job}")[0], 404)
        self.browser.errors()

    def test_another_job_in_the_address(self):
        jobs = [self.submit(chain="fast", output=f"out/typed{i}.####.exr", frames="1") for i in (1, 2)]
        for job in jobs:
            self.open(f"job={job}")
            self.done(job)
        self.open()
        self.assertEqual(self.text("#missing"), "Choose frames on the left.")
        self.browser.run("location.hash = args[0];", f"job={jobs[0]}")
        self.browser.wait("postchain.model.subject?.job === args[0]", jobs[0])
        self.browser.run("postchain.open_job(args[0]); postchain.open_job(args[1]);", *jobs)
        self.browser.wait("postchain.model.subject?.job === args[0]", jobs[1])
        self.browser.wait("location.hash.startsWith(`#job=${args[0]}`)", jobs[1])
        self.browser.run("location.hash = args[0];", f"job={jobs[0]}")
        self.browser.wait("postchain.model.subject?.job === args[0]", jobs[0])

    def test_before_is_shown_where_the_chain_fails(self):
        self.open("shot=broken/f.%23%23%23%23.exr&frame=1")  # without a camera
        self.browser.wait("!document.getElementById('missing').hidden "
                          "&& document.getElementById('missing').textContent.includes('f_stop')")
        self.browser.run("postchain.show('before');")
        self.browser.wait(f"{SHOWN} && document.getElementById('missing').hidden")
        self.assertTrue(self.browser.run("return document.getElementById('wipe').hidden;"))
        self.assertEqual(self.browser.run("return postchain.model.width;"), 160)
        self.browser.errors()

    def test_report_in_place_streams_its_pictures(self):
        job = self.submit(kind="ab", chain_b="paper", frames="1", output="report")
        self.open(f"job={job}")
        self.done(job)
        self.browser.wait("document.querySelector('#report iframe')")
        self.assertEqual(self.browser.run("return document.querySelector('iframe').sandbox.value;"),
                         "allow-scripts allow-downloads")
        frame = self.browser.call("POST", "/element", {"using": "css selector", "value": "iframe"})
        self.browser.call("POST", "/frame", {"id": frame})
        try:
            self.browser.wait("document.querySelector('h1')?.innerText.includes('against')")
            self.browser.wait("globalThis.postchain?.viewer.shown?.image", seconds=30)
            self.assertEqual(self.browser.run(
                "return document.querySelectorAll('script[id^=image-]').length;"), 0)
            # It cannot reach the service.
            self.assertEqual(self.browser.run(
                "return await fetch('/v1/jobs').then(() => 'read', () => 'refused');"), "refused")
            self.assertEqual(self.browser.run("return window.origin;"), "null")
            # It is sent pictures of its own folder, and nothing else.
            self.assertEqual(self.browser.run("""
                return await new Promise((done) => {
                    addEventListener("message", ({data}) =>
                        data.postchain_picture === "image-0" && data.why && done(data.why));
                    for (const asset of ["../../../../jobs", "/v1/jobs", "https://example.org/x.js"])
                        parent.postMessage({postchain_wants: "image-0", asset}, "*");
                });"""), "its pictures are not in its folder")
        finally:
            self.browser.call("POST", "/frame", {"id": None})
        whole = (self.path / "report/index.html").stat().st_size
        page = len(self.server.ask("GET", f"/v1/jobs/{job}/report/index.html?pictures=apart")[2])
        self.assertLess(page, whole)
        # One that has them beside the page.
        job = self.submit(kind="ab", chain_b="paper", frames="1", output="light",
                          assets="light/pictures")
        self.open(f"job={job}")
        self.done(job)
        self.browser.wait("document.querySelector('#report iframe')")
        frame = self.browser.call("POST", "/element", {"using": "css selector", "value": "iframe"})
        self.browser.call("POST", "/frame", {"id": frame})
        try:
            self.browser.wait("globalThis.postchain?.viewer.shown?.image", seconds=30)
        finally:
            self.browser.call("POST", "/frame", {"id": None})
        self.browser.errors()  # of the fetch above

    def test_the_form_of_all_settings(self):
        self.open()
        self.press("New job \u2026")
        self.browser.wait("document.querySelector('#new input[name=kind]')")

        def write(label, value):
            self.browser.run("""
                const label = [...document.querySelectorAll("#new label")].find(
                    (one) => one.textContent.replace(" *", "") === args[0]);
                const input = document.getElementById(label.htmlFor);
                input.value = args[1];
                input.dispatchEvent(new Event("change", {bubbles: true}));""", label, value)
        write("Frames to read", "shots/sharp.####.exr")
        write("Frames to write", "/etc/a.exr")
        self.press("Submit")
        self.browser.wait("document.querySelector('#new .error')")
        self.assertIn("outside", self.text("#new [role=alert]"))
        self.assertEqual(self.browser.run("return [...document.querySelectorAll('.field.bad')]"
                                          ".map((f) => f.dataset.key);"), ["output"])
        write("Camera file", "shots/camera.json")
        # A plan would refuse the keys of outputs and of the queue.
        write("Frames to write", "out/planned.####.exr")
        write("Priority", "3")
        self.press("Plan only")
        self.browser.wait("document.querySelector('#new .card')")
        self.assertIn("joint_blur, then fxaa", self.text("#new .card"))
        self.press("Submit")
        self.browser.wait("document.querySelector('#job h2')")
        self.done("the job")
        self.browser.errors()  # the refusal itself

    def test_text_of_others_is_never_html(self):
        (self.path / f"{HOSTILE}.0001.exr").write_bytes(
            (self.path / "shots/sharp.0001.exr").read_bytes())
        status, _, answer = self.server.ask("POST", "/v1/jobs", {
            "chain_text": f"postchain: 1\n# {HOSTILE}\npasses: [fxaa]\n",
            "input": f"{HOSTILE}.####.exr", "output": "out/x.####.exr"})
        self.assertEqual(status, 202, answer)
        job = json.loads(answer)["id"]
        self.open(f"job={job}")
        self.browser.wait("document.querySelector('#job h2')?.innerText.includes('<img')")
        self.browser.wait("[...document.querySelectorAll('#job-list .name')].some((n) => "
                          "n.textContent.includes('<img'))")
        self.browser.run("document.getElementById('show-shots').click();")
        self.browser.wait("[...document.querySelectorAll('#entries .name')].some((n) => "
                          "n.textContent.includes('<img'))")
        self.assertFalse(self.browser.run("return !!document.querySelector('[hostile]');"))
        self.browser.errors()


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
            if os.environ.get("AXE_CORE"):
                self.browser.command("Runtime.evaluate", expression=pathlib.Path(
                    os.environ["AXE_CORE"]).read_text(encoding="utf8"))
                self.assertEqual(self.browser.run(
                    "return (await axe.run(document)).violations.map((one) => [one.id, "
                    "...one.nodes.map((n) => n.html.slice(0, 90))]);"), [], (where, scheme))
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
        self.browser.wait("document.querySelector('.left-out, #plan .help')", seconds=30)
        self.check("a shot")
        self.click("#settings")
        self.browser.wait("document.querySelector('#new form')")
        self.browser.run("for (const d of document.querySelectorAll('#new details')) d.open = true;")
        self.check("the form")
        self.browser.run("document.getElementById('new').close();"
                         "document.getElementById('help').showModal();")
        self.check("keys")
        job = self.submit(input="broken/f.####.exr", output="out/seen.####.exr")
        self.open(f"job={job}")
        self.done(job, "failed")
        self.browser.wait("document.querySelector('#fault.bad')", seconds=30)
        self.check("a job")
        self.browser.errors()

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
        wanted = ["skip", "new-job", "show-shots", "entry", "canvas", "wipe", "ev", "cell", "tab-a",
                  "load", "output", "submit"]
        at = [order.index(next(one for one in order if one.startswith(name))) for name in wanted]
        self.assertEqual(at, sorted(at), order)
        # A list is one stop.
        self.assertEqual(len([one for one in order if one.startswith("entry")]), 1)
        self.assertEqual(len([one for one in order if one.startswith("cell")]), 1)


class Login(OnTheService):
    def test_login(self):
        server = Server([PROGRAM, "serve", "--root", str(self.path), "--store",
                         str(self.path / "other.sqlite"), "--port", "0", "--device", "software",
                         "--token-file", str(self.path / "token")])

        def write(value):
            self.browser.run("document.getElementById('token').value = args[0];", value)
        try:
            self.browser.open(f"http://127.0.0.1:{server.port}/#{SHOT}&frame=2")
            self.browser.wait("!document.getElementById('login').hidden")
            write("wrong" * 4)
            self.press("Log in")
            self.browser.wait("document.querySelector('#login .error').innerText")
            self.assertEqual(self.text("#login .error"), "This is not the token.")
            write(TOKEN)
            self.press("Log in")
            # The link is followed now, pictures too.
            self.browser.wait(f"{SHOWN} && postchain.viewer.shown.frame === 2", seconds=60)
            self.browser.wait("document.querySelector('.cell img')?.naturalWidth === 160")
            self.browser.wait("document.getElementById('status').innerText.startsWith('ready')")
            self.assertEqual(self.browser.run("return document.cookie;"), "")
            self.press("Log out")
            self.browser.wait("!document.getElementById('login').hidden")
            self.browser.errors()  # the refusals
        finally:
            self.assertEqual(server.stop(), 143)


if __name__ == "__main__":
    PROGRAM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
