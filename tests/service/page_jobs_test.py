"""Jobs on the page in headless Chromium, on the real service, with their reports and the form.

usage: page_jobs_test.py POSTCHAIN"""
from service_page import ALT, OnTheService, SHOWN, run

HOSTILE = "<img hostile src onerror>\u202e\x1b[31m"


class Jobs(OnTheService):
    def test_a_failed_frame_is_in_view(self):
        self.open_job(self.submit(input="broken/f.####.exr", output="out/bad.####.exr"), "failed")
        self.browser.wait("document.querySelector('#fault.bad')?.checkVisibility()")
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
        self.assertTrue(self.is_hidden("fault"))
        self.click("#next-bad")
        self.assertEqual(self.state("frame"), 2)

    def test_search_is_the_services(self):
        first = self.submit(input="broken/f.####.exr", output="out/needle.####.exr", frames="1",
                            priority=-50)
        for i in range(90):
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
            self.assertEqual(self.text("#job-list .name"), "broken/f")
            self.browser.keys(*" nowhere")
            self.browser.wait("document.getElementById('no-jobs').checkVisibility()")
            self.assertEqual(self.text("#no-jobs"), "No job matches.")
        finally:
            for job in self.server.get("/v1/jobs?limit=500&state=queued")["jobs"]:
                self.server.ask("DELETE", f"/v1/jobs/{job['id']}")

    def requests(self):
        """Their addresses, and the seconds in which they were sent."""
        return self.browser.run(
            "return [performance.getEntriesByType('resource').map((one) => one.name), "
            "(performance.now() - begun) / 1000];")

    def test_requests_are_bounded(self):
        """One page that watches a job of 60 frames; the page before this one made 397 in 10 s."""
        job = self.submit(input=self.long_shot(), output="out/long.####.exr")
        self.open(f"job={job}")
        self.browser.run("performance.setResourceTimingBufferSize(2000);"
                         "performance.clearResourceTimings(); globalThis.begun = performance.now();")
        self.wait_for()
        # And three seconds of a page that has nothing to wait for.
        self.browser.run("setTimeout(() => { globalThis.rested = true; }, 3000);")
        self.browser.wait("globalThis.rested")
        names, seconds = self.requests()
        pictures = sum(".png" in name for name in names)
        # Cells in sight, each before and after; the viewer; the thumbnail of the list.
        self.assertLess(pictures, 50, names)
        # The list at most every 1.5 s, a frame's sidecar, the readiness.
        self.assertLess(len(names) - pictures, 15 + 1.5 * seconds, (seconds, names))
        # 60 frames within two seconds: a preview every 150 ms at most, and the last is shown.
        self.press("Preview")
        self.browser.wait(f"{SHOWN} && !postchain.model.subject.job")
        self.browser.run("""
            performance.clearResourceTimings();
            globalThis.begun = performance.now();
            const input = document.getElementById("frame");
            const move = (i) => {
                input.value = i;
                input.dispatchEvent(new Event("input", {bubbles: true}));
                if (i < 59) setTimeout(move, 30, i + 1);
                else globalThis.moved = true;
            };
            move(0);""")
        self.browser.wait("globalThis.moved")
        names, seconds = self.requests()
        previews = sum(name.endswith("v1/preview") for name in names)
        self.assertTrue(1 < previews < 3 + seconds / 0.15, (previews, seconds))
        self.browser.wait(f"{SHOWN} && postchain.viewer.shown.frame === 60")

    def test_cancel_retry_preview_duplicate_remove(self):
        # Canceled long before it is done.
        job = self.submit(chain="best", input=self.long_shot(), output="out/best.####.exr",
                          set=["joint_blur.samples=1023"])
        self.open(f"job={job}")
        self.press("Cancel")
        self.wait_for("canceled")
        self.press("Retry")
        self.browser.wait("document.querySelector('#job .title .state').innerText !== 'canceled'")
        self.server.ask("DELETE", f"/v1/jobs/{job}")
        self.browser.wait("document.querySelector('#job .state.canceled, #job .state.done')")
        # The form, filled in.
        self.press("Duplicate\u2026")
        self.browser.wait("document.getElementById('new').open")
        values = self.browser.run("return [...document.querySelectorAll('#new input')]"
                                  ".map((one) => one.value);")
        self.assertIn("out/best.####.exr", values)
        self.browser.run("document.getElementById('new').close();")
        # Its chain and frames with live preview.
        self.press("Preview")
        self.browser.wait("!postchain.model.subject.job && "
                          f"postchain.model.subject.input === 'long/f.####.exr' && {SHOWN}")
        self.assertEqual(self.browser.run("return document.getElementById('load').value;"), "best")
        # Also when its frame has been planned.
        self.browser.run("await postchain.model.sized;")
        self.browser.wait("document.getElementById('output').value === 'out/best_v002.####.exr'")
        # Its other keys count for previews, as far as they take them, and for the next job.
        values = ["joint_blur.samples=1023"]
        self.assertEqual(self.browser.run("return postchain.model.subject.more;"), {
            "frames": None, "send": {"on_existing": "overwrite", "set": values},
            "show": {"set": values}, "output": "out/best_v002.####.exr"})
        self.browser.run("document.querySelector('#entries [data-path]').click();")
        self.browser.wait("!postchain.model.subject.more")
        self.browser.wait("document.getElementById('output').value.startsWith('long/out/')")
        self.open(f"job={job}")
        self.press("Remove")
        self.browser.wait("!postchain.state.get('job')")
        self.assertEqual(self.server.ask("GET", f"/v1/jobs/{job}")[0], 404)

    def test_another_job_in_the_address(self):
        jobs = [self.submit(chain="fast", output=f"out/typed{i}.####.exr", frames="1") for i in (1, 2)]
        for job in jobs:
            self.server.ended(job)
        self.open()
        self.wait_for_text("#missing", "Choose frames on the left.")
        self.browser.run("location.hash = args[0];", f"job={jobs[0]}")
        self.browser.wait("postchain.model.subject?.job === args[0]", jobs[0])
        self.browser.run("postchain.open_job(args[0]); postchain.open_job(args[1]);", *jobs)
        self.browser.wait("postchain.model.subject?.job === args[0]", jobs[1])
        self.browser.wait("location.hash.startsWith(`#job=${args[0]}`)", jobs[1])
        # An unknown one is said, until something else is opened.
        failure = "document.getElementById('failure-box').checkVisibility()"
        self.browser.run("location.hash = 'job=none';")
        self.browser.wait(failure)
        self.assertEqual(self.text("#failure"), "There is no job none.")
        self.browser.run("location.hash = args[0];", f"job={jobs[0]}")
        self.browser.wait(f"postchain.model.subject?.job === args[0] && !{failure}", jobs[0])

    def test_before_is_shown_where_the_chain_fails(self):
        self.open("shot=broken/f.%23%23%23%23.exr&frame=1")  # without a camera
        self.browser.wait("!document.getElementById('missing').hidden "
                          "&& document.getElementById('missing').textContent.includes('f_stop')")
        self.browser.run("postchain.show('before');")
        self.browser.wait(f"{SHOWN} && document.getElementById('missing').hidden")
        self.assertTrue(self.is_hidden("wipe"))
        self.assertEqual(self.browser.run("return postchain.model.width;"), 160)

    def wait_for_streamed_pictures(self):
        self.browser.wait("globalThis.postchain?.viewer.shown?.image")
        self.assertFalse(self.browser.run("return !!document.querySelector('script[id^=image-]');"))

    def test_report_in_place_streams_its_pictures(self):
        job = self.submit(kind="ab", chain_b="paper", frames="1", output="report")
        self.open_job(job)
        self.browser.wait("document.querySelector('#report iframe')")
        self.assertEqual(self.browser.run("return document.querySelector('iframe').sandbox.value;"),
                         "allow-scripts allow-downloads")
        with self.browser.inside("#report iframe"):
            self.browser.wait("document.querySelector('h1')?.innerText.includes('against')")
            self.wait_for_streamed_pictures()
            # It cannot reach the service.
            self.assertEqual(self.browser.run(
                "return await fetch('/v1/jobs').then(() => 'read', () => 'refused');"), "refused")
            self.assertEqual(self.browser.run("return window.origin;"), "null")
            # It is sent pictures of its own folder, and nothing else.
            self.browser.run("""
                globalThis.why = {};
                addEventListener("message", ({data}) => { why[data.postchain_picture] ??= data.why; });
                const assets = ["../../../../jobs", "/v1/jobs", "https://example.org/x.js",
                                "%2e%2e/%2e%2e/%2E%2E/jobs", "pictures/%2e%2e/x", "a%2fb"];
                assets.forEach((asset, i) => parent.postMessage(
                    {postchain_wants: `image-${i}`, asset, page: location.pathname}, "*"));
                parent.postMessage({postchain_wants: "image-9", page: "/v1/jobs"}, "*");""")
            for i in range(6):
                self.assertEqual(self.browser.wait("why[args[0]]", f"image-{i}"),
                                 "its pictures are not in its folder")
            self.assertEqual(self.browser.wait("why[args[0]]", "image-9"), "is not its page")
        whole = (self.path / "report/index.html").stat().st_size
        page = len(self.server.ask("GET", f"/v1/jobs/{job}/report/index.html?pictures=apart")[2])
        self.assertLess(page, whole)
        # One that has them beside the page.
        self.open_job(self.submit(kind="ab", chain_b="paper", frames="1", output="light", assets="light/pictures"))
        with self.browser.inside("#report iframe"):
            self.browser.wait("globalThis.postchain?.viewer.shown?.image")

    def test_reports_of_a_study_stream_their_pictures(self):
        scene = {"name": "wheels", "input": "shots/sharp.####.exr", "truth": "shots/sharp.####.exr",
                 "frames": "1"}
        job = self.server.submit({
            "kind": "study", "output": "study", "study": {
                "postchain_study": 1, "settings": {"repeats": 1}, "scenes": [scene],
                "chains": {"a": [{"fxaa": {}}], "b": [{"fxaa": {"preset": 12}}]}}})
        self.open_job(job)
        with self.browser.inside("#report iframe"):
            self.browser.wait("document.querySelector('td a')")
            self.browser.run("document.querySelector('td a').click();")
            self.wait_for_streamed_pictures()

    def test_the_form_of_all_settings(self):
        self.open_anew()
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
        self.wait_for()

    def test_text_of_others_is_never_html(self):
        (self.path / f"{HOSTILE}.0001.exr").write_bytes(
            (self.path / "shots/sharp.0001.exr").read_bytes())
        job = self.server.submit({
            "chain_text": "postchain: 1\n# <img hostile>\npasses: [fxaa]\n",
            "input": f"{HOSTILE}.####.exr", "output": "out/x.####.exr"})
        self.open(f"job={job}")
        self.browser.wait("document.querySelector('#job h2')?.innerText.includes('<img')")
        self.shows_only_text("#job-list .name")
        self.browser.run("document.getElementById('show-shots').click();")
        self.shows_only_text("#entries .name")

    def shows_only_text(self, selector):
        """Neither elements nor characters that turn or color the text beside them."""
        self.browser.wait("[...document.querySelectorAll(args[0])].some((n) => n.textContent.includes('<img')"
                          " && n.textContent.includes('\\\\u{202e}\\\\x1b[31m'))", selector)
        self.assertFalse(self.browser.run("return !!document.querySelector('[hostile]');"))
        shown = self.browser.run(
            "return document.body.innerText + [...document.querySelectorAll('[title], [aria-label]')].map("
            "(one) => one.title + one.ariaLabel).join('');")
        self.assertNotRegex(shown, "[\u202e\x1b]")


if __name__ == "__main__":
    run()
