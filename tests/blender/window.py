"""Runs inside a Blender with a window: called by addon_test.py with a folder after "--"."""
import json
import os
import sys
import time
import traceback

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import scene as scenes  # noqa: E402

FOLDER = sys.argv[sys.argv.index("--") + 1]
WAIT_S = 120


def until(condition, text):
    """Yields until a condition holds."""
    end = time.monotonic() + WAIT_S
    while not condition():
        check(time.monotonic() < end, text)
        yield


def ended():
    return not sys.modules[scenes.MODULE].command.Job.running


def check(condition, text):
    if not condition:
        raise AssertionError(f"{text}: {bpy.context.window_manager.postchain_outcome}")


def window():
    return bpy.context.window_manager.windows[0]


def area(kind):
    return max((one for one in window().screen.areas if one.type == kind),
               key=lambda one: one.width * one.height)


def split():
    """An image editor and Output properties in place of the largest area, and only our panels."""
    largest = max(window().screen.areas, key=lambda one: one.width * one.height)
    with bpy.context.temp_override(window=window(), area=largest, region=largest.regions[-1]):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.6)
    largest.type = "IMAGE_EDITOR"
    panel = max((one for one in window().screen.areas if one.type == "VIEW_3D"),
                key=lambda one: one.width)
    panel.type = "PROPERTIES"
    for kind in list(bpy.types.Panel.__subclasses__()):
        if (getattr(kind, "bl_context", "") == "output" and kind.is_registered
                and kind.__module__.startswith("bl_ui")):
            bpy.utils.unregister_class(kind)
    return panel.spaces.active


def shown():
    """Names of the images in image editors, from left to right."""
    return [one.spaces.active.image.name for win in bpy.context.window_manager.windows
            for one in sorted(win.screen.areas, key=lambda each: each.x)
            if one.type == "IMAGE_EDITOR" and one.spaces.active.image]


def start(addon):
    """The job of Filter, which has begun."""
    with bpy.context.temp_override(window=window(), area=area("PROPERTIES"),
                                   region=area("PROPERTIES").regions[-1]):
        check(bpy.ops.postchain.filter("INVOKE_DEFAULT") == {"RUNNING_MODAL"}, "starts")
    job, = addon.command.Job.running
    return job


def steps():
    """Each yield lets Blender handle its events and draw."""
    scenes.install()
    addon = sys.modules[scenes.MODULE]
    bpy.ops.preferences.addon_disable(module=scenes.MODULE)
    for kind in addon.panel.CLASSES:
        kind.bl_options = set()  # open
    scenes.enable()
    scene = scenes.make(FOLDER, (160, 90))
    yield
    space = split()

    def output_tab():
        """A tab can be chosen when the editor has been drawn."""
        try:
            space.context = "OUTPUT"
        except TypeError:
            return False
        return True
    yield from until(output_tab, "the panel is drawn")
    for _ in range(3):
        yield
    scene.postchain.comparison = json.dumps({"frame": 2, "page": "report/index.html", "rows": [
        ["as_rendered", "30.00 dB", "0.100", "0.900"], ["filtered", "40.00 dB", "0.050", "0.950"]]})
    eye, scene.camera = scene.camera, None  # with messages, and every parameter
    scene.postchain.joint_blur.starts = 3
    for order in ("LENS_MOTION", "JOINT"):
        scene.postchain.order = order
        area("PROPERTIES").tag_redraw()
        for _ in range(2):
            yield
    scene.camera = eye
    bpy.ops.postchain.reset(name="joint_blur")
    bpy.ops.postchain.prepare()
    bpy.ops.render.render(animation=True)
    scene.postchain.preset, scene.postchain.samples = "best", 1023  # ended long before it is done
    yield

    job = start(addon)
    yield
    check(job._process.poll() is None, "runs")
    window().event_simulate(type="ESC", value="PRESS")
    window().event_simulate(type="ESC", value="RELEASE")
    yield from until(ended, "Esc ends the job")
    check(job._process.poll() is not None, "Esc ends the process")
    check("cancelled" in bpy.context.window_manager.postchain_outcome, "the panel says so")

    job = start(addon)
    yield
    path = os.path.join(FOLDER, "shot.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    check(job._process.poll() is None, "still runs")
    with bpy.context.temp_override(window=window()):
        bpy.ops.wm.open_mainfile(filepath=path)
    yield
    check(job._process.poll() is not None, "loading a file ends the process")
    check(not addon.command.Job.running, "no job is left")

    scene = bpy.context.scene
    scene.postchain.preset, scene.postchain.existing, scene.postchain.samples = "fast", "overwrite", 0
    start(addon)
    yield from until(lambda: "3 frames are in" in bpy.context.window_manager.postchain_outcome, "filters")
    yield from until(lambda: shown() == ["shot_0001.exr", "postchain shot_0001.exr"],
                     "shows input and result")
    for one in window().screen.areas:
        if one.type == "IMAGE_EDITOR":
            one.type = "VIEW_3D"
    yield
    start(addon)  # without an image editor
    yield from until(lambda: len(bpy.context.window_manager.windows) == 2 and len(shown()) == 2,
                     "a window shows both")
    yield from until(ended, "the job has ended")
    # While a job runs, the add-on can be switched off.
    bpy.context.scene.postchain.preset, bpy.context.scene.postchain.samples = "best", 1023
    job = start(addon)
    check(job._process.poll() is None, "runs before it is switched off")
    bpy.ops.preferences.addon_disable(module=scenes.MODULE)
    check(job._process.poll() is not None, "switching the add-on off ends the process")
    yield
    yield


def advance(running=steps()):
    try:
        next(running)
        return 0.2
    except StopIteration:
        print("\nOK\n", flush=True)
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)
    bpy.ops.wm.quit_blender()
    return None


bpy.app.timers.register(advance, first_interval=1.0, persistent=True)
