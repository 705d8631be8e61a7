"""Filters frames with layers and a cryptomatte by the command, and decodes them independently.

usage: layers_test.py POSTCHAIN"""
import json
import os
import struct
import subprocess

import exr
from layer_frames import CRYPTO, FRAMES, LENS, Frames, channel, largest_difference, main


class Layers(Frames):
    def test_what_is_not_asked_for_keeps_its_bits(self):
        before = exr.read(FRAMES / "layers.0002.exr")
        for options, changed in [((), ["Combined"]),
                                 (("--aovs", "Emit,GlossDir"), ["Combined", "Emit", "GlossDir"])]:
            # The lamp, which is all of Emit, is still and in focus.
            after = self.filtered("balanced", "--set", "fxaa.where=everywhere", *options)
            self.assertEqual(set(after.channels), set(before.channels))
            for name in before.channels:
                same = after.raw(name) == before.raw(name)
                layer = name.split(".")[1]
                if layer not in changed:
                    self.assertTrue(same, name)
                elif not name.endswith(".A"):
                    self.assertFalse(same, name)

    def test_plan_states_the_cost_of_layers(self):
        def planned(*options):
            return subprocess.run([self.postchain, "plan", "balanced", "-q", "-i",
                                   FRAMES / "layers.0002.exr", *options, *LENS],
                                  capture_output=True, text=True, check=True).stdout
        self.assertNotIn("cost of extra layers", planned())
        self.assertIn("cost of extra layers: 2 layers with 4 ids, 1 run, ",
                      planned("--aovs", "Emit", "--cryptomatte", "filter"))
        found = json.loads(planned("--cryptomatte", "filter", "--json"))["layer_cost"]
        self.assertEqual((found["layers"], found["ids"], found["runs"]), (1, 4, 1))

    def test_errors(self):
        pattern = str(FRAMES / "layers.####.exr")
        self.assertIn("--cryptomatte", self.run_on(pattern, "fast", "--cryptomatte", "filter=", code=2))
        self.assertIn("did you mean 'ball'?", self.run_on(pattern, "fast", "--cryptomatte", "filter=bal", code=4))

    def test_ids_that_are_apart_share_planes(self):
        """A grid of 96 ids, with four adjacent ones in the mattes of two layers."""
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
        self.run_on(path, chain, "--aovs", "Combined_key,Combined_fill", "--cryptomatte",
                    "filter")
        report, = self.sidecar()["layers"]["cryptomattes"]
        self.assertEqual(report["ids"], len(names))
        self.assertLess(report["planes"], len(names) - 8)
        after = exr.read(f"{self.folder}/out.0002.exr")
        for (layer, word), name in shown.items():
            self.assertLess(largest_difference(exr.matte(after, CRYPTO, name),
                                               after.values(channel(layer, word))), 1e-5, name)

    def test_a_chain_that_moves_no_light_keeps_the_cryptomatte(self):
        before = exr.read(FRAMES / "layers.0002.exr")
        after = self.filtered(self.chain("motion_blur: {shutter_frames: 0}"), "--cryptomatte",
                              "filter")
        for name in before.channels:
            if "Crypto" in name:
                self.assertEqual(after.raw(name), before.raw(name), name)


class FillMask(Frames):
    """Channels that say which share of a pixel came from where."""
    SHARES = ["fill.frame", "fill.neighbor", "fill.background"]

    def shares(self, picture):
        self.assertEqual([picture.channels[name][0] for name in self.SHARES], ["e"] * 3)
        values = [picture.values(name) for name in self.SHARES]
        for pixel in zip(*values):
            self.assertAlmostEqual(sum(pixel), 1, delta=1.5e-3)  # halves
        return values

    def test_is_added_and_changes_nothing_else(self):
        options = ("--aovs", "Combined_*", "--cryptomatte", "filter")
        plain = self.filtered("balanced", *options)
        masked = self.filtered("balanced", *options, "--fill-mask", "fill")
        self.assertEqual(set(masked.channels) - set(plain.channels), set(self.SHARES))
        for name in plain.channels:
            self.assertEqual(masked.raw(name), plain.raw(name), name)
        frame, neighbor, background = self.shares(masked)
        self.assertGreater(max(neighbor), 0.2)
        self.assertGreater(max(background), 0.2)
        self.assertEqual(max(frame), 1)
        self.assertEqual(self.sidecar()["layers"]["fill_mask"], self.SHARES)
        some = self.filtered("balanced", "--channels", "*.Combined.*", "--fill-mask", "fill",
                             "--set", "joint_blur.neighbors=none")
        self.assertEqual(set(some.channels),
                         {*self.SHARES, *(channel("Combined", word) for word in "RGBA")})
        self.assertEqual(max(self.shares(some)[1]), 0)

    def test_errors(self):
        self.filtered("fast", "--fill-mask", "fill")
        again = f"{self.folder}/again.0002.exr"
        os.rename(f"{self.folder}/out.0002.exr", again)
        self.assertIn("fill.frame", self.run_on(again, "fast", "--fill-mask", "fill", code=4))
        self.run_on(again, "fast", "--fill-mask", "a b", code=2)
        for options in (["--fill-mask", "second"], ["--aovs", "all"], ["--cryptomatte", "filter"]):
            self.assertIn("EXR", self.run_on(again, "fast", *options, output="out.####.png",
                                             code=2))


