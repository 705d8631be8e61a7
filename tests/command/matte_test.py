"""Mattes from a cryptomatte or from channels leave objects unchanged.

usage: matte_test.py POSTCHAIN"""
import os
import pathlib
import shutil

import exr
from layer_frames import CRYPTO, Frames, FRAMES, channel, main


class Mattes(Frames):
    """Passes that leave an object unchanged."""

    def with_matte(self, matte, *options, pattern=None, code=0):
        chain = self.chain(f'joint_blur: {{samples: 16, matte: "{matte}"}}')
        out = self.run_on(pattern or f"{FRAMES}/layers.####.exr", chain, "--frames", "2", *options,
                          code=code)
        return out if code else exr.read(f"{self.folder}/out.0002.exr")

    def check_held(self, after, matte, names):
        """Pixels that only the objects cover equal the input."""
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
        for matte, names in [("ViewLayer.CryptoObject:ball, post", ["ball", "post"]),
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
        self.assertIn("patterns need a manifest",
                      self.with_matte("cryptomatte:b*", pattern=path, code=4))

    def test_a_manifest_is_never_replaced(self):
        picture = exr.read(FRAMES / "layers.0002.exr")
        manifest = picture.attributes.pop("cryptomatte/542cafa/manifest")[1]
        chain = self.chain('fxaa: {matte: "cryptomatte:ball"}')
        # Under the name of another frame's sidecar, and as a link to this one's.
        for output, place in (("out.0001.exr.json", ""), ("out.0002.exr.json", "names.json")):
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

    def test_faulty_values_are_counted(self):
        path, picture = self.matte_frame()
        matte = channel("Combined_key", "R")
        chain = self.chain(f'joint_blur: {{samples: 16, matte: "{matte}"}}')
        kind, values = picture.channels[matte]
        for faulty, words in (([255 * value for value in values], "pixels are above 1 and count as 1; is it stored"),
                              ([float("nan"), float("inf"), *values[2:]], "2 pixels are not finite")):
            picture.channels[matte] = kind, faulty
            exr.write(path, picture)
            self.assertIn(words, self.run_on(path, chain))
        said = self.run_on(path, chain, "--strict", code=7)
        self.assertIn("mattes.0002.exr: 2 faulty values in mattes under --strict", said)

    def test_bad_mattes(self):
        for matte, message in [
                ("cryptomatte:bal", "no 'bal' in the cryptomatte (did you mean 'ball'?)"),
                ("R", "whole name")]:
            self.assertIn(message, self.with_matte(matte, code=4), matte)


if __name__ == "__main__":
    main()
