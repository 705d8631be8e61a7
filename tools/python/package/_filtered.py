"""The results of Chain.filter() and frames()."""
from typing import Any, Dict, NamedTuple, Optional


class Filtered(NamedTuple):
    """A filtered frame. `color`: as of Chain.run(). `aovs`: float32 by name, with as many channels as
    given. `cryptomattes`: the filtered ones by name, float32 of height x width x (id, coverage of each
    rank); empty unless they were filtered. `fill_mask`: height x width x 3, the shares of a pixel that
    came from its frame, a neighboring frame and an estimate; None unless asked for. `stages`: textures
    of the plan by name. `times_ms`: of each pass, "0.motion_blur", in milliseconds on the device."""
    color: Any
    aovs: Dict[str, Any]
    cryptomattes: Dict[str, Any]
    fill_mask: Optional[Any]
    stages: Dict[str, Any]
    times_ms: Dict[str, float]


class Shot(NamedTuple):
    """A frame of a sequence with its neighbors, for chain.run(shot.frame, before=shot.before,
    after=shot.after). `before`, `after`: None where there is no such frame, or a cut is between."""
    frame: Any
    before: Optional[Any]
    after: Optional[Any]
