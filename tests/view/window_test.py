"""Drives the viewer under Xvfb: window_test.py POSTCHAIN POSTCHAIN_VIEW WORK

Opens a generated sequence, then reorders, changes, compares, focuses by click, undoes and saves, by
mouse and keyboard (xdotool). Asserts the pixels on the screen (Xvfb's framebuffer file) against those
that `postchain run --png` writes, the viewer's state file, and the saved chain.
"""
import json
import os
import pathlib
import re
import shutil
import signal
import struct
import subprocess
import sys
import time

TESTS = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(TESTS / "command"))
from png import read_png  # noqa: E402

HALVED = TESTS / "data/halved.ocio"
COMMAND = os.path.abspath(sys.argv[1])
VIEWER = pathlib.Path(sys.argv[2])
WORK = pathlib.Path(sys.argv[3])
PATIENCE_S = 240
FRAMES = ["-i", str(WORK / "scene/gbuf.####.exr")]
HUB = int(320 * 0.525), int(180 * 0.465)  # of the wheel in the middle
SCENE = [*FRAMES, "--camera", str(WORK / "scene/camera.json")]
CHAIN = """# The chain of this test.
postchain: 1
passes:
  # Shutter and lens in one.
  - joint_blur: {samples: 8}
  # Edges last.
  - fxaa
"""


def check(holds, what):
    if not holds:
        raise AssertionError(what)


def run(*words, code=0, env=None):
    done = subprocess.run([COMMAND, *words], capture_output=True, text=True, env=env, timeout=PATIENCE_S)
    check(done.returncode == code, f"{words}: exit code {done.returncode}\n{done.stderr}")
    return done.stderr


class Display:
    def __init__(self, width, height):
        self.folder = WORK / f"screen_{width}"
        self.folder.mkdir()
        read, write = os.pipe()
        self.server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(write), "-screen", "0", f"{width}x{height}x24", "-nolisten", "tcp",
             "-noreset", "-fbdir", str(self.folder)], pass_fds=[write], stderr=subprocess.DEVNULL)
        os.close(write)
        number = ""
        while not number.endswith("\n"):
            number += os.read(read, 16).decode()
        number = number.strip()
        os.close(read)
        self.env = dict(os.environ, DISPLAY=f":{number}", LIBGL_ALWAYS_SOFTWARE="1",
                        XDG_STATE_HOME=str(WORK / "state"))
        self.env.pop("WAYLAND_DISPLAY", None)

    def close(self):
        self.server.terminate()
        self.server.wait()

    def tool(self, *words):
        subprocess.run(["xdotool", *map(str, words)], env=self.env, check=True, timeout=PATIENCE_S)

    def rows(self, x, y, width, height):
        """RGB bytes of each row of a rectangle, from the XWD file of the framebuffer."""
        data = (self.folder / "Xvfb_screen0").read_bytes()
        header = struct.unpack(">25I", data[:100])
        start = header[0] + 12 * header[19]
        check(header[11] == 32, "32 bits a pixel")
        rows = []
        for row in range(y, y + height):
            at = start + row * header[12] + 4 * x
            line = data[at:at + 4 * width]
            rgb = bytearray(3 * width)
            rgb[0::3], rgb[1::3], rgb[2::3] = line[2::4], line[1::4], line[0::4]
            rows.append(bytes(rgb))
        return rows


