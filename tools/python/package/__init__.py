"""Motion blur, depth of field and anti-aliasing for rendered frames, on NumPy arrays and on files.

    import postchain
    color = postchain.Chain("balanced").run(color, depth=depth, motion=motion, camera=camera)
    postchain.run_sequence("balanced", "shot.####.exr", "out.####.exr", camera="camera.json")

Arrays: Chain (run, filter, plan), Frame, read(), frames(), write().
Files: run_sequence(), plan_sequence(), inspect(), check(), sheet(), scene().
Measuring: diff(), ab(), bench(), study(), tune().
Errors: every postchain.Error says what is wrong and what to do; TypeError is a call that does not fit.
"""
from ._errors import (CanceledError, ChainError, DeviceError, Diagnostic, Error, HealthError,
                      InputError, InternalError, OutOfMemoryError, OutputError, UsageError, Warning)
from ._filtered import Filtered, Shot
from ._frames import frames
from ._postchain import (Chain, Device, Frame, __version__, ab, bench, check, diff, inspect,
                         plan_sequence, read, run_sequence, scene, schema, set_threads, sheet,
                         shipped_chains, study, tune, write)

# Public names are those of this package.
for _one in (CanceledError, Chain, ChainError, Device, DeviceError, Diagnostic, Error, Filtered, Frame,
             HealthError, InputError, InternalError, OutOfMemoryError, OutputError, Shot, UsageError,
             Warning, frames):
    _one.__module__ = "postchain"
del _one

__all__ = ["CanceledError", "Chain", "ChainError", "Device", "DeviceError", "Diagnostic", "Error",
           "Filtered", "Frame", "HealthError", "InputError", "InternalError", "OutOfMemoryError",
           "OutputError", "Shot", "UsageError", "Warning", "__version__", "ab", "bench", "check",
           "diff", "frames", "inspect", "plan_sequence", "read", "run_sequence", "scene", "schema",
           "set_threads", "sheet", "shipped_chains", "study", "tune", "write"]
