"""First use of the Blender add-on, inside a Blender that has none, with the command in PATH: installs the file, renders
two frames of a scene with its settings and filters them.
    blender -b --factory-startup --python-exit-code 1 --python addon.py -- addon|extension FILE VERSION"""
import os
import pathlib
import sys
import tomllib

import bpy

kind, file, version = sys.argv[sys.argv.index("--") + 1:]
file = os.path.abspath(file)
if kind == "addon":
    bpy.ops.preferences.addon_install(filepath=file)
    module = "postchain_blender"
    bpy.ops.preferences.addon_enable(module=module)
    stated = ".".join(map(str, sys.modules[module].bl_info["version"]))
else:
    bpy.ops.extensions.package_install_files(filepath=file, repo="user_default", enable_on_install=True)
    module = "bl_ext.user_default.postchain_blender"
    manifest = pathlib.Path(sys.modules[module].__file__).with_name("blender_manifest.toml")
    stated = tomllib.loads(manifest.read_text(encoding="utf-8"))["version"]
assert stated == version, f"{file} states {stated}"
bpy.context.preferences.addons[module].preferences.device = "software"

scene = bpy.context.scene
cube = bpy.data.objects["Cube"]
for frame, x in ((0, 0), (3, 3)):
    cube.location.x = x
    cube.keyframe_insert("location", frame=frame)
scene.render.engine = "CYCLES"
scene.cycles.samples, scene.cycles.use_denoising = 2, False
scene.render.resolution_x, scene.render.resolution_y = 64, 36
scene.render.use_motion_blur = True
scene.camera.data.dof.use_dof, scene.camera.data.dof.focus_distance = True, 8
scene.frame_start, scene.frame_end = 1, 2
scene.render.filepath = os.path.abspath("render/shot_####")
scene.postchain.output = os.path.abspath("out")
scene.postchain.preset = "fast"
assert bpy.ops.postchain.prepare() == {"FINISHED"}
bpy.ops.render.render(animation=True)
assert bpy.ops.postchain.filter() == {"FINISHED"}
written = sorted(path.name for path in pathlib.Path("out").iterdir())
assert {"shot_0001.exr", "shot_0002.exr"} <= set(written), written
print(f"Blender {bpy.app.version_string}: {module} {stated} is enabled, and wrote {', '.join(written)}")