class Viewer:
    def __init__(self, display, *words, folder=None):
        self.display = display
        self.state_file = WORK / "state.json"
        self.state_file.unlink(missing_ok=True)
        self.process = subprocess.Popen(
            [COMMAND, "view", *map(str, words), "--state-file", str(self.state_file), "--device",
             "software"], env=display.env, cwd=folder)
        self.wait("is opened and refined", lambda s: s["at_rest"] and not s["draft"] and s["filter_ms"] > 0)

    def state(self):
        try:
            return json.loads(self.state_file.read_text())
        except (FileNotFoundError, json.JSONDecodeError):
            return None

    def wait(self, what, holds):
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            state = self.state()
            check(self.process.poll() is None, f"{what}: the viewer has ended")
            if state and holds(state):
                return state
            time.sleep(0.05)
        raise AssertionError(f"{what}: {json.dumps(self.state())[:3000]}")

    def refined(self, what, holds=lambda s: True):
        return self.wait(what, lambda s: s["at_rest"] and not s["draft"] and holds(s))

    def rectangle(self, place):
        return self.wait(place + " is there", lambda s: place in s["places"])["places"][place]

    def center(self, place):
        x, y, width, height = self.rectangle(place)
        return int(x + width / 2), int(y + height / 2)

    def pixel(self, x, y):
        """Where a pixel of the image is in the window."""
        left, top = self.wait("an image", lambda s: True)["pixel_0_0"]
        return round(left) + x, round(top) + y

    def close(self):
        self.chord("ctrl", "q")
        self.ends()

    def ends(self):
        check(self.process.wait(PATIENCE_S) == 0, "closed")

    def move(self, x, y):
        self.display.tool("mousemove", x, y)
        self.wait("the mouse is seen", lambda s: s["mouse"] == [x, y])

    def press(self, *words):
        """A key or a button down or up, until the viewer has drawn a frame with it, or has ended. One that
        goes down and up within one frame of the interface is lost."""
        before = self.state()["presses"]
        self.display.tool(*words)
        end = time.monotonic() + PATIENCE_S
        while self.process.poll() is None and self.state()["presses"] == before:
            check(time.monotonic() < end, f"{words} is drawn")
            time.sleep(0.02)

    def click(self, place):
        self.move(*self.center(place))
        self.press("mousedown", 1)
        self.press("mouseup", 1)

    def drag(self, start, end):
        self.move(*start)
        self.press("mousedown", 1)
        for i in range(1, 9):
            self.move(*[round(a + (b - a) * i / 8) for a, b in zip(start, end)])
        self.press("mouseup", 1)

    def rest(self):
        """Moves the mouse over the panels, so that no value under the cursor is drawn."""
        self.move(1270, 790)

    def slide(self, place, start, end):
        """Drags across a widget; both ends as parts of its width."""
        x, y, width, height = self.rectangle(place)
        self.drag(*[(int(x + width * part), int(y + height / 2)) for part in (start, end)])
        self.rest()

    def chord(self, *keys):
        for key in keys:
            self.press("keydown", key)
        for key in reversed(keys):
            self.press("keyup", key)

    def picture(self):
        """The image on the screen at 1:1, without what is drawn into its corners."""
        self.wait("1:1", lambda s: abs(s["zoom"] - 1) < 1e-9)
        return self.display.rows(*self.pixel(0, 0), 320, 180)

    def until(self, what, holds):
        """The image on the screen, when it is as expected: the server may draw later than the viewer says."""
        end = time.monotonic() + PATIENCE_S
        while not holds(rows := self.picture()):
            check(time.monotonic() < end, what)
            time.sleep(0.1)
        return rows

    def shows(self, what, rows):
        return self.until(what, lambda found: found == rows)


def of_run(chain, name, *words):
    run("run", str(chain), *SCENE, "--frames", "2", "--png", "-o", str(WORK / f"{name}.####.exr"),
        "--device", "software", *words)
    return read_png(WORK / f"{name}.0002.png")[2]


