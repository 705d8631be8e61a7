"""First use of the wheel in the environment that it is installed in: filters and writes a frame.
    wheel.py [--formats]     --formats: with OpenImageIO's package, also another format than EXR"""
import importlib.metadata
import pathlib
import sys
import tempfile
import warnings

import numpy

import postchain

assert pathlib.Path(postchain.__file__).is_relative_to(sys.prefix), postchain.__file__
assert importlib.metadata.version("postchain") == postchain.__version__
assert importlib.metadata.requires("postchain") == ["numpy"]
warnings.filterwarnings("ignore", "no GPU")
with tempfile.TemporaryDirectory() as folder:
    color = numpy.zeros((18, 32, 3), numpy.float32)
    color[9:, ::2] = 1
    result = postchain.Chain({"postchain": 1, "passes": ["fxaa"]}).run(color)
    assert result.shape == color.shape and (result != color).any()
    exr = f"{folder}/frame.exr"
    postchain.write(exr, result)
    assert postchain.diff(exr, result)["flip"] == 0
    if "--formats" in sys.argv:
        png = f"{folder}/frame.png"
        postchain.write(png, result)  # by the library beside the module
        assert postchain.diff(png, result)["psnr"] > 60

    postchain.scene("wheels", folder, size=(160, 90), frames="1-3", truth_samples=16)
    shot = list(postchain.frames(f"{folder}/sharp.####.exr", camera=f"{folder}/camera.json"))[1]
    result = postchain.Chain("balanced").run(shot.frame, before=shot.before, after=shot.after)
    truth = f"{folder}/both.0002.exr"
    before, after = (postchain.diff(truth, one)["flip"] for one in (shot.frame.planes()["color"], result))
    print(f"postchain {postchain.__version__}, Python {sys.version.split()[0]}, {sys.prefix}:"
          f" FLIP {before:.4f} before, {after:.4f} after balanced")
    assert after < before
