"""The page in headless Chromium, on the real service: jobs, form, editor, report, login.

usage: page_test.py POSTCHAIN"""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "page"))
from browser import Browser  # noqa: E402
from server import Server  # noqa: E402

PROGRAM = None
TOKEN = "0123456789abcdef"
HOSTILE = "<img hostile src onerror>"


class Page(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = pathlib.Path(cls.folder.name)
        subprocess.run([PROGRAM, "scene", "wheels", "-o", str(cls.path / "shots"), "--frames", "1-3",
                        "--size", "160x90", "--device", "software", "-q"], check=True)
        (cls.path / "out").mkdir()
        (cls.path / "token").write_text(TOKEN + "\n")
        cls.server = Server([PROGRAM, "serve", "--root", str(cls.path), "--store",
                             str(cls.path / "jobs.sqlite"), "--port", "0", "--device", "software"])
        cls.base = f"http://127.0.0.1:{cls.server.port}/"
        cls.browser = Browser([])
        cls.browser.size(1280, 900)

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()
        assert cls.server.stop() == 143
        cls.folder.cleanup()

    def type(self, label, value):
        self.browser.run("""
            const label = [...document.querySelectorAll("label")].find(
                (one) => one.textContent.replace(" *", "") === args[0] && one.offsetParent);
            const input = document.getElementById(label.htmlFor);
            input.value = args[1];
            input.dispatchEvent(new Event("input", {bubbles: true}));
            input.dispatchEvent(new Event("change", {bubbles: true}));""", label, value)

    def press(self, text):
        self.browser.wait("[...document.querySelectorAll('button')].some((b) => "
                          "b.textContent === args[0] && b.offsetParent && !b.disabled)", text)
        self.browser.run("[...document.querySelectorAll('button')].find((b) => "
                         "b.textContent === args[0] && b.offsetParent).click();", text)

    def text(self, selector):
        return self.browser.run("return document.querySelector(args[0])?.innerText ?? null;", selector)

    def submit(self, kind="run", **fields):
        self.browser.open(self.base + "#new")
        self.browser.wait("document.querySelector(\"#new input[name=kind]\")")
        self.browser.run("document.querySelector(`input[value=${args[0]}]`).click();", kind)
        for label, value in fields.items():
            self.type(label.replace("_", " "), value)
        self.press("Submit")

    def test_a_job_from_the_form_to_its_pictures(self):
        self.submit(Frames_to_read="shots/sharp.####.exr", Camera_file="shots/camera.json",
                    Frames_to_write="out/form.####.exr", Which_frames="1-2")
        self.browser.wait("document.querySelector('#job .title .state.done')", seconds=60)
        self.assertIn("2 of 2 frames", self.text("#job .progress-line"))
        self.browser.wait("document.querySelectorAll('.pair img').length === 2 && "
                          "[...document.querySelectorAll('.pair img')].every((i) => i.naturalWidth)")
        self.assertIn("joint_blur", self.text("#job table"))
        # The other frame, by keyboard.
        self.browser.run("document.querySelector('[data-frame=\"2\"]').focus();")
        self.browser.keys(" ")
        self.browser.wait("document.querySelector('figcaption').innerText === 'Frame 2, before'")
        self.assertEqual(self.browser.errors(), [])

    def test_faults_are_shown_at_their_fields(self):
        self.submit(Frames_to_read="shots/sharp.####.exr", Frames_to_write="/etc/a.exr")
        self.browser.wait("document.querySelector('#new .error')")
        self.assertIn("outside", self.text("#new [role=alert]"))
        self.assertEqual(self.browser.run("return [...document.querySelectorAll('.field.bad')]"
                                          ".map((f) => f.dataset.key);"), ["output"])
        self.browser.errors()  # the refusal itself

    def test_plan_says_what_is_left_out(self):
        self.browser.open(self.base + "#new")
        self.browser.wait("document.querySelector(\"#new input[name=kind]\")")
        self.type("Frames to read", "shots/sharp.####.exr")
        self.type("Camera file", "shots/camera.json")
        # A plan would refuse the keys of outputs and of the queue.
        self.type("Frames to write", "out/planned.####.exr")
        self.type("Priority", "3")
        self.press("Plan only")
        self.browser.wait("document.querySelector('#new .card')")
        self.assertIn("joint_blur, then fxaa", self.text("#new .card"))

    def test_text_of_others_is_never_html(self):
        (self.path / f"{HOSTILE}.0001.exr").write_bytes(
            (self.path / "shots/sharp.0001.exr").read_bytes())
        status, _, answer = self.server.ask("POST", "/v1/jobs", {
            "chain_text": f"postchain: 1\n# {HOSTILE}\npasses: [fxaa]\n",
            "input": f"{HOSTILE}.####.exr", "output": "out/x.####.exr"})
        self.assertEqual(status, 202, answer)
        self.browser.open(self.base + "#jobs")
        self.browser.wait("[...document.querySelectorAll('#job-list .name')].some((n) => "
                          "n.innerText.includes('<img'))")
        self.browser.run("[...document.querySelectorAll('#job-list a')].find((n) => "
                         "n.innerText.includes('<img')).click();")
        self.browser.wait("document.querySelector('#job h2')?.innerText.includes('<img')")
        self.browser.open(self.base + "#chain")
        self.browser.wait("document.querySelector('#chain textarea')")
        self.edit(f'{{"postchain": 1, "passes": [{{"{HOSTILE[:20]}": {{}}}}]}}')
        self.browser.wait("document.querySelector('.diagnostics .error')?.innerText.includes('<img')")
        self.assertFalse(self.browser.run("return !!document.querySelector('[hostile]');"))
        self.assertEqual(self.browser.errors(), [])

    def edit(self, text):
        self.browser.run("""
            const area = document.querySelector("#chain textarea");
            area.value = args[0];
            area.dispatchEvent(new Event("input", {bubbles: true}));""", text)

    def test_editor(self):
        self.browser.open(self.base + "#chain")
        self.browser.wait("document.querySelector('#chain textarea')")
        self.edit('{"postchain": 1, "passes": [{"joint_blur": {}}, {"fxaa": {}}]}')
        self.browser.run("for (const d of document.querySelectorAll('#chain details')) d.open = false;"
                         "document.querySelector('.pass details').open = true;")
        self.type("samples", "5000")
        self.browser.wait("document.querySelector('.diagnostics .error')")
        message = self.text(".diagnostics .error")
        line = int(self.text(".gutter .error-line"))
        text = self.browser.run("return document.querySelector('#chain textarea').value;")
        self.assertIn('"samples": 5000', text.split("\n")[line - 1])
        self.assertTrue(message.startswith(f"line {line}: passes[0].samples: 5000"), message)
        # A click on the message goes to its place.
        self.browser.run("document.querySelector('.diagnostics .error').click();")
        chosen = self.browser.run("const t = document.activeElement; return t.value.slice(0, "
                                  "t.selectionStart).split('\\n').length;")
        self.assertEqual(chosen, line)
        self.type("samples", "9")
        self.type("Frames", "shots/sharp.####.exr")
        self.type("Camera file", "shots/camera.json")
        self.browser.wait("document.querySelector('#chain .picture img')?.naturalWidth === 80",
                          seconds=60)
        # YAML text has no forms but is checked too.
        self.edit("postchain: 1\npasses:\n  - fxaa: {preset: 99}\n")
        self.browser.wait("document.querySelector('.gutter .error-line')?.innerText === '3'")
        self.browser.run("localStorage.clear();")

    def test_report_in_place(self):
        self.submit("ab", Frames_to_read="shots/sharp.####.exr", Camera_file="shots/camera.json",
                    Frames_to_write="report", Which_frames="1")
        self.browser.wait("document.querySelector('#job .title .state.done')", seconds=90)
        self.press("Open report")
        self.browser.wait("document.querySelector('#job iframe')")
        self.assertEqual(self.browser.run("return document.querySelector('iframe').sandbox.value;"),
                         "allow-scripts allow-downloads")
        self.browser.run("document.querySelector('iframe').scrollIntoView();")
        frame = self.browser.call("POST", "/element", {"using": "css selector", "value": "iframe"})
        self.browser.call("POST", "/frame", {"id": frame})
        try:
            self.browser.wait("document.querySelector('h1')?.innerText.includes('against')")
            # It cannot reach the service.
            self.assertEqual(self.browser.run(
                "return await fetch('/v1/jobs').then(() => 'read', () => 'refused');"), "refused")
            self.assertEqual(self.browser.run("return window.origin;"), "null")
        finally:
            self.browser.call("POST", "/frame", {"id": None})
        self.browser.errors()  # of the fetch above

    def test_cancel_and_retry(self):
        self.server.ask("POST", "/v1/jobs", {
            "chain": "best", "input": "shots/sharp.####.exr", "camera": "shots/camera.json",
            "output": "out/best.####.exr", "set": ["joint_blur.samples=1023"]})
        self.browser.open(self.base + "#jobs")
        self.press("Cancel")
        self.browser.wait("document.querySelector('#job .title .state.canceled')", seconds=60)
        self.press("Retry")
        self.browser.wait("['queued', 'running', 'done'].includes("
                          "document.querySelector('#job .title .state').innerText)")

    def test_narrow_and_wide_nothing_is_cut_off(self):
        for view in ("jobs", "new", "chain"):
            for width in (360, 700, 1280, 2200):
                self.browser.size(width, 800)
                self.browser.open(self.base + "#" + view)
                self.browser.wait("!document.getElementById(args[0]).hidden", view)
                self.assertLessEqual(self.browser.run(
                    "return document.documentElement.scrollWidth - innerWidth;"), 0, (view, width))
        self.browser.size(1280, 900)

    def test_every_field_has_a_label(self):
        for view in ("jobs", "new", "chain"):
            self.browser.open(self.base + "#" + view)
            self.browser.wait("!document.getElementById(args[0]).hidden", view)
            self.browser.run("await new Promise((r) => setTimeout(r, 500));")
            without = self.browser.run("""
                return [...document.querySelectorAll("input, select, textarea")].filter((one) =>
                    !one.labels?.length && !one.getAttribute("aria-label")).map((o) => o.outerHTML);""")
            self.assertEqual(without, [])

    def test_login(self):
        server = Server([PROGRAM, "serve", "--root", str(self.path), "--store",
                         str(self.path / "other.sqlite"), "--port", "0", "--device", "software",
                         "--token-file", str(self.path / "token")])
        try:
            self.browser.open(f"http://127.0.0.1:{server.port}/")
            self.browser.wait("!document.getElementById('login').hidden")
            self.type("Token", "wrong" * 4)
            self.press("Log in")
            self.browser.wait("document.querySelector('#login .error').innerText")
            self.assertEqual(self.text("#login .error"), "This is not the token.")
            self.type("Token", TOKEN)
            self.press("Log in")
            self.browser.wait("!document.getElementById('jobs').hidden")
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
