"""Inside Blender: simulations, which another Blender shows only from their caches."""
import os

import bpy

from addon_case import Case, addon


class Simulation(Case):
    def unbaked(self):
        return addon().simulation.unbaked(self.scene)

    def test_layer_behind_shows_what_is_baked_on_disk(self):
        cloth = bpy.data.objects["wall"].modifiers.new("cloth", "CLOTH")
        self.scene.gravity = 0, 1000, 0  # away from the camera
        self.says("not baked: cloth of 'wall'", wrong=False)
        self.render()
        for operator in (bpy.ops.postchain.behind, bpy.ops.postchain.compare):
            self.fails(operator, "not baked: cloth of 'wall'", "Bake All Dynamics")
        bpy.ops.wm.save_as_mainfile(filepath=os.path.join(self.folder, "shot.blend"))
        cloth.point_cache.frame_end, cloth.point_cache.use_disk_cache = 3, True
        bpy.ops.ptcache.bake_all(bake=True)
        self.assertEqual(self.problems(), [])
        self.render()
        self.assertEqual(bpy.ops.postchain.behind(), {"FINISHED"})
        depths_of = self.peel().depths_of
        rendered = depths_of(os.path.join(self.folder, "render/shot_0003.exr"))
        behind = depths_of(os.path.join(self.folder, "render/behind/shot_0003.exr"))
        self.assertGreater(rendered[18, 2], 8.5)
        self.assertAlmostEqual(behind[18, 34], rendered[18, 2], places=3)
        self.assertEqual([name for name in os.listdir(bpy.app.tempdir) if "blendcache" in name], [])
        self.assertTrue(os.listdir(os.path.join(self.folder, "blendcache_shot")))

    def test_kinds(self):
        cube = bpy.data.objects["cube"]
        cube.modifiers.new("particles", "PARTICLE_SYSTEM")
        settings = cube.particle_systems[0].settings
        self.assertEqual(self.unbaked(), [f"particles '{cube.particle_systems[0].name}' of 'cube'"])
        for key, value in (("type", "HAIR"), ("physics_type", "NO")):
            setattr(settings, key, value)
            self.assertEqual(self.unbaked(), [])
            settings.type = "EMITTER"
        cube.modifiers.new("soft", "SOFT_BODY")
        bpy.context.view_layer.objects.active = cube
        bpy.ops.rigidbody.object_add()
        self.assertEqual(self.unbaked(), ["soft body of 'cube'", "rigid bodies"])
        cube.modifiers["soft"].show_render = False
        cube.rigid_body.type = "PASSIVE"
        self.assertEqual(self.unbaked(), [])

    def test_paths_in_a_copy(self):
        cube = bpy.data.objects["cube"]
        cube.modifiers.new("particles", "PARTICLE_SYSTEM")
        cache = cube.particle_systems[0].point_cache
        cache.use_external, cache.filepath = True, "//cache"
        nodes = cube.modifiers.new("nodes", "NODES")
        if hasattr(nodes, "bake_directory"):  # since 4.1
            nodes.bake_directory = "//blendcache_shot/nodes"
        addon().simulation.find_caches("/a/b")
        self.assertEqual(cache.filepath, "/a/b/cache")
        self.assertEqual(getattr(nodes, "bake_directory", "/a/b/blendcache_shot/nodes"), "/a/b/blendcache_shot/nodes")
