"""Filters frames with layers and a cryptomatte by the command, and decodes them apart from it.

usage: layers_test.py POSTCHAIN"""
import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

import exr

FRAMES = pathlib.Path(__file__).resolve().parents[1] / "data/layers"
GROUPS = ["Combined_key", "Combined_fill", "Combined_glow"]
CRYPTO = "ViewLayer.CryptoObject"
OBJECTS = ["wall", "post", "lamp", "ball"]
LENS = ["--set", "camera.focal_length_mm=35", "--set", "camera.sensor_width_mm=36", "--set",
        "camera.f_stop=0.7", "--set", "camera.focus_distance=3"]
CHAINS = ["paper", "dof_first", "balanced", "best"]


def channel(layer, word):
    return f"ViewLayer.{layer}.{word}"


def largest_difference(first, second):
    return max(abs(a - b) for a, b in zip(first, second))


class Frames(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.folder = self.temporary.name

    def run_on(self, pattern, chain, *options, code=0):
        done = subprocess.run(
            [POSTCHAIN, "run", chain, "-i", pattern, "-o", f"{self.folder}/out.####.exr",
             "--on-existing", "overwrite", *LENS, *options], capture_output=True, text=True,
            check=False)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def chain(self, *passes):
        path = f"{self.folder}/chain.yaml"
        with open(path, "w", encoding="utf-8") as file:
            file.write("\n  - ".join(["postchain: 1\npasses:", *passes]) + "\n")
        return path

    def filtered(self, chain, *options, frame=2):
        self.messages = self.run_on(f"{FRAMES}/layers.####.exr", chain, "--frames", str(frame),
                                    *options)
        return exr.read(f"{self.folder}/out.{frame:04}.exr")

    def sidecar(self, frame=2):
        with open(f"{self.folder}/out.{frame:04}.exr.json", encoding="utf-8") as file:
            return json.load(file)

    def matte_frame(self):
        """A frame whose light group key holds the mattes of three objects."""
        picture = exr.read(FRAMES / "layers.0002.exr")
        for word, name in zip("RGB", OBJECTS[1:]):
            picture.channels[channel("Combined_key", word)] = "f", exr.matte(picture, CRYPTO, name)
        path = f"{self.folder}/mattes.0002.exr"
        exr.write(path, picture)
        return path, picture


class Layers(Frames):
    def largest_gap(self, picture):
        """Between the sum of the light groups and the color."""
        gap = 0
        for word in "RGB":
            total = [sum(group) for group in zip(*(picture.values(channel(g, word))
                                                   for g in GROUPS))]
            gap = max(gap, largest_difference(total, picture.values(channel("Combined", word))))
        return gap

    def test_lights_that_sum_to_the_color_still_do(self):
        before = exr.read(FRAMES / "layers.0002.exr")
        self.assertLess(self.largest_gap(before), 2e-6)
        for chain in CHAINS:
            after = self.filtered(chain, "--layers", "Combined_*")
            self.assertLess(self.largest_gap(after), 1e-5, chain)
            for group in GROUPS:
                self.assertGreater(largest_difference(after.values(channel(group, "R")),
                                                      before.values(channel(group, "R"))), 0.05)
            self.assertEqual(self.sidecar()["layers"]["filtered"],
                             [f"ViewLayer.{group}" for group in sorted(GROUPS)])

    def test_what_is_not_asked_for_keeps_its_bits(self):
        before = exr.read(FRAMES / "layers.0002.exr")
        for options, changed in [((), ["Combined"]),
                                 (("--layers", "Emit,GlossDir"), ["Combined", "Emit", "GlossDir"]),
                                 (("--layers", "all"), ["Combined", *GROUPS, "DiffDir", "Emit",
                                                        "GlossDir"])]:
            after = self.filtered("balanced", *options)
            self.assertEqual(set(after.channels), set(before.channels))
            for name in before.channels:
                same = after.raw(name) == before.raw(name)
                layer = name.split(".")[1]
                if layer not in changed:
                    self.assertTrue(same, name)
                elif not name.endswith(".A"):
                    self.assertFalse(same, name)

    def test_what_is_left_stands_in_the_sidecar(self):
        self.filtered("balanced", "--layers", "all")
        left = {one["name"]: one["why"] for one in self.sidecar()["layers"]["left"]}
        self.assertEqual(left["ViewLayer.Normal"], "is not R, G, B")
        self.assertEqual(left["ViewLayer.CryptoObject01"], "is a cryptomatte")
        self.assertNotIn("ViewLayer.Combined_key", left)
        self.assertIn("--cryptomatte filter", self.messages)
        self.filtered("balanced")
        left = {one["name"]: one["why"] for one in self.sidecar()["layers"]["left"]}
        self.assertEqual(left["ViewLayer.Emit"], "not asked for")
        self.assertNotIn("cryptomatte", self.messages)

    def test_plan_lists_layers(self):
        done = subprocess.run([POSTCHAIN, "plan", "balanced", "-q", "-i",
                               FRAMES / "layers.0002.exr", "--layers", "Emit", *LENS],
                              capture_output=True, text=True, check=True)
        self.assertIn("layers filtered too: ViewLayer.Emit\n", done.stdout)
        self.assertIn("ViewLayer.Normal", done.stdout)

    def test_errors(self):
        pattern = str(FRAMES / "layers.####.exr")
        for layers, message in [("Combined_kez", "did you mean 'Combined_key'?"),
                                ("Normal", "is not R, G, B, and data is never averaged"),
                                ("CryptoObject00", "is a cryptomatte, and data is never averaged")]:
            self.assertIn(message, self.run_on(pattern, "fast", "--layers", layers, code=2))

    def test_a_filtered_cryptomatte_has_the_filtered_mattes(self):
        path, before = self.matte_frame()
        for chain in ("paper", "balanced"):
            self.run_on(path, chain, "--layers", "Combined_key", "--cryptomatte", "filter")
            after = exr.read(f"{self.folder}/out.0002.exr")
            for word, name in zip("RGB", OBJECTS[1:]):
                filtered = after.values(channel("Combined_key", word))
                self.assertLess(largest_difference(exr.matte(after, CRYPTO, name), filtered), 1e-5,
                                (chain, name))
            self.assertGreater(largest_difference(exr.matte(after, CRYPTO, "ball"),
                                                  exr.matte(before, CRYPTO, "ball")), 0.1)
            report, = self.sidecar()["layers"]["cryptomattes"]
            self.assertEqual((report["name"], report["ids"], report["pixels_short"]),
                             (CRYPTO, len(OBJECTS), 0))

    def test_ids_that_are_apart_share_planes(self):
        """A grid of 96 ids, four of them beside each other in the mattes of two layers."""
        picture = exr.read(FRAMES / "layers.0002.exr")
        size, names = picture.width * picture.height, []
        ids = [0] * size
        for y in range(0, picture.height, 7):
            for x in range(0, picture.width, 8):
                names.append(f"cell {x} {y}")
                for row in range(y, min(y + 7, picture.height)):
                    for column in range(x, min(x + 8, picture.width)):
                        ids[row * picture.width + column] = exr.crypto_id(names[-1])
        floats = struct.unpack(f"<{size}f", struct.pack(f"<{size}I", *ids))
        for level in ("00", "01"):
            for word in "rgba":
                picture.channels[f"{CRYPTO}{level}.{word}"] = "f", [0.0] * size
        picture.channels[f"{CRYPTO}00.r"] = "f", list(floats)
        picture.channels[f"{CRYPTO}00.g"] = "f", [0.75] * size
        shown = {("Combined_key", word): name for word, name in zip("RGB", names[40:43])}
        shown |= {("Combined_fill", word): name for word, name in zip("RGB", names[52:55])}
        for (layer, word), name in shown.items():
            picture.channels[channel(layer, word)] = "f", exr.matte(picture, CRYPTO, name)
        path = f"{self.folder}/grid.0002.exr"
        exr.write(path, picture)
        chain = self.chain("motion_blur: {mode: guertin, max_blur_px: 8, shutter_frames: 0.5}")
        self.run_on(path, chain, "--layers", "Combined_key,Combined_fill", "--cryptomatte",
                    "filter")
        report, = self.sidecar()["layers"]["cryptomattes"]
        self.assertEqual(report["ids"], len(names))
        self.assertLess(report["planes"], len(names) - 8)
        after = exr.read(f"{self.folder}/out.0002.exr")
        for (layer, word), name in shown.items():
            self.assertLess(largest_difference(exr.matte(after, CRYPTO, name),
                                               after.values(channel(layer, word))), 1e-5, name)

    def test_coverages_of_a_filtered_cryptomatte_add_up_to_alpha(self):
        for chain in ("paper", "balanced"):
            after = self.filtered(chain, "--cryptomatte", "filter")
            total = [sum(all_) for all_ in zip(*(exr.matte(after, CRYPTO, name)
                                                 for name in OBJECTS))]
            self.assertLess(max(total), 1 + 1e-5)
            self.assertLess(largest_difference(total, after.values(channel("Combined", "A"))), 1e-5)
            # The largest coverage comes first.
            ranks = [after.values(f"{CRYPTO}{level}.{word}") for level in ("00", "01")
                     for word in "ga"]
            for pixel in zip(*ranks):
                self.assertEqual(sorted(pixel, reverse=True), list(pixel))

    def test_a_chain_that_moves_no_light_keeps_the_cryptomatte(self):
        before = exr.read(FRAMES / "layers.0002.exr")
        after = self.filtered(self.chain("motion_blur: {shutter_frames: 0}"), "--cryptomatte",
                              "filter")
        for name in before.channels:
            if "Crypto" in name:
                self.assertEqual(after.raw(name), before.raw(name), name)


class WrittenChannels(Frames):
    """With --channels: what is not written is not filtered, nor said to be there."""
    COLOR = ["ViewLayer.Combined.*", "ViewLayer.Depth.*", "ViewLayer.Vector.*"]

    def only(self, *channels, options=()):
        return self.filtered("balanced", "--channels", ",".join([*self.COLOR, *channels]),
                             "--layers", "Combined_*", "--cryptomatte", "filter", *options)

    def names(self, picture):
        return {name for name in picture.attributes if name.startswith("cryptomatte/")}

    def test_a_cryptomatte_that_is_not_written(self):
        before = exr.read(FRAMES / "layers.0002.exr")
        after = self.only("ViewLayer.Combined_key.*")
        self.assertEqual(len(self.names(before)), 4)
        self.assertEqual(self.names(after), set())
        self.assertIn("cryptomatte/542cafa/manifest", " ".join(self.sidecar()["write_notes"]))
        found = self.sidecar()["layers"]
        self.assertEqual(found["filtered"], ["ViewLayer.Combined_key"])
        self.assertNotIn("cryptomattes", found)
        left = {one["name"]: one["why"] for one in found["left"]}
        for name in ("Combined_fill", "CryptoObject00", "Normal"):
            self.assertEqual(left[f"ViewLayer.{name}"], "is not written (--channels)")
        whole = self.filtered("balanced", "--layers", "Combined_*")
        for name in after.channels:
            self.assertEqual(after.raw(name), whole.raw(name), name)

    def test_a_cryptomatte_that_is_written(self):
        whole = self.filtered("balanced", "--cryptomatte", "filter")
        after = self.only(f"{CRYPTO}0*")
        self.assertEqual(self.names(after), self.names(whole))
        for name in after.channels:
            self.assertEqual(after.raw(name), whole.raw(name), name)
        self.assertEqual(self.sidecar()["layers"]["cryptomattes"][0]["name"], CRYPTO)
        self.assertNotIn("filtered", self.sidecar()["layers"])
        # Its first ranks are a cryptomatte too.
        self.assertEqual(self.names(self.only(f"{CRYPTO}00.*")), self.names(whole))
        self.assertEqual(self.names(self.only(f"{CRYPTO}01.*", f"{CRYPTO}00.r")), set())

    def test_the_output_can_be_an_input(self):
        self.only("ViewLayer.Combined_key.*")
        again = f"{self.folder}/again.0002.exr"
        os.rename(f"{self.folder}/out.0002.exr", again)
        self.run_on(again, "balanced", "--cryptomatte", "filter", "--set",
                    "fxaa.matte=Combined_key.R")
        self.assertIn("the file has no cryptomatte",
                      self.run_on(again, "balanced", "--set", "fxaa.matte=cryptomatte:ball",
                                  code=4))

    def test_a_mask_needs_no_cryptomatte(self):
        """Attributes without channels, as other programs leave them, and an unknown hash."""
        bare = exr.read(FRAMES / "layers.0002.exr")
        for name in [name for name in bare.channels if "Crypto" in name]:
            del bare.channels[name]
        hashed = exr.read(FRAMES / "layers.0002.exr")
        hashed.attributes["cryptomatte/542cafa/hash"] = "string", b"crc32"
        path = f"{self.folder}/odd.0002.exr"
        for picture, why, filtered in ((bare, "are not there", 0), (hashed, "its hash is", 4)):
            exr.write(path, picture)
            self.run_on(path, "balanced", "--set", "fxaa.matte=Combined_key.R")
            self.assertIn(why, self.run_on(path, "balanced", "--set",
                                           "fxaa.matte=cryptomatte:ball", code=4))
            self.assertIn(why, self.run_on(path, "balanced", "--cryptomatte", "filter",
                                           code=filtered))
        # Ids stay ids, whatever their hash is.
        self.run_on(path, "balanced", "--layers", "all")
        self.assertEqual(exr.read(f"{self.folder}/out.0002.exr").raw(f"{CRYPTO}00.r"),
                         hashed.raw(f"{CRYPTO}00.r"))


class LayersOfSomeFrames(Frames):
    """Neighbors with other layers than the frame's: color does not change for that."""
    # Frame 2 reads both neighbors; the last two are made of its pictures.
    LAYERS = {1: ["key", "zed"], 2: ["zed", "fill", "key"], 3: ["zed"]}

    def write(self, folder, frames, crypto=(1, 2, 3)):
        os.mkdir(f"{self.folder}/{folder}")
        for frame in frames:
            picture = exr.read(FRAMES / f"layers.{2 - frame % 2:04}.exr")
            for name in list(picture.channels):
                if not name.split(".")[1] in ("Combined", "Depth", "Vector") and not (
                        frame in crypto and name.startswith(CRYPTO)):
                    del picture.channels[name]
            for at, layer in enumerate(("key", "fill", "zed")):
                for word in "RGB":
                    if layer in self.LAYERS[frame]:
                        source = picture.values(channel("Combined", word))
                        picture.channels[channel(layer, word)] = "f", [
                            value * (at + 1) / 6 for value in source]
            if frame not in crypto:
                for name in [one for one in picture.attributes if one.startswith("cryptomatte/")]:
                    del picture.attributes[name]
            exr.write(f"{self.folder}/{folder}/in.{frame:04}.exr", picture)

    def second(self, folder, *options):
        self.messages = self.run_on(f"{self.folder}/{folder}/in.####.exr", "balanced", "--frames",
                                    "2", *options)
        return exr.read(f"{self.folder}/out.0002.exr")

    def same(self, first, second, layer):
        names = [name for name in first.channels if name.split(".")[1].startswith(layer)]
        self.assertGreater(len(names), 2)
        return all(first.raw(name) == second.raw(name) for name in names)

    def test_each_layer_is_filtered_with_the_neighbors_that_have_it(self):
        for folder, frames in (("all", (1, 2, 3)), ("first", (1, 2)), ("alone", (2,))):
            self.write(folder, frames)
        plain, first, alone = (self.second("all"), self.second("first", "--layers", "all"),
                               self.second("alone", "--layers", "all"))
        self.assertFalse(self.same(plain, alone, "Combined"))
        after = self.second("all", "--layers", "all")
        self.assertTrue(self.same(after, plain, "Combined"))
        self.assertTrue(self.same(after, first, "key"))
        self.assertFalse(self.same(after, alone, "key"))
        self.assertTrue(self.same(after, alone, "fill"))
        self.assertIn("without the frame before, which has no such layers: ViewLayer.fill\n",
                      self.messages)
        self.assertIn("without the frame after, which has no such layers: ViewLayer.fill, "
                      "ViewLayer.key\n", self.messages)
        self.assertNotIn("missing_neighbors", self.sidecar()["plan"])
        # What all have is a part of color everywhere.
        for word in "RGB":
            half = [value / 2 for value in after.values(channel("Combined", word))]
            self.assertLess(largest_difference(after.values(channel("zed", word)), half), 1e-5)
        # No layer that all have, and none that any has.
        for layers in ("key,fill", "fill"):
            after = self.second("all", "--layers", layers)
            self.assertTrue(self.same(after, plain, "Combined"), layers)
            self.assertTrue(self.same(after, alone, "fill"), layers)

    def test_a_cryptomatte_that_a_neighbor_lacks(self):
        self.write("all", (1, 2, 3), crypto=(2,))
        self.write("alone", (2,))
        plain = self.second("all")
        after = self.second("all", "--cryptomatte", "filter")
        self.assertTrue(self.same(after, plain, "Combined"))
        self.assertIn(f"has no such layers: {CRYPTO}\n", self.messages)
        alone = self.second("alone", "--cryptomatte", "filter")
        self.assertTrue(self.same(after, alone, "CryptoObject0"))


class Mattes(Frames):
    """Passes that leave an object as it is."""

    def with_matte(self, matte, *options, pattern=None, code=0):
        chain = self.chain(f'joint_blur: {{samples: 16, matte: "{matte}"}}')
        out = self.run_on(pattern or f"{FRAMES}/layers.####.exr", chain, "--frames", "2", *options,
                          code=code)
        return out if code else exr.read(f"{self.folder}/out.0002.exr")

    def check_held(self, after, matte, names):
        """Where nothing but the objects is, the pixels are those of the input."""
        before = exr.read(FRAMES / "layers.0002.exr")
        plain = self.filtered(self.chain("joint_blur: {samples: 16}"))
        covered = [sum(one) for one in zip(*(exr.matte(before, CRYPTO, name) for name in names))]
        inside = [i for i, value in enumerate(covered) if value == 1]
        self.assertGreater(len(inside), 50)
        name = channel("Combined", "R")
        was, plainly, now = (picture.values(name) for picture in (before, plain, after))
        self.assertEqual([was[i] for i in inside], [now[i] for i in inside], matte)
        self.assertGreater(max(abs(was[i] - plainly[i]) for i in inside), 0.05)

    def test_names_of_a_cryptomatte(self):
        for matte, names in [("cryptomatte:ball", ["ball"]),
                             ("CryptoObject:ball", ["ball"]),
                             ("ViewLayer.CryptoObject:ball, post", ["ball", "post"]),
                             ("cryptomatte:b*", ["ball"])]:
            after = self.with_matte(matte)
            record, = self.sidecar()["layers"]["mattes"]
            self.assertEqual(record["name"], matte)
            ids = ", ".join(f"{one:08x}" for one in sorted(map(exr.crypto_id, names)))
            self.assertEqual(record["from"], f"ids {ids} of {CRYPTO}")
            self.check_held(after, matte, names)

    def test_a_channel(self):
        path, _ = self.matte_frame()
        by_name = self.with_matte("cryptomatte:ball", pattern=path)
        by_channel = self.with_matte("Combined_key.B", pattern=path)
        for word in "RGBA":
            name = channel("Combined", word)
            self.assertEqual(by_name.raw(name), by_channel.raw(name))

    def test_without_a_manifest(self):
        picture = exr.read(FRAMES / "layers.0002.exr")
        del picture.attributes["cryptomatte/542cafa/manifest"]
        path = f"{self.folder}/bare.0002.exr"
        exr.write(path, picture)
        chain = self.chain("joint_blur: {samples: 16, neighbors: none}")
        out = self.run_on(path, chain, "--set", "passes[0].matte=cryptomatte:ball")
        self.assertIn("it has no manifest: 'ball' is found by the hash of its name", out)
        named = exr.read(f"{self.folder}/out.0002.exr")
        with_manifest = self.filtered(chain, "--set", "joint_blur.matte=cryptomatte:ball")
        self.assertEqual(named.raw(channel("Combined", "R")),
                         with_manifest.raw(channel("Combined", "R")))
        out = self.run_on(path, chain, "--set", "passes[0].matte=cryptomatte:bal")
        self.assertIn("no pixel of cryptomatte ViewLayer.CryptoObject has such an id", out)
        self.assertIn("patterns need a manifest",
                      self.with_matte("cryptomatte:b*", pattern=path, code=4))

    def test_a_manifest_is_never_replaced(self):
        picture = exr.read(FRAMES / "layers.0002.exr")
        manifest = picture.attributes.pop("cryptomatte/542cafa/manifest")[1]
        chain = self.chain('fxaa: {matte: "cryptomatte:ball"}')
        # By the sidecar of this frame, of another, and as the name of a link.
        for output, place in (("out.0001.exr.json", ""), ("out.0002.exr.json", ""),
                              ("out.0002.exr.json", "names.json")):
            picture.attributes["cryptomatte/542cafa/manif_file"] = (
                "string", (place or output).encode())
            exr.write(f"{self.folder}/in.0002.exr", picture)
            shutil.copy(FRAMES / "layers.0001.exr", f"{self.folder}/in.0001.exr")
            path = pathlib.Path(self.folder) / output
            path.write_bytes(manifest)
            if place:
                os.symlink(path, f"{self.folder}/{place}")
            message = self.run_on(f"{self.folder}/in.####.exr", chain, code=2)
            self.assertIn(f"the manifest of cryptomatte {CRYPTO}", message)
            self.assertIn("--no-sidecar", message)
            self.assertEqual(path.read_bytes(), manifest)
            self.run_on(f"{self.folder}/in.####.exr", chain, "--no-sidecar")
            self.assertEqual(path.read_bytes(), manifest)
            path.unlink()

    def test_bad_mattes(self):
        for matte, message in [
                ("cryptomatte:bal", "no 'bal' in the cryptomatte (did you mean 'ball'?)"),
                ("cryptomatte:xyz", "it has ball, lamp, post, wall"),
                ("cryptomatte:", "no name is given after the colon"),
                ("cryptomatte:x*", "no 'x*' in the cryptomatte"),
                ("Combined_key.H", "no such channel (did you mean"),
                ("R", "such channels; give the whole name")]:
            self.assertIn(message, self.with_matte(matte, code=4), matte)

    def test_an_unmoved_object_is_one_rendered_at_rest(self):
        picture = exr.read(FRAMES / "layers.0002.exr")
        ball = [float(m > 0.5) for m in exr.matte(picture, CRYPTO, "ball")]
        picture.channels[channel("Combined_key", "B")] = "f", ball
        vectors = [channel("Vector", word) for word in "XYZW"]
        self.assertGreater(max(abs(v) * m for name in vectors
                               for v, m in zip(picture.values(name), ball)), 5)
        moving, still = (f"{self.folder}/{name}.0002.exr" for name in ("moving", "still"))
        exr.write(moving, picture)
        for name in vectors:
            picture.channels[name] = "f", [v * (1 - m) for v, m in zip(picture.values(name), ball)]
        exr.write(still, picture)
        matte = "matte: Combined_key.B, matte_effect: unmoved"
        for step in ("joint_blur: {samples: 16%s}", "motion_blur: {mode: guertin%s}"):
            shown = []
            for path, rest in ((still, ""), (moving, ", " + matte), (moving, "")):
                self.run_on(path, self.chain(step % rest))
                shown.append(exr.read(f"{self.folder}/out.0002.exr").raw(channel("Combined", "R")))
            self.assertEqual(shown[0], shown[1], step)
            self.assertNotEqual(shown[0], shown[2], step)

    def test_bad_effects(self):
        pattern = f"{FRAMES}/layers.####.exr"
        for step, message in [
                ("joint_blur: {matte_effect: unmoved}", "none is named; name one with matte"),
                ("fxaa: {matte: 'cryptomatte:ball', matte_effect: unmoved}",
                 "passes[0].matte_effect: matte_effect is unmoved, and fxaa moves nothing"),
                ("joint_blur: {matte: 'cryptomatte:ball', matte_effect: unmove}",
                 "did you mean 'unmoved'?")]:
            self.assertIn(message, self.run_on(pattern, self.chain(step), code=3), step)


if __name__ == "__main__":
    POSTCHAIN = sys.argv.pop(1)
    unittest.main()
