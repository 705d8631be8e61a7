"""The result of Chain.run_aovs()."""
from typing import Any, Dict, NamedTuple


class Filtered(NamedTuple):
    """A frame with its AOVs. `color`: as of run(). `aovs`: float32 by name, with as many channels
    as given. `cryptomattes`: the filtered ones by name, float32 of height x width x (id, coverage of
    each rank); empty unless they were filtered."""
    color: Any
    aovs: Dict[str, Any]
    cryptomattes: Dict[str, Any]