def session(display):
    chain = WORK / "chain.yaml"
    chain.write_text(CHAIN)
    viewer = Viewer(display, chain, *SCENE, "--frame", "2")
    viewer.rest()
    viewer.chord("1")
    viewer.refined("1:1", lambda s: s["zoom"] == 1)
    first = viewer.shows("the screen shows what run writes", of_run(chain, "first"))

    # Reorder by dragging.
    viewer.drag(viewer.center("pass 0"), viewer.center("pass 1"))
    viewer.rest()
    viewer.refined("fxaa first", lambda s: s["chain"].find("fxaa") < s["chain"].find("joint_blur"))
    reordered = viewer.until("another order is another image", lambda rows: rows != first)

    # Change a value with its slider.
    viewer.slide("f_stop", 0.2, 0.6)
    viewer.refined("f-stop", lambda s: "f_stop: " in s["chain"])
    changed = viewer.until("another f-stop is another image", lambda rows: rows != reordered)

    # Compare: the left half is the result, the right half the frame before the chain.
    viewer.chord("w")
    viewer.refined("wipe", lambda s: s["compare"] == 1 and "psnr" in s["metrics"])
    viewer.until("left: the result; right: before", lambda rows: all(
        a[:3 * 80] == b[:3 * 80] and a[3 * 240:] != b[3 * 240:] for a, b in zip(rows[:40], changed[:40])))
    viewer.chord("w")
    viewer.refined("no wipe", lambda s: s["compare"] == 0)
    viewer.shows("no wipe", changed)

    # Focus by click, on the hub of the wheel in the middle.
    viewer.chord("t")
    viewer.move(*viewer.pixel(*HUB))
    viewer.press("mousedown", 1)
    viewer.press("mouseup", 1)
    viewer.chord("t")
    viewer.rest()
    state = viewer.refined("focus", lambda s: "focus_distance: " in s["chain"])
    distance = float(re.search(r"focus_distance: (\S+)", state["chain"]).group(1))
    check(abs(distance - 1.3) < 0.02, f"the hub is at 1.3, not at {distance}")

    # Save.
    viewer.chord("ctrl", "s")
    viewer.wait("saved", lambda s: not s["changed"])
    text = chain.read_text()
    check(text.startswith("# The chain of this test.\n"), text)
    viewer.shows("run with the saved file writes what is on the screen", of_run(chain, "saved"))

    # A window of one pixel, and back.
    before = viewer.state()
    window = subprocess.run(["xdotool", "search", "--name", "postchain view"], env=display.env,
                            capture_output=True, text=True, check=True).stdout.split()[0]
    for size in [(1, 1), (700, 500), (1, 700), (1280, 800)]:
        display.tool("windowsize", window, *size)
        viewer.wait("sized", lambda s: s["window"] == list(size))
    state = viewer.refined("sized", lambda s: "save" in s["places"])
    check(state["textures_alive"] == before["textures_alive"], "resizing makes no textures")
    viewer.close()


def watching(display):
    """A view of OpenColorIO, playing, a movie, a focus pull, and the question before closing."""
    folder, chain = WORK / "saved", WORK / "chain.yaml"
    folder.mkdir()
    viewer = Viewer(display, chain, *SCENE, "--frame", "2", "--ocio", HALVED, folder=folder)
    viewer.rest()
    viewer.chord("1")
    viewer.refined("1:1", lambda s: s["zoom"] == 1)
    shown = viewer.shows("the screen shows OpenColorIO's view", of_run(chain, "halved", "--ocio", str(HALVED)))

    viewer.click("tab Inspect")
    viewer.slide("exposure", 0.5, 0.55)
    viewer.until("more exposure is brighter", lambda rows: sum(map(sum, rows)) > 1.2 * sum(map(sum, shown)))

    # Twice through the three frames. The state file is too slow to hold each of them.
    viewer.chord("space")
    viewer.wait("plays", lambda s: s["frames_played"] >= 6)
    viewer.chord("space")
    state = viewer.refined("stopped", lambda s: not s["playing"])
    still = state["frame"]
    check(still == (2 + state["frames_played"] - 1) % 3 + 1, f"plays one after the other: {still}")

    viewer.click("tab Save")
    if shutil.which("ffprobe"):
        viewer.click("save movie")
        viewer.wait("movie", lambda s: not s["export"]["running"] and "movie.mp4" in s["export"]["text"])
        found = subprocess.run(
            ["ffprobe", "-v", "error", "-count_frames", "-show_entries", "stream=width,height,nb_read_frames",
             "-of", "csv=p=0", folder / "movie.mp4"], capture_output=True, text=True).stdout.strip()
        check(found == "320,180,3", f"three frames in the movie, not {found}")

    # A focus pull in frame 2, from the hub in the middle to the wall.
    while viewer.state()["frame"] != 2:
        viewer.chord("Right")
    viewer.refined("frame 2", lambda s: s["frame"] == 2)
    viewer.chord("t")
    viewer.drag(viewer.pixel(*HUB), viewer.pixel(310, 10))
    viewer.chord("t")
    state = viewer.wait("two keys", lambda s: len(s["focus_keys"]) == 2)
    check(abs(state["focus_keys"]["1"] - 1.3) < 0.02 and state["focus_keys"]["3"] > 2, state["focus_keys"])
    viewer.chord("ctrl", "q")
    viewer.click("save and close")
    viewer.ends()
    keys = json.loads((folder / "camera.json").read_text())
    check(abs(keys["frames"]["1"]["focus_distance"] - 1.3) < 0.02, keys)


