"""The postchain command: where it is, and jobs of one or more of its calls, with progress."""
import collections
import json
import os
import pathlib
import queue
import re
import shutil
import subprocess
import threading

import bpy

from . import camera, simulation

MISSING = ("the command `postchain` was not found: install the package postchain, or build it and run "
           "`cmake --install build --component command --prefix ~/.local`; or give its path in "
           "Preferences, Add-ons, postchain")
ON_CPU = "computing on the CPU"  # of the command's warning


class CommandError(Exception):
    """A job cannot run, or has failed. The text is for the panel."""


def preferences():
    """The add-on's preferences; None if it is registered without being enabled."""
    addon = bpy.context.preferences.addons.get(__package__)
    return addon.preferences if addon else None


def path():
    """The command: the preference, the search path, ~/.local/bin."""
    own = preferences()
    chosen = bpy.path.abspath(own.command) if own else ""
    if chosen:
        if os.path.isfile(chosen) and os.access(chosen, os.X_OK):
            return chosen
        raise CommandError(f"{chosen} is not a program: correct the command's path in Preferences, "
                           "Add-ons, postchain")
    found = shutil.which("postchain") or shutil.which(os.path.expanduser("~/.local/bin/postchain"))
    if not found:
        raise CommandError(MISSING)
    return found


FAILURES = (CommandError, camera.CameraError, OSError)  # what the panel shows; all else is a bug


class Step:
    """One process. progress(line) returns a share of 0 to 1 and a text, or None. temporary: files that are
    deleted when the job ends, however it does."""

    def __init__(self, title, arguments, progress, temporary=()):
        self.title = title
        self.temporary = temporary
        self.arguments = [str(word) for word in arguments]
        self.progress = progress


def postchain(title, arguments):
    """A call of the command that prints its progress on standard output."""
    state = {}

    def progress(line):
        key, colon, value = line.partition(": ")
        if colon and key in ("openjd_progress", "openjd_status"):
            state[key] = value
            if "openjd_progress" in state:
                return float(state["openjd_progress"]) / 100, state.get("openjd_status", "")
        return None
    own = preferences()
    device = own.device if own else "auto"
    return Step(title, [path(), *arguments, "--device", device, "--progress", "openjd", "--log-format",
                        "json"], progress)


def blender(title, call, images, temporary=()):
    """Another Blender runs a call of this package, as text, on a copy of the file, so this one stays usable.
    images: how many the call saves; temporary: as of Step."""
    if lacking := simulation.unbaked(bpy.context.scene):
        raise CommandError(f"not baked: {', '.join(lacking)}. {title} uses another Blender, in which these simulations "
                           "would start anew. Bake them: Physics properties, Cache, Bake All Dynamics")
    copy = os.path.join(bpy.app.tempdir, "postchain.blend")
    try:
        bpy.ops.wm.save_as_mainfile(filepath=copy, copy=True, compress=False)
    except RuntimeError as error:
        raise CommandError(f"{copy}: {error}") from error
    simulation.carry_caches(copy)
    package = pathlib.Path(__file__).resolve().parent
    script = (f"import bpy, sys; sys.path.insert(0, {str(package.parent)!r}); "
              f"import {package.name} as addon; "
              f"hasattr(bpy.types.Scene, 'postchain') or addon.register(); "
              f"addon.simulation.find_caches({os.path.dirname(bpy.data.filepath)!r}); addon.{call}")
    saved = []

    def progress(line):
        if line.startswith("Saved:"):
            saved.append(line)
        share = samples_done(line)
        return ((len(saved) + share) / images, f"image {len(saved) + 1} of {images}"
                ) if share is not None else None
    return Step(title, [bpy.app.binary_path, "-b", copy, "--python-exit-code", "1", "--python-expr",
                        script], progress, [copy, simulation.cache_folder(copy), *temporary])


def message_of(text):
    """(level, message) of a line of the command's log."""
    try:
        line = json.loads(text)
        return line["level"], line["message"]
    except (ValueError, KeyError, TypeError):
        return "", text


def reason(lines):
    """Why a process has failed: the exception of the last traceback it printed, otherwise the last three lines."""
    found = re.findall(r"Traceback \(most recent call last\):\n(?: .*\n)+(.+(?:\n.+)*)", "\n".join(lines))
    if found:
        return re.sub(r"^(?:\w+\.)*(?:CommandError|CameraError|OSError|RuntimeError): ", "", found[-1])
    return "; ".join([line for line in lines if line.strip()][-3:])