class WrittenChannels(Frames):
    """With --channels, layers that are not written are neither filtered nor listed."""
    COLOR = ["ViewLayer.Combined.*", "ViewLayer.Depth.*", "ViewLayer.Vector.*"]

    def only(self, *channels):
        return self.filtered("balanced", "--channels", ",".join([*self.COLOR, *channels]),
                             "--aovs", "Combined_*", "--cryptomatte", "filter")

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

    def test_a_cryptomatte_that_is_written(self):
        whole = self.filtered("balanced", "--cryptomatte", "filter")
        after = self.only(f"{CRYPTO}0*")
        self.assertEqual(self.names(after), self.names(whole))
        for name in after.channels:
            self.assertEqual(after.raw(name), whole.raw(name), name)
        self.assertNotIn("filtered", self.sidecar()["layers"])

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
        """Attributes without channels, as other programs write them, and an unknown hash."""
        bare = exr.read(FRAMES / "layers.0002.exr")
        for name in [name for name in bare.channels if "Crypto" in name]:
            del bare.channels[name]
        hashed = exr.read(FRAMES / "layers.0002.exr")
        hashed.attributes["cryptomatte/542cafa/hash"] = "string", b"crc32"
        path = f"{self.folder}/odd.0002.exr"
        for picture, why, filtered in ((bare, "are missing", 0), (hashed, "its hash is", 4)):
            exr.write(path, picture)
            self.run_on(path, "balanced", "--set", "fxaa.matte=Combined_key.R")
            self.assertIn(why, self.run_on(path, "balanced", "--set",
                                           "fxaa.matte=cryptomatte:ball", code=4))
            self.assertIn(why, self.run_on(path, "balanced", "--cryptomatte", "filter",
                                           code=filtered))
        # Ids stay unchanged, whatever their hash.
        self.run_on(path, "balanced", "--aovs", "all")
        self.assertEqual(exr.read(f"{self.folder}/out.0002.exr").raw(f"{CRYPTO}00.r"),
                         hashed.raw(f"{CRYPTO}00.r"))


class LayersOfSomeFrames(Frames):
    """Neighbors with other layers than the frame do not change color."""
    # Frame 2 reads both neighbors; the other frames are copies of its images.
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
        plain, first, alone = (self.second("all"), self.second("first", "--aovs", "all"),
                               self.second("alone", "--aovs", "all"))
        self.assertFalse(self.same(plain, alone, "Combined"))
        after = self.second("all", "--aovs", "all")
        self.assertTrue(self.same(after, plain, "Combined"))
        self.assertTrue(self.same(after, first, "key"))
        self.assertFalse(self.same(after, alone, "key"))
        self.assertTrue(self.same(after, alone, "fill"))
        self.assertIn("without the frame before, which lacks these layers: ViewLayer.fill; render",
                      self.messages)
        self.assertIn("without the frame after, which lacks these layers: ViewLayer.fill, "
                      "ViewLayer.key; render", self.messages)
        self.assertNotIn("missing_neighbors", self.sidecar()["plan"])
        # Layers that all frames have contain part of the color everywhere.
        for word in "RGB":
            half = [value / 2 for value in after.values(channel("Combined", word))]
            self.assertLess(largest_difference(after.values(channel("zed", word)), half), 1e-5)
        after = self.second("all", "--aovs", "fill")  # which no other frame has
        self.assertTrue(self.same(after, plain, "Combined"))
        self.assertTrue(self.same(after, alone, "fill"))

    def test_a_cryptomatte_that_a_neighbor_lacks(self):
        self.write("all", (1, 2, 3), crypto=(2,))
        self.write("alone", (2,))
        plain = self.second("all")
        after = self.second("all", "--cryptomatte", "filter")
        self.assertTrue(self.same(after, plain, "Combined"))
        self.assertIn(f"lacks these layers: {CRYPTO}; render", self.messages)
        alone = self.second("alone", "--cryptomatte", "filter")
        self.assertTrue(self.same(after, alone, "CryptoObject0"))


if __name__ == "__main__":
    main()
