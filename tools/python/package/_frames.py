"""The frames of a sequence, each with its neighbors."""
from ._filtered import Shot
from ._postchain import _frame_list, read


def frames(input, camera=None, *, frames=None, **settings):
    """The frames of a sequence, each with the frames before and after it: an iterator over Shots.

        for shot in postchain.frames("shot.####.exr", camera="camera.json"):
            color = chain.run(shot.frame, before=shot.before, after=shot.after)

    Each file is opened and converted once, and let go when the iterator has passed it. Neighbors are
    those on disk, as for run_sequence(): a part of a sequence gives the same results as all of it.
    A cut (`cuts`) is between two frames.

    input: "A.####.exr", or "color=A.####.exr,depth=B.####.exr,motion=C.####.exr"
    camera: a dict or a file with the keys of a camera file
    frames: "1-10,20", or numbers; default: all on disk

    Further arguments are those of read().
    """
    wanted, on_disk, cuts = _frame_list(input, frames=frames, **settings)
    return _shots(input, camera, wanted, set(on_disk), set(cuts), settings)


def _shots(input, camera, wanted, on_disk, cuts, settings):
    kept = {}

    def get(number):
        if number not in kept:
            kept[number] = read(input, number, camera, **settings)
        return kept[number]

    for number in wanted:
        for old in [one for one in kept if abs(one - number) > 1]:
            del kept[old]
        before = number - 1 in on_disk and number - 1 not in cuts
        after = number + 1 in on_disk and number not in cuts
        yield Shot(get(number), get(number - 1) if before else None,
                   get(number + 1) if after else None)
