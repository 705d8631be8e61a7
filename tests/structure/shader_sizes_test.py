"""A texture may be larger than the frame (chain/base/area.h), so shaders of passes take sizes from their uniforms.
Only the number of an array's layers is what the texture has."""
import re

import files

QUERY = re.compile(r"\b(textureSize|imageSize)\(\w+(, 0)?\)(\.z)?", re.A)
# They make inputs, and run on whole textures.
OTHERS = ("shaders/scenes/", "shaders/bench/")


def faults_of(file):
    return [place for place, found in file.matches(QUERY) if not found[3]]


class Shaders(files.Case):
    def test_take_sizes_from_uniforms(self):
        shaders = [file for file in files.files_below(["shaders"], {".comp", ".glsl"})
                   if not file.name.startswith(OTHERS)]
        self.expect_none(fault for file in shaders for fault in faults_of(file))
        self.assertGreater(sum(len(file.matches(QUERY)) for file in shaders), 2)

    def test_faults_are_seen(self):
        lines = ["textureSize(a, 0).z", "textureSize(a, 0).x", "imageSize(a)", "imageSize(a).z"]
        self.assertEqual(faults_of(files.File("a.comp", "\n".join(lines))),
                         ["a.comp:2: textureSize(a, 0).x", "a.comp:3: imageSize(a)"])
