"""Motion blur, depth of field and anti-aliasing for rendered frames, on NumPy arrays and on files.

    import postchain
    color = postchain.Chain("balanced").run(color, depth=depth, motion=motion, camera=camera)
    postchain.run_sequence("balanced", "shot.####.exr", "out.####.exr", camera="camera.json")
"""
from ._errors import (CanceledError, ChainError, DeviceError, Diagnostic, Error, HealthError,
                      InputError, InternalError, OutOfMemoryError, OutputError, UsageError, Warning)
from ._filtered import Filtered
from ._postchain import (Chain, Device, Frame, __version__, diff, inspect, plan_sequence, read,
                         run_sequence, scene, schema, set_threads, shipped_chains, tune)

for _one in (Chain, Device, Frame):
    _one.__module__ = "postchain"
del _one

__all__ = ["CanceledError", "Chain", "ChainError", "Device", "DeviceError", "Diagnostic", "Error",
           "Filtered", "Frame", "HealthError", "InputError", "InternalError", "OutOfMemoryError",
           "OutputError", "UsageError", "Warning", "__version__", "diff", "inspect",
           "plan_sequence", "read", "run_sequence", "scene", "schema", "set_threads",
           "shipped_chains", "tune"]
