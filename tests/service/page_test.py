"""Pictures on the page in headless Chromium, on the real service: from the folders to a picture and a
job, by mouse and by keyboard.

usage: page_test.py POSTCHAIN"""
import math

from service_page import ALT, DOWN, ENTER, OnTheService, PROGRAM, SHOT, SHOWN, run
from browser import RIGHT
from server import Server, serve_command


class Picture(OnTheService):
    def test_from_the_folders_to_a_job_without_typing(self):
        self.open_from_the_folders()
        self.assertEqual(self.state("camera"), "shots/camera.json")
        self.browser.wait("location.hash.includes('shots/sharp.%23%23%23%23.exr')")
        before, after = self.values("before"), self.values("a")
        # Another chain changes the picture.
        self.choose("paper")
        other = self.values("a", after)
        self.choose("balanced")
        self.assertEqual(self.values("a", other), after)
        # Submitted as it is shown, beside the frames.
        self.browser.run("document.getElementById('which').value = '1-2';")
        self.press("Submit job")
        self.wait_for()
        self.assertTrue((self.path / "shots/out/sharp_balanced.0002.exr").exists())
        self.browser.wait(f"{SHOWN} && postchain.viewer.shown.frame === 1")
        self.browser.wait("document.querySelectorAll('.cell.written').length === 2")
        self.browser.wait("document.querySelector('#job table')")
        self.assertIn("joint_blur", self.text("#job table"))
        # The preview was what the job wrote.
        for a, b in zip(self.values("a"), after):
            self.assertAlmostEqual(a, b, delta=0.002 * max(1, abs(a)))
        self.assertEqual(self.values("before"), before)
        self.assertEqual(self.browser.errors(), [])

    def test_wipe_error_map_and_values(self):
        self.open_shot("&frame=2")
        self.browser.wait("postchain.viewer.shown.other")
        # Left of the line the frame before, on the screen.
        def read(x):
            return self.browser.run("return postchain.viewer.read(args[0], 45);", x)
        left, right = read(30), read(130)
        self.browser.keys("w")
        self.browser.wait("!postchain.viewer.shown.other")
        self.assertEqual(read(130), right)
        self.browser.keys("0")
        self.browser.wait("postchain.viewer.shown.source.key === 'before'")
        self.assertEqual(read(30), left)
        self.browser.keys(" ", "e")
        self.browser.wait("postchain.viewer.shown.error")
        # The formulas and scales of reports (docs/metrics.md).
        pairs = list(zip(self.values("a"), self.values("before")))
        places = {
            "difference": math.log10(max(max(abs(i - r) for i, r in pairs), 1e-30) / 1e-3) / 4,
            "relmse": math.log10(max(sum(((i - r) / (abs(r) + 0.01)) ** 2 for i, r in pairs) / 3,
                                     1e-30) / 1e-4) / 5,
            "smape": sum(2 * abs(i - r) / (abs(i) + abs(r) + 0.02) for i, r in pairs) / 3 / 2,
        }
        for key, place in places.items():
            self.browser.wait(f"postchain.state.get('map') === '{key}' && postchain.viewer.shown.error")
            self.assertGreater(place, 0, key)
            self.assertAlmostEqual(
                self.browser.run("return postchain.viewer.shown.error.data[45 * 160 + 80];"),
                255 * min(place, 1), delta=1, msg=key)
            self.browser.keys("m")
        self.browser.keys("e")
        self.browser.mouse(self.place(60, 45))
        self.browser.wait("document.getElementById('values').innerText.includes('before')")
        self.assertEqual(self.browser.errors(), [])

    def test_two_chains_side_by_side(self):
        self.open_shot("&frame=2")
        self.press("Compare with B")
        self.browser.wait("postchain.viewer.shown?.source.key === 'b' && postchain.viewer.shown.other "
                          f"&& {SHOWN}")
        self.assertIn("A balanced \u2502 2", self.text("#shown"))
        a = self.values("a")
        b = self.values("b", a)
        self.choose("best")  # of B
        self.values("b", b)
        self.assertEqual(self.values("a"), a)
        # Both go into the form of a comparison.
        self.click("#settings")
        self.browser.wait("document.querySelector('#new input[value=ab]:checked')")
        self.assertEqual(self.browser.run("return document.getElementById('new-chain_b').value;"),
                         "best")
        self.browser.run("document.getElementById('new').close();")
        # Submitted is the one that is chosen.
        self.browser.run("document.getElementById('which').value = '2';")
        self.press("Submit job with B")
        self.wait_for()
        self.assertTrue((self.path / "shots/out/sharp_best.0002.exr").exists())
        self.assertEqual(self.browser.errors(), [])

    def test_a_link_leads_to_a_frame(self):
        self.open_shot("&frame=3&ev=1&wipe=0&zoom=2&x=40&y=45")
        self.assertEqual([self.state(key) for key in ("frame", "ev", "wipe", "zoom")], [3, 1, 0, 2])
        self.browser.wait("postchain.viewer.shown?.frame === 3")
        self.assertEqual(self.text(".cell[aria-current] .number").split(), ["Frame", "3"])
        job = self.submit(output="out/link.####.exr")
        self.open_job(f"{job}&frame=2")
        self.browser.wait(f"{SHOWN} && postchain.viewer.shown.frame === 2")
        self.assertEqual(self.state("frame"), 2)
        self.assertEqual(self.browser.errors(), [])

    def test_by_keyboard_alone(self):
        self.open_anew()
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
        self.browser.wait(SHOWN)
        self.browser.keys(("down", ALT), "4", ("up", ALT))
        self.browser.wait("document.activeElement.dataset.frame === '1'")
        self.browser.keys(RIGHT)
        self.assertEqual([self.state("frame"), self.focused()], [2, "2"])
        self.browser.keys(("down", ALT), "5", ("up", ALT))
        self.browser.keys("p")
        self.browser.wait("postchain.viewer.shown?.source.name === 'A paper'")
        self.browser.keys(("down", ALT), "3", ("up", ALT))
        self.assertEqual(self.focused(), "canvas")
        self.browser.keys(RIGHT, "]", "w")
        self.assertEqual([self.state("ev"), self.state("wipe")], [0.5, 0])


