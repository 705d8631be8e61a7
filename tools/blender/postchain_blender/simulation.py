"""Simulations and their caches. A Blender in the background renders the frames of a copy of the file one by one, so
it shows a simulation only from a cache."""
import os
import shutil

import bpy


def _is_cached(particles):
    """Whether a particle system has a cache: as Blender's panel Cache decides it."""
    settings = particles.settings
    if settings.is_fluid or settings.physics_type in {"NO", "KEYED"}:
        return False
    return settings.type != "HAIR" or particles.use_hair_dynamics


def _caches(thing):
    """[(kind, point cache)] of an object as it is rendered."""
    found = []
    for modifier in thing.modifiers:
        if not modifier.show_render:
            continue
        if modifier.type == "PARTICLE_SYSTEM" and _is_cached(modifier.particle_system):
            found.append((f"particles '{modifier.particle_system.name}'", modifier.particle_system.point_cache))
        elif modifier.type in {"CLOTH", "SOFT_BODY"}:
            found.append((modifier.type.replace("_", " ").lower(), modifier.point_cache))
        elif modifier.type == "DYNAMIC_PAINT" and modifier.canvas_settings:
            found += [("dynamic paint", surface.point_cache)
                      for surface in modifier.canvas_settings.canvas_surfaces
                      if surface.is_active and surface.is_cache_user]
    return found


def _has_unbaked_fluid(thing):
    return any(modifier.type == "FLUID" and modifier.show_render and modifier.fluid_type == "DOMAIN"
               and not modifier.domain_settings.has_cache_baked_data for modifier in thing.modifiers)


def _moves_rigid_bodies(world):
    return bool(world and world.enabled and world.collection and any(
        thing.rigid_body and thing.rigid_body.type == "ACTIVE" for thing in world.collection.objects))


def unbaked(scene):
    """Texts: the simulations of the scene that are not baked."""
    found = []
    for thing in scene.objects:
        if thing.hide_render:
            continue
        found += [f"{kind} of '{thing.name}'" for kind, cache in _caches(thing) if not cache.is_baked]
        if _has_unbaked_fluid(thing):
            found.append(f"fluid of '{thing.name}'")
    world = scene.rigidbody_world
    if _moves_rigid_bodies(world) and not world.point_cache.is_baked:
        found.append("rigid bodies")
    return found


def cache_folder(path):
    """The folder of the caches on disk of a .blend file, which Blender names after the file."""
    folder, name = os.path.split(path)
    return os.path.join(folder, "blendcache_" + os.path.splitext(name)[0])


def carry_caches(copy):
    """Gives a copy of this file its caches on disk. A file that was never saved has none."""
    source, target = cache_folder(bpy.data.filepath), cache_folder(copy)
    delete(target)
    if not bpy.data.filepath or not os.path.isdir(source):
        return
    if os.name == "nt":  # links need a privilege there
        shutil.copytree(source, target)
    else:
        os.symlink(source, target)


def find_caches(folder):
    """In a copy of a file: paths of caches that Blender does not adapt to the copy's place lead to those of the file
    in `folder`."""
    for thing in bpy.data.objects:
        for modifier in thing.modifiers:
            if modifier.type == "NODES" and hasattr(modifier, "bake_directory"):
                for owner, key in [(modifier, "bake_directory"), *((bake, "directory") for bake in modifier.bakes)]:
                    _make_absolute(owner, key, folder)
        for _, cache in _caches(thing):
            if cache.use_external:
                _make_absolute(cache, "filepath", folder)


def _make_absolute(owner, key, folder):
    path = getattr(owner, key)
    if path.startswith("//"):
        setattr(owner, key, os.path.join(folder, path[2:]))


def delete(path):
    """A file, a link, or a folder; or nothing if there is none."""
    if os.path.isdir(path) and not os.path.islink(path):
        shutil.rmtree(path)
    elif os.path.lexists(path):
        os.remove(path)
