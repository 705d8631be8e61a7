"""An ordinary day on the page in headless Chromium, on the real service: the same shot sent twice, Back,
a restart, several jobs at once, a phone.

usage: page_day_test.py POSTCHAIN"""
from service_page import OnTheService, PROGRAM, SHOT, SHOWN, run
from server import Server, serve_command

YAML = """# Soft, for the night shots.
postchain: 1
passes:
  - joint_blur: {samples: 9, seed: 3}
  - fxaa
"""


class Day(OnTheService):
    def test_the_loop_twice(self):
        """From the folders to a job and back to the chain, and all of it once more."""
        self.open_from_the_folders()
        self.press("Submit job")
        self.wait_for()
        first = (self.path / "shots/out/sharp_balanced.0002.exr").stat().st_mtime_ns
        # The same again: refused before it is queued, with what can be done.
        self.open_from_the_folders()
        jobs = len(self.server.get("/v1/jobs")["jobs"])
        self.press("Submit job")
        self.browser.wait("document.getElementById('send-error').textContent")
        self.assertIn("3 of 3 frames have outputs already", self.text("#send-error"))
        self.assertEqual(len(self.server.get("/v1/jobs")["jobs"]), jobs)
        self.press("Write sharp_balanced_v002.####.exr")
        self.wait_for()
        self.assertTrue((self.path / "shots/out/sharp_balanced_v002.0003.exr").exists())
        self.assertEqual((self.path / "shots/out/sharp_balanced.0002.exr").stat().st_mtime_ns, first)
        # A job with another chain gets a version of its own.
        self.press("Preview")
        self.browser.wait("document.getElementById('output').value === 'shots/out/sharp_balanced_v003.####.exr'")
        self.browser.wait(SHOWN)
        self.choose("paper")
        self.press("Submit job")
        self.wait_for()
        self.assertTrue((self.path / "shots/out/sharp_balanced_v003.0003.exr").exists())
        # Replaced, if that is wanted.
        self.open_from_the_folders()
        self.press("Submit job")
        self.press("Replace")
        self.wait_for()
        self.assertNotEqual((self.path / "shots/out/sharp_balanced.0002.exr").stat().st_mtime_ns, first)

    def test_the_next_version_is_above_all_jobs(self):
        """Also above those that a list of jobs has on its second page."""
        out = self.path / "shots/out"
        out.mkdir(exist_ok=True)
        for frame in (1, 2, 3):
            (out / f"sharp_balanced.{frame:04}.exr").touch()
        self.open_from_the_folders()
        self.browser.run("""
            const real = window.fetch, output = "shots/out/sharp_balanced_v006.####.exr";
            window.fetch = (path, options) => !/jobs[?].*search=/.test(path) ? real(path, options)
                : Promise.resolve(new Response(JSON.stringify(/before=7&/.test(path)
                    ? { jobs: [{ about: { output } }], next: null } : { jobs: [], next: "7" })));""")
        self.press("Submit job")
        self.browser.wait("document.getElementById('existing').textContent.includes('_v007')")

    def test_back(self):
        job = self.submit(output="out/back.####.exr")
        self.server.ended(job)
        self.open_from_the_folders()
        self.browser.wait("location.hash.includes('shot=')")
        self.browser.run("postchain.open_job(args[0]);", job)
        self.browser.wait("postchain.model.subject?.job === args[0] && location.hash.includes(`job=${args[0]}`)", job)
        # A frame and an exposure are no places of their own.
        self.browser.keys(".", "]")
        self.browser.wait("location.hash.includes('ev=0.5')")
        self.browser.call("POST", "/back", {})
        self.browser.wait("postchain.model.subject && !postchain.model.subject.job && "
                          f"postchain.model.subject.input === 'shots/sharp.####.exr' && {SHOWN}")
        self.assertTrue(self.is_hidden("job"))
        self.browser.call("POST", "/back", {})
        self.browser.wait("!postchain.model.subject")
        self.wait_for_text("#missing", "Choose frames on the left.")
        self.browser.call("POST", "/forward", {})
        self.browser.wait("postchain.model.subject?.input === 'shots/sharp.####.exr'")
        self.browser.call("POST", "/forward", {})
        self.browser.wait("postchain.model.subject?.job === args[0]", job)
        # A link to the frames that the job has read.
        self.browser.run("location.hash = args[0];", SHOT)
        self.browser.wait("postchain.model.subject?.input === 'shots/sharp.####.exr' && "
                          "!postchain.model.subject.job")
        self.assertEqual(self.browser.errors(), [])

    def test_a_restart(self):
        command = serve_command(PROGRAM, self.path, store="restarted.sqlite")
        server = Server(command)
        command[command.index("--port") + 1] = str(server.port)
        try:
            self.browser.open(f"http://127.0.0.1:{server.port}/#{SHOT}")
            self.browser.wait(f"globalThis.postchain?.viewer && {SHOWN}")
            self.assertEqual(server.stop(), 143)
            self.browser.wait("document.getElementById('status').innerText.startsWith('connection lost')")
            self.browser.run("postchain.state.set({frame: 3});")
            self.wait_for_text("#missing", "The service does not answer.")
            server = Server(command)
            self.browser.wait(f"{SHOWN} && postchain.viewer.shown.frame === 3 && "
                              "document.getElementById('missing').hidden")
            self.browser.wait("[...document.querySelectorAll('.cell img')].every((one) => one.naturalWidth)")
            self.assertTrue(self.is_hidden("failure-box"))
        finally:
            self.browser.open("about:blank")  # it would ask for events again
            server.stop()

    def test_an_older_copy_of_the_store(self):
        """Its page shows the jobs of the copy, and goes on with new ones."""
        command = serve_command(PROGRAM, self.path, store="copied.sqlite")
        job = {"input": "shots/sharp.####.exr", "camera": "shots/camera.json", "chain": "paper",
               "on_existing": "overwrite", "frames": "1", "output": "out/copied.####.exr"}
        store = self.path / "copied.sqlite"
        server = Server(command)
        command[command.index("--port") + 1] = str(server.port)
        try:
            server.ended(server.submit(job))
            self.assertEqual(server.stop(), 143)
            copy = store.read_bytes()
            server = Server(command)
            self.browser.open(f"http://127.0.0.1:{server.port}/")
            self.browser.wait("globalThis.postchain?.viewer")
            lost = [server.submit(job) for _ in range(3)][-1]
            self.browser.wait("document.querySelector(`[data-job='${args[0]}'] .state.done`)", lost)
            self.assertEqual(server.stop(), 143)
            store.write_bytes(copy)
            server = Server(command)
            self.browser.wait("!document.querySelector(`[data-job='${args[0]}']`)", lost)
            new = server.submit(job)
            self.browser.wait("document.querySelector(`[data-job='${args[0]}'] .state.done`)", new)
        finally:
            self.browser.open("about:blank")
            server.stop()

    def test_a_canceled_job_waits_for_nothing(self):
        ids = [self.submit(chain="best", input=self.long_shot(), set=["joint_blur.samples=1023"],
                           output=f"out/many{i}.####.exr") for i in range(5)]
        self.addCleanup(lambda: [self.server.ask("DELETE", f"/v1/jobs/{one}") for one in ids])
        self.open()
        self.click("#show-jobs")
        self.browser.wait("document.querySelectorAll('#job-list .entry').length >= 5")
        rows = self.browser.run("return [...document.querySelectorAll('#job-list .output')]"
                                ".map((one) => one.innerText);")
        self.assertEqual(rows[:5], [f"\u2192 out/many{i}.####.exr" for i in (4, 3, 2, 1, 0)])
        for one in ids:
            self.server.ask("DELETE", f"/v1/jobs/{one}")
        self.open_job(ids[0], "canceled")
        self.browser.wait("document.querySelector('.cell .state')")
        self.assertNotIn("waiting", self.browser.run("return document.getElementById('film').innerText;"))
        self.browser.run("postchain.state.set({frame: 60});")
        self.browser.wait("document.getElementById('fault').innerText === "
                          "'Frame 60 was not filtered: the job is canceled.'")
        self.assertEqual(self.browser.errors(), [])

    def test_the_form_of_a_report(self):
        self.open()
        self.press("New job \u2026")
        self.browser.wait("document.querySelector('#new input[name=kind]')")
        field = "document.querySelector('#new [data-key=output]')"

        def of(kind):
            self.browser.run("document.querySelector(`#new input[value=${args[0]}]`).click();", kind)
            return self.browser.run(f"return [{field}.querySelector('label').innerText.replace(' *', ''), "
                                    f"{field}.querySelector('input').value];")
        self.browser.run(f"const input = {field}.querySelector('input'); input.value = 'out/a.####.exr';"
                         "input.dispatchEvent(new Event('change', {bubbles: true}));")
        for kind in ("ab", "bench", "study"):
            self.assertEqual(of(kind), ["Folder of the report", ""])
        self.assertEqual(of("run"), ["Frames to write", "out/a.####.exr"])
        # A report that exists.
        body = {"kind": "ab", "chain": "fast", "chain_b": "paper", "input": "shots/sharp.####.exr",
                "camera": "shots/camera.json", "frames": "1", "output": "out/report"}
        self.server.ended(self.server.submit(body))
        self.browser.run("document.getElementById('new').close(); postchain.new_job(args[0]);", body)
        self.press("Submit")
        self.press("Write report_v002")
        self.wait_for()
        self.assertTrue((self.path / "out/report_v002/index.html").exists())
        # Without ground truth there is a difference, and no error.
        with self.browser.inside("#report iframe"):
            self.browser.wait("globalThis.postchain?.viewer.shown?.image")
            words = self.browser.run("return document.body.innerText + document.getElementById('keys')"
                                     ".textContent;")
        self.assertNotRegex(words, "(?i)error")
        self.assertIn("Difference map", words)

    def test_the_errors_of_a_chain_are_its_own(self):
        (self.path / "shots/faulty.yaml").write_text("postchain: 1\npasses:\n  - fxaa: {preset: 99}\n")
        self.open_from_the_folders()
        self.press("Compare with B")
        self.browser.wait("postchain.viewer.shown?.source.key === 'b'")
        self.click("#tab-a")
        self.choose("shots/faulty.yaml")
        self.browser.run("for (const d of document.querySelectorAll('#chain details')) d.open = true;")
        fault = "document.querySelector('#diagnostics .error')"
        self.browser.wait(f"{fault} && document.getElementById('plan-error').textContent.includes('99')")
        self.assertRegex(self.text("#diagnostics"), r"^line 3: passes\[0\]\.preset: 99 ")
        self.assertEqual(self.text("#text .error").strip(), "- fxaa: {preset: 99}")
        self.click("#tab-b")
        self.browser.wait("document.querySelector('#plan p')")
        self.assertEqual([self.text("#plan-error"), self.text("#diagnostics"), self.text("#text .error")],
                         ["", "", None])
        self.browser.wait(f"{SHOWN} && postchain.viewer.shown.source.key === 'b'")
        self.click("#tab-a")
        self.browser.wait(fault)

    def chosen(self):
        return self.browser.run("return [document.getElementById('load').value, "
                                "document.getElementById('text').textContent];")

    def test_a_chain_is_its_file(self):
        (self.path / "shots/night.yaml").write_text(YAML)
        self.open_from_the_folders()
        name, text = self.chosen()
        self.assertEqual(name, "balanced")
        self.assertIn("- joint_blur: {samples: 28, starts: 6}", text)
        self.browser.run("[...document.querySelectorAll('#entries .entry')].find((one) => "
                         "one.innerText.includes('night')).click();")
        self.browser.wait("document.getElementById('text').textContent === args[0]", YAML)
        self.assertEqual(self.browser.run("return document.getElementById('output').value;"),
                         "shots/out/sharp_night.####.exr")
        before = self.values("a")
        # Edited elsewhere: read again by who comes back to the page, and by who loads it again.
        edited = YAML.replace("seed: 3", "shutter_frames: 2")
        (self.path / "shots/night.yaml").write_text(edited)
        self.browser.run("dispatchEvent(new Event('focus'));")
        self.values("a", before)
        self.assertEqual(self.chosen(), ["shots/night.yaml", edited])
        (self.path / "shots/night.yaml").write_text(YAML)
        self.open(SHOT)
        self.assertEqual(self.chosen(), ["shots/night.yaml", YAML])
        # One that is gone stays as it was.
        (self.path / "shots/night.yaml").unlink()
        self.open(SHOT)
        self.assertEqual(self.chosen(), ["shots/night.yaml", YAML])
        self.browser.run("localStorage.clear();")
        self.browser.errors()  # it was not found

    def test_the_chain_of_a_job(self):
        passes = [{"joint_blur": {"samples": 9}}, "fxaa"]
        for key, chain, text in (
                ("chain_text", YAML, YAML), ("chain", {"postchain": 1, "passes": passes},
                                             "postchain: 1\npasses:\n  - joint_blur: {samples: 9}\n  - fxaa\n")):
            job = self.server.submit({key: chain, "input": "shots/sharp.####.exr", "frames": "1",
                                      "camera": "shots/camera.json", "output": f"out/of_{key}.####.exr"})
            self.open_job(job)
            if key == "chain_text":  # shown as it was sent
                self.assertIn(YAML, self.browser.run("return [...document.querySelectorAll('#job pre')]"
                                                     ".map((one) => one.textContent);"))
            self.press("Preview")
            self.browser.wait(f"{SHOWN} && postchain.viewer.shown.source.name === `A job ${{args[0]}}`", job)
            self.assertEqual(self.chosen(), [f"job {job}", text])
        self.assertEqual(self.browser.errors(), [])

    def test_chains_that_were_kept(self):
        """By the page before this one too, which edited values."""
        own = {"name": "job 7", "text": YAML, "value": None}
        edited = {"name": "balanced", "text": YAML, "value": {"postchain": 1, "passes": []}}
        for kept, names in (({"compared": True, "active": "a", "a": edited, "b": own}, ["A balanced", "B job 7"]),
                            ({"a": {"name": "gone", "value": {}}, "b": 5, "active": "b"}, ["A balanced"]),
                            (None, ["A balanced"]), (5, ["A balanced"])):
            self.open()
            self.browser.run("localStorage.setItem('postchain-chains', JSON.stringify(args[0]));", kept)
            self.open(SHOT)
            self.browser.wait(SHOWN)
            self.assertEqual(self.browser.run("return postchain.model.sources.map((one) => one.name);"),
                             ["Before", *names])
            name, text = self.chosen()
            self.assertEqual(name, "balanced")
            self.assertIn("starts: 6", text)
        self.assertEqual(self.browser.errors(), [])

    def test_on_a_phone_the_picture_stays(self):
        self.browser.size(390, 844)
        self.open_shot()
        box = self.browser.run("""
            const button = document.getElementById("submit");
            button.scrollIntoView({block: "end"});
            await new Promise((done) => requestAnimationFrame(done));
            const [a, b] = [document.querySelector(".canvas-box"), button].map(
                (one) => one.getBoundingClientRect());
            return {top: a.top, height: a.height, below: b.bottom, scrolled: scrollY};""")
        self.assertEqual(box["top"], 0)
        self.assertGreater(box["height"], 200)
        self.assertGreater(box["below"], box["height"])
        self.assertGreater(box["scrolled"], 300)

    def test_tone_curves_have_names(self):
        self.open_shot()
        names = self.browser.run("return [...document.getElementById('tone').options]"
                                 ".map((one) => one.text);")
        self.assertEqual(names, ["Soft (Reinhard)", "Filmic (ACES)", "None (sRGB)"])


if __name__ == "__main__":
    run()
