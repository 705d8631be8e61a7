"""Exceptions of postchain. The text of each is PLACE: WHAT; REMEDY."""
from typing import Dict, List, NamedTuple, Type


class Diagnostic(NamedTuple):
    """An error in the text of a chain or a camera. `line` and `column` count from 1; 0 = the text has
    no lines (a dict, `set`). `key`: "passes[0].samples"."""
    file: str
    line: int
    column: int
    key: str
    message: str


class Error(Exception):
    """Base of all. `place`: what the message begins with (a file, an argument), `remedy`: what comes
    after its last semicolon; either may be empty. `diagnostics`: every error of a chain or camera."""
    code = "internal"

    def __init__(self, message: str, diagnostics: List[Diagnostic] = []):
        super().__init__(message)
        self.diagnostics = list(diagnostics)
        if self.diagnostics:
            first = self.diagnostics[0]
            lines = f":{first.line}:{first.column}" if first.line else ""
            self.place = first.file + lines + (f": {first.key}" if first.key else "")
            message = first.message
        else:
            self.place = message.partition(": ")[0] if ": " in message else ""
        self.remedy = message.rpartition("; ")[2] if "; " in message else ""

    def __reduce__(self):
        return type(self), (str(self), self.diagnostics), self.__dict__


class UsageError(Error, ValueError):
    """An argument is wrong."""
    code = "usage"


class ChainError(Error, ValueError):
    """The chain or its parameters are invalid."""
    code = "chain"


class InputError(Error):
    """An input is missing, unreadable, or lacks a plane that a pass needs."""
    code = "input"


class OutOfMemoryError(Error, MemoryError):
    """An input takes more memory than is available or allowed."""
    code = "memory"


class OutputError(Error):
    """An output cannot be written."""
    code = "output"


class DeviceError(Error, RuntimeError):
    """No usable GL, out of GL memory, or a GL error."""
    code = "gl"


class HealthError(Error):
    """Values that are not finite, although `strict` forbids them."""
    code = "health"


class CanceledError(Error):
    """Stopped before it was done."""
    code = "canceled"


class InternalError(Error):
    """A defect of postchain itself."""
    code = "internal"


class Warning(UserWarning):
    """Faults of an input that postchain repairs, and settings that have no effect."""


CLASSES: Dict[str, Type[Error]] = {kind.code: kind for kind in (
    UsageError, ChainError, InputError, OutOfMemoryError, OutputError, DeviceError, HealthError,
    CanceledError, InternalError)}
