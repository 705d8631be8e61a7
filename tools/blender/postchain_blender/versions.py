"""The differences between versions of Blender, 3.4 to 5, in one place. camera.py and peel.py stand alone: they
read only what every version has, except the shutter's position."""
import bpy


def eevee_has_motion_vectors():
    return bpy.app.version >= (4, 2, 0)


def eevee_motion_blur_path(scene):
    """EEVEE's own switch of motion blur; None since 4.2: it uses the render setting of Cycles."""
    return "eevee.use_motion_blur" if hasattr(scene.eevee, "use_motion_blur") else None


def media_type_path(scene):
    """The setting that chooses image, multilayer image or movie before the file format does; None before 5."""
    return "render.image_settings.media_type" if hasattr(scene.render.image_settings, "media_type") else None


def node_tree(scene):
    """The compositor's nodes of the scene: its own tree, since 5 a node group."""
    if hasattr(scene, "compositing_node_group"):
        if scene.compositing_node_group is None:
            scene.compositing_node_group = bpy.data.node_groups.new("Compositing", "CompositorNodeTree")
        return scene.compositing_node_group
    scene.use_nodes = True
    return scene.node_tree


def has_strips(scene):
    """Whether the scene's sequencer has strips: called sequences before 4.4."""
    editor = scene.sequence_editor
    strips = getattr(editor, "strips_all", None) or getattr(editor, "sequences_all", ())
    return len(strips) > 0


def curves(animation):
    """The F-curves of a data block's animation and its drivers. In 5 an action has a bag of curves for each slot."""
    found, action = list(animation.drivers), animation.action
    if action is None:
        return found
    if hasattr(action, "fcurves"):
        return found + list(action.fcurves)
    for strip in (strip for layer in action.layers for strip in layer.strips):
        bag = strip.channelbag(animation.action_slot) if animation.action_slot else None
        found += bag.fcurves if bag else ()
    return found


def eyedropper_takes_a_path():
    """Whether the eyedropper of depths can be a button beside a property."""
    return "prop_data_path" in bpy.ops.ui.eyedropper_depth.get_rna_type().properties
