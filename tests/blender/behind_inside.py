"""Inside Blender: Render Layer Behind, and Filter with it."""
import os
import sys
from unittest import mock

import bpy

import scene as scenes
from addon_case import Case, addon, outcome


class Behind(Case):
    def layer(self, frame):
        return os.path.join(self.folder, "render/behind", f"shot_{frame:04d}.exr")

    def rendered_since(self, times):
        return [frame for frame in times if os.stat(self.layer(frame)).st_mtime_ns != times[frame]]

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
        depths_of = self.peel().depths_of
        rendered = depths_of(self.layer(2).replace("/behind", ""))
        behind = depths_of(self.layer(2))
        self.assertAlmostEqual(rendered[18, 30], 3.5, places=3)  # the front of the cube
        self.assertAlmostEqual(behind[18, 30], 8, places=3)  # not its inside, at 4.5
        self.assertAlmostEqual(rendered[18, 2], 8, places=3)
        self.assertGreater(behind[18, 2], 1e9)  # nothing is behind the wall

        self.assertEqual(bpy.ops.postchain.filter(), {"FINISHED"})
        self.assertEqual(self.sidecar(2)["inputs"]["behind"], self.layer(2))

    def expect_no_inside(self):
        """The layer behind the cube in frame 1 has no inside."""
        self.scene.frame_end = 1
        self.render()
        self.assertEqual(bpy.ops.postchain.behind(), {"FINISHED"})
        depths_of = self.peel().depths_of
        self.assertAlmostEqual(depths_of(self.layer(1).replace("/behind", ""))[18, 26], 3.5, places=3)
        self.assertAlmostEqual(depths_of(self.layer(1))[18, 26], 8, places=3)

    def test_half_a_mesh_that_is_mirrored(self):
        mesh, cube = bpy.data.meshes.new("half"), bpy.data.objects["cube"]
        corners = [(x, y, z) for x in (0, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
        mesh.from_pydata(corners, [], [(4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
        cube.data = mesh
        cube.modifiers.new("mirror", "MIRROR")
        self.expect_no_inside()

    def test_linked_objects(self):
        path = os.path.join(self.folder, "library.blend")
        os.makedirs(self.folder, exist_ok=True)
        cube = bpy.data.objects["cube"]
        bpy.data.libraries.write(path, {cube})
        bpy.data.batch_remove([cube, cube.data, cube.data.materials[0]])
        with bpy.data.libraries.load(path, link=True) as (_, wanted):
            wanted.objects = ["cube"]
        self.scene.collection.objects.link(wanted.objects[0])
        self.expect_no_inside()

    def test_without_openimageio(self):
        self.scene.frame_end = 1
        self.render()
        with mock.patch.dict(sys.modules, {"OpenImageIO": None}):
            with self.assertRaisesRegex(addon().command.CommandError, "no module OpenImageIO.* install OpenImageIO"):
                addon().behind.render(addon().filter.files(self.scene), [1], "ViewLayer")

    def test_only_frames_that_lack_it(self):
        self.render()
        bpy.ops.postchain.behind()
        self.assertTrue(self.scene.postchain.behind)
        before = {frame: os.stat(self.layer(frame)).st_mtime_ns for frame in (1, 2, 3)}
        os.remove(self.layer(1))
        os.utime(self.layer(2).replace("/behind", ""))  # as if rendered again
        self.fails(bpy.ops.postchain.filter, "2 of 3 frames have no layer behind, or one older", "first: 1")
        bpy.ops.postchain.behind()
        self.assertEqual(self.rendered_since(before), [1, 2])
        bpy.ops.postchain.behind()  # none lacks it
        self.assertEqual(self.rendered_since(before), [1, 2, 3])

    def test_refusals(self):
        self.render()
        self.scene.render.use_multiview = True
        self.fails(bpy.ops.postchain.behind, "one eye only", "Stereoscopy")
        self.scene.render.use_multiview = False
        self.scene.postchain.order, self.scene.render.engine = "LENS", scenes.eevee()
        self.fails(bpy.ops.postchain.behind, "needs Cycles")
        self.scene.render.engine = "CYCLES"
        path = self.layer(3).replace("/behind", "")
        for size in (os.path.getsize(path) // 2, 1000):  # within pixels, within the header
            os.truncate(path, size)
            self.fails(bpy.ops.postchain.behind, path)
        self.assertFalse(os.path.exists(os.path.join(bpy.app.tempdir, "postchain.blend")))
        self.assertEqual(sorted(os.listdir(os.path.dirname(path) + "/behind")),
                         ["shot_0001.exr", "shot_0002.exr"])