class Job:
    """Runs steps one after the other. poll() never waits."""
    running = set()

    def __init__(self, steps):
        self.steps = collections.deque(steps)
        self.count = len(steps)
        self._temporary = [path for step in steps for path in step.temporary]
        self.share, self.text = 0.0, ""
        self.errors, self.warnings = [], []
        self._process = None
        self._lines = queue.Queue()
        self._output, self._log = [], []

    def start(self):
        Job.running.add(self)
        self._next()

    def _next(self):
        step = self.steps[0]
        self.share, self.text = (self.count - len(self.steps)) / self.count, step.title
        self._output, self._log = [], []
        try:
            self._process = subprocess.Popen(step.arguments, stdout=subprocess.PIPE,
                                             stderr=subprocess.PIPE, stdin=subprocess.DEVNULL)
        except OSError as error:
            self._end()
            raise CommandError(f"{step.arguments[0]} cannot be started: {error.strerror}; {MISSING}"
                               ) from error
        self._readers = [threading.Thread(target=self._read, args=(stream, name), daemon=True)
                         for name, stream in (("out", self._process.stdout),
                                              ("log", self._process.stderr))]
        for reader in self._readers:
            reader.start()

    def _end(self):
        Job.running.discard(self)
        for path in self._temporary:
            simulation.delete(path)

    def _read(self, stream, name):
        with stream:
            for line in stream:
                self._lines.put((name, line.decode("utf-8", "replace").rstrip("\r\n")))

    def _take_lines(self):
        while not self._lines.empty():
            name, line = self._lines.get()
            if name == "log":
                level, message = message_of(line)
                self._log.append(message)
                if level in ("error", "warning"):
                    (self.errors if level == "error" else self.warnings).append(message)
                continue
            found = self.steps[0].progress(line)
            if found:
                done = self.count - len(self.steps)
                self.share = (done + min(max(found[0], 0), 1)) / self.count
                self.text = f"{self.steps[0].title}: {found[1]}" if found[1] else self.steps[0].title
            else:
                self._output.append(line)

    def poll(self):
        """True when all steps have ended. Raises CommandError if one fails."""
        self._take_lines()
        code = self._process.poll()
        if code is None or any(reader.is_alive() for reader in self._readers):
            return False
        self._take_lines()
        step = self.steps.popleft()
        if code != 0:
            self._end()
            what = "; ".join(self.errors) or reason([*self._log, "", *self._output]) or f"exit code {code}"
            raise CommandError(f"{step.title}: {what}")
        if self.steps:
            self._next()
            return False
        self._end()
        self.share = 1.0
        return True

    def wait(self, timeout):
        """For a program without windows: waits at most this many seconds before the next poll()."""
        try:
            self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            pass

    def cancel(self):
        """Ends the process and waits for it: the command gives up its frame at once."""
        if self._process and self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(20)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._end()


def cancel_all():
    for operator in list(JobOperator.modal_ones):
        operator.cancel(bpy.context)
    for job in list(Job.running):
        job.cancel()


class JobOperator:
    """Base of operators that run a Job: in the background of a window, with progress in the status
    bar, ended by Esc; without a window, or called from a script, until it is done.

    A subclass has steps(context) -> [Step], done(context, job) -> text."""
    modal_ones = set()
    _told_of_cpu = False  # since Blender was started
    _timer = None
    _job = None

    def execute(self, context):
        try:
            self._begin(context)
            shown = ""
            while not self._job.poll():
                if bpy.app.background and self._job.text != shown:
                    shown = self._job.text
                    print(f"postchain: {shown}", flush=True)
                self._job.wait(0.05)
            return self._finish(context)
        except FAILURES as error:
            return self._fail(context, error)

    def invoke(self, context, _event):
        if bpy.app.background:
            return self.execute(context)
        try:
            self._begin(context)
        except FAILURES as error:
            return self._fail(context, error)
        manager = context.window_manager
        self._timer = manager.event_timer_add(0.1, window=context.window)
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        JobOperator.modal_ones.add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            self.cancel(context)
            self.report({"WARNING"}, f"{self.bl_label}: cancelled; complete frames are kept")
            _tell(context, "WARNING", f"{self.bl_label}: cancelled")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if self._job not in Job.running:  # ended by cancel_all()
            self._end(context)
            return {"CANCELLED"}
        try:
            if self._job.poll():
                self._end(context)
                return self._finish(context)
        except FAILURES as error:
            self._end(context)
            return self._fail(context, error)
        context.window_manager.progress_update(int(100 * self._job.share))
        context.workspace.status_text_set(
            f"postchain {100 * self._job.share:.0f} %  {self._job.text}    Esc: cancel")
        return {"PASS_THROUGH"}

    def cancel(self, context):
        """By Esc, and by Blender if a file is loaded meanwhile or the window closes."""
        if self._job:
            self._job.cancel()
        self._end(context)

    def _begin(self, context):
        if Job.running:
            raise CommandError("another job of postchain is running: wait, or press Esc")
        _tell(context, "NONE", "")
        self._job = Job(self.steps(context))
        self._job.start()

    def _end(self, context):
        JobOperator.modal_ones.discard(self)
        if self._timer:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
            context.window_manager.progress_end()
            if context.workspace:
                context.workspace.status_text_set(None)

    def _finish(self, context):
        text = self.done(context, self._job)
        warnings = self._warnings()
        for message in warnings:
            self.report({"WARNING"}, message)
        self.report({"INFO"}, text)
        _tell(context, "INFO", "\n".join([text, *warnings]))
        return {"FINISHED"}

    def _warnings(self):
        """The job's warnings. Each step warns of the CPU: this one comes once, in the add-on's words."""
        found = []
        for message in self._job.warnings:
            if ON_CPU in message:
                if JobOperator._told_of_cpu:
                    continue
                JobOperator._told_of_cpu = True
                message = message.replace("give --device software",
                                          "choose the device CPU in Preferences, Add-ons, postchain,")
            found.append(message)
        return found

    def _fail(self, context, error):
        if self._job:
            self._job.cancel()
        _tell(context, "ERROR", str(error))
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}


def _tell(context, icon, text):
    """The outcome, shown in the panel until the next one."""
    context.window_manager.postchain_outcome = f"{icon}\n{text}"
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "PROPERTIES":
                area.tag_redraw()


def samples_done(line):
    """Share of the image in a line of Cycles' progress, or None."""
    found = re.search(r"Sample (\d+)/(\d+)", line)
    return int(found[1]) / max(int(found[2]), 1) if found else None
