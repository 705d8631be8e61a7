# shown: runs the Python program on stdin, in which show() prints values as JSON.
shown() {
    { cat <<'END'
import json, pickle, sys, threading, warnings
import numpy, postchain
from postchain import Chain, Device, Frame
warnings.filterwarnings("ignore", "no GPU", postchain.Warning)


def plain(value):
    if isinstance(value, numpy.ndarray):
        more = "" if value.flags.writeable else ", read-only"
        return f"{value.dtype} {value.shape}{more}, mean {value.mean(dtype=float):.3g}"
    if hasattr(value, "_asdict"):
        return {type(value).__name__: plain(value._asdict())}
    if isinstance(value, dict):
        return {str(key): plain(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    return value if isinstance(value, (str, int, float, bool, type(None))) else repr(value)


def show(*values):
    for value in values:
        print(json.dumps(plain(value)), flush=True)


def fails(call):
    """Shows its error."""
    try:
        show(call())
    except Exception as error:
        show({type(error).__name__: str(error)} | {
            key: getattr(error, key) for key in ("code", "place", "remedy", "diagnostics") if hasattr(error, key)})


END
    cat; } | python -W always::UserWarning -c 'import sys; exec(compile(sys.stdin.read(), "program", "exec"))' 2>&1 |
        sed -E '/ Warning: /s/\b0\.[0-9]{4,}/N/g' | pretty --digits 3 |
        sed -E 's/("times_ms": \{"0\.[a-z]+": )[0-9.e-]+/\1T/; s/("bytes": )[0-9]{4,}/\1N/'
}
