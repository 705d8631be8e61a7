"""Renders a scene of scenes/ with Cycles (docs/scenes.md):

blender -b -P tools/research/cycles/render.py -- SCENE OUT [--frames 1-12] ...
"""
import importlib
import os
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import renderer  # noqa: E402
import request  # noqa: E402

options = request.parse_options(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])
renderer.render_scene(importlib.import_module(f"scenes.{options.scene}").SCENE, options)