class Users(OnTheService):
    def serving(self, *more):
        users = self.path / "users.yaml"
        users.write_text("postchain_users: 1\nusers: {ann: {}}\n")
        server = Server(serve_command(PROGRAM, self.path, "--users", str(users), *more, store="other.sqlite"))
        self.addCleanup(lambda: self.assertEqual(server.stop(), 143))
        return f"http://127.0.0.1:{server.port}/#{SHOT}&frame=2"

    def named(self, **headers):
        """What a proxy would add to the requests of this browser."""
        self.browser.command("Network.enable")
        self.browser.command("Network.setExtraHTTPHeaders", headers=headers)

    def refused(self, address, why):
        self.browser.open("about:blank")
        self.browser.open(address)
        self.browser.wait("document.getElementById('refused')?.checkVisibility()")
        self.assertIn(why, self.text("#refusal"))
        self.assertTrue(self.is_hidden("work"))

    def test_without_a_proxy(self):
        self.refused(self.serving(), "")

    def test_of_a_proxy(self):
        address = self.serving("--trusted-proxy", "127.0.0.1", "--user-header", "X-Remote-User")
        self.addCleanup(self.named)
        self.named(**{"X-Remote-User": "eve"})
        self.refused(address, "the proxy names 'eve', who is not in the file of users")
        self.named(**{"X-Remote-User": "ann"})
        self.browser.open("about:blank")
        self.browser.open(address)
        self.browser.wait(f"{SHOWN} && postchain.viewer.shown.frame === 2")
        self.browser.wait("document.querySelector('.cell img')?.naturalWidth === 160")
        self.browser.wait("document.getElementById('status').innerText.startsWith('ready')")
        self.assertEqual(self.text("#user"), "ann")
        self.assertTrue(self.is_hidden("refused"))


if __name__ == "__main__":
    run()