def idle(display):
    """Nothing happens, and nothing is done: no frame is drawn, and the processor rests."""
    viewer = Viewer(display, "balanced", *SCENE)
    viewer.rest()
    viewer.refined("idle")
    time.sleep(3)

    def processor_s():
        fields = pathlib.Path(f"/proc/{viewer.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    frames, used, start = viewer.state()["frames_drawn"], processor_s(), time.monotonic()
    time.sleep(20)
    percent = 100 * (processor_s() - used) / (time.monotonic() - start)
    drawn = viewer.state()["frames_drawn"] - frames
    print(f"idle: {percent:.2f} % of a core, {drawn} frames drawn in 20 s")
    check(drawn == 0, f"{drawn} frames drawn while nothing happens")
    check(percent < 1, f"{percent} % of a core while nothing happens")
    viewer.close()


def lost(display):
    """The end of the process does not lose edits."""
    chain = WORK / "lost.yaml"
    chain.write_text(CHAIN)
    viewer = Viewer(display, chain, *SCENE)
    viewer.click("remove 1")
    viewer.refined("removed", lambda s: "fxaa" not in s["chain"])
    time.sleep(3)  # edits are written from time to time
    viewer.process.kill()
    viewer.process.wait()
    viewer = Viewer(display, chain, *SCENE)
    state = viewer.refined("edits are back", lambda s: "fxaa" not in s["chain"] and s["changed"])
    check(any("restored" in text for text in state["messages"]), state["messages"])
    viewer.chord("ctrl", "z")
    viewer.refined("undo leads to the file", lambda s: "fxaa" in s["chain"] and not s["changed"])
    viewer.close()
    check(chain.read_text() == CHAIN, "the file stays")


def layout(display, width, height):
    """Nothing is cut off: every widget is within the window."""
    viewer = Viewer(display, "balanced", *SCENE, "--size", f"{width}x{height}")
    for tab in ["Compare", "Inspect", "Save", "Chain"]:
        viewer.click("tab " + tab)
        for name, (x, y, w, h) in viewer.refined(tab)["places"].items():
            if not name.startswith(("group ", "row ", "reset ")):  # these scroll
                check(x >= 0 and y >= 0 and x + w <= width and y + h <= height, f"{tab}: {name}")
    viewer.process.send_signal(signal.SIGTERM)
    check(viewer.process.wait(PATIENCE_S) == 143, "ended by a signal")


def bad_input(display):
    words = ["view", "balanced", *FRAMES, "--device", "software"]
    blind = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    text = run(*words, code=6, env=blind)
    check("no window can be opened" in text and "postchain serve" in text, text)
    text = run(*words, code=6, env=dict(display.env, MESA_GL_VERSION_OVERRIDE="4.3"))
    check("4.5" in text, text)
    text = run("view", "no_such_chain", *FRAMES, code=3, env=display.env)
    check("no_such_chain" in text, text)
    text = run("view", "balanced", code=2, env=display.env)
    check("--input" in text, text)
    alone = WORK / "alone"
    alone.mkdir()
    shutil.copy(COMMAND, alone / "postchain")
    done = subprocess.run([alone / "postchain", *words], capture_output=True, text=True, env=display.env)
    check(done.returncode == 2 and "postchain-view" in done.stderr and "--component view" in done.stderr,
          done.stderr)


def main():
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    check(VIEWER.parent == pathlib.Path(COMMAND).parent, "the viewer is beside the command, which starts it")
    run("scene", "wheels", "-o", str(WORK / "scene"), "--size", "320x180", "--frames", "1-3", "--device",
        "software")
    for width, height in [(1280, 800), (1920, 1080)]:
        display = Display(width, height)
        try:
            if width == 1280:
                session(display)
                watching(display)
                bad_input(display)
                lost(display)
                idle(display)
            layout(display, width, height)
        finally:
            display.close()


main()
