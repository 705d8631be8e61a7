"""Inside Blender: Render Layer Behind, and Filter with it."""
import os

import bpy

from addon_case import Case, addon, outcome


class Behind(Case):
    def layer(self, frame):
        return os.path.join(self.folder, "render/behind", f"shot_{frame:04d}.exr")

    def test_shows_the_wall_behind_the_cube(self):
        self.scene.frame_end = 2
        self.fails(bpy.ops.postchain.behind, "not OpenEXR MultiLayer", "press Prepare")
        bpy.ops.postchain.prepare()
        self.fails(bpy.ops.postchain.behind, "2 of 2 frames have not been rendered (first: 1)")
        self.render()
        self.scene.postchain.behind = True
        self.fails(bpy.ops.postchain.filter, "2 of 2 frames have no layer behind", "first: 1", "press Render")
        bpy.data.objects["wall"].data.materials.clear()  # shown all the same
        self.assertEqual(bpy.ops.postchain.behind(), {"FINISHED"})
        self.assertEqual(outcome(), f"INFO\nthe layer behind 2 frames is in {self.folder}/render/behind")
        self.assertEqual(sorted(os.listdir(os.path.dirname(self.layer(1)))),
                         ["shot_0001.exr", "shot_0002.exr"])
        depths_of = addon().peel.depths_of
        rendered = depths_of(self.layer(2).replace("/behind", ""))
        behind = depths_of(self.layer(2))
        self.assertAlmostEqual(rendered[18, 30], 3.5, places=3)  # the front of the cube
        self.assertAlmostEqual(behind[18, 30], 8, places=3)  # not its inside, at 4.5
        self.assertAlmostEqual(rendered[18, 2], 8, places=3)
        self.assertGreater(behind[18, 2], 1e9)  # nothing is behind the wall

        self.assertEqual(bpy.ops.postchain.filter(), {"FINISHED"})
        self.assertEqual(self.sidecar(2)["inputs"]["behind"], self.layer(2))

    def test_only_frames_that_lack_it(self):
        self.render()
        bpy.ops.postchain.behind()
        self.assertTrue(self.scene.postchain.behind)
        before = {frame: os.stat(self.layer(frame)).st_mtime_ns for frame in (1, 2, 3)}
        os.remove(self.layer(1))
        os.utime(self.layer(2).replace("/behind", ""))  # as if rendered again
        self.fails(bpy.ops.postchain.filter, "2 of 3 frames have no layer behind, or one older", "first: 1")
        bpy.ops.postchain.behind()
        self.assertEqual([frame for frame in before if os.stat(self.layer(frame)).st_mtime_ns != before[frame]],
                         [1, 2])

    def test_refusals(self):
        self.render()
        self.scene.render.use_multiview = True
        self.fails(bpy.ops.postchain.behind, "one eye only", "Stereoscopy")
        self.scene.render.use_multiview = False
        self.scene.postchain.order, self.scene.render.engine = "LENS", "BLENDER_EEVEE"
        self.fails(bpy.ops.postchain.behind, "needs Cycles")
        self.scene.render.engine = "CYCLES"
        path = self.layer(3).replace("/behind", "")
        with open(path, "r+b") as file:
            file.truncate(1000)
        self.fails(bpy.ops.postchain.behind, path)
        self.assertEqual(sorted(os.listdir(os.path.dirname(path) + "/behind")),
                         ["shot_0001.exr", "shot_0002.exr"])
