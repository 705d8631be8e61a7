"""What the second chain of a question gains over the first: paired differences per frame, then per
scene, then over families of scenes. Positive: nearer to the truth, in every metric."""
import collections

import intervals
from ordering_study import STILL, family

# Consecutive frames are alike; means of so many of them are less so. Two batches would be too few.
BATCH_FRAMES, FEWEST_BATCHES = 3, 3

# mean of n frames' gains; interval: 95 %, over batches, or over frames where batches would be too
# few; None for one frame.
SceneGain = collections.namedtuple("SceneGain", "scene mean interval n batched")
# families: {family: mean of its scenes' gains}; interval: 95 % t over them; positive of counted: the
# signs of the families that are not 0; chance: of signs as uneven by chance alone; scenes: SceneGain.
Gain = collections.namedtuple("Gain", "mean interval families positive counted chance scenes")


def frame_gains(first, second, metric):
    """Of the frames that both have, in order; {frame: {metric: value}} each."""
    frames = sorted(set(first) & set(second))
    return [metric.sign * (second[frame][metric.key] - first[frame][metric.key])
            for frame in frames
            if None not in (first[frame][metric.key], second[frame][metric.key])]


def scene_gain(results, question, metric, scene):
    """None where the scene was not measured."""
    values = frame_gains(results.frames(scene, question.source, question.first),
                         results.frames(scene, question.source, question.second), metric)
    if not values:
        return None
    batched = len(values) >= FEWEST_BATCHES * BATCH_FRAMES
    units = intervals.batches(values, BATCH_FRAMES) if batched else values
    return SceneGain(scene, intervals.mean(values), intervals.t_interval(units), len(values),
                     batched)


def gain(results, question, metric, scenes=None):
    """Over these scenes (all) but the one where nothing moves; None where there is nothing."""
    found = [scene_gain(results, question, metric, scene) for scene in scenes or results.scenes()
             if scene != STILL]
    scenes = [one for one in found if one]
    if not scenes:
        return None
    families = {}
    for one in scenes:
        families.setdefault(family(one.scene), []).append(one.mean)
    families = {name: intervals.mean(values) for name, values in families.items()}
    positive, counted, chance = intervals.sign_test(list(families.values()))
    return Gain(intervals.mean(list(families.values())),
                intervals.t_interval(list(families.values())), families, positive, counted, chance,
                scenes)


def decided(found):
    """The interval over families does not contain 0."""
    return found.interval is not None and (found.interval[0] > 0 or found.interval[1] < 0)


def mean_errors(results, chain, source, metric, names):
    """Mean over families of the means over the frames in names ({scene: frames}); a scene without
    the metric does not count. None: frames are missing, or no scene has the metric."""
    families = {}
    for scene, frames in names.items():
        values = results.frames(scene, source, chain)
        if any(frame not in values for frame in frames):
            return None
        known = [values[frame][metric.key] for frame in frames
                 if values[frame][metric.key] is not None]
        if known:
            families.setdefault(family(scene), []).append(intervals.mean(known))
    means = [intervals.mean(values) for values in families.values()]
    return intervals.mean(means) if means else None


def neighbor_correlation(results, question, metric):
    """Mean over scenes of 8 frames and more of the autocorrelation of the frames' gains."""
    found = []
    for scene in results.scenes():
        values = frame_gains(results.frames(scene, question.source, question.first),
                             results.frames(scene, question.source, question.second), metric)
        if len(values) >= 8 and intervals.autocorrelation(values) is not None:
            found.append(intervals.autocorrelation(values))
    return intervals.mean(found) if found else None


def gains_by_size(results, question, metric):
    """[(streak over circle, sizes, SceneGain)] of the scenes whose blurs were measured, by ratio."""
    found = []
    for one in results.sizes:
        scene = scene_gain(results, question, metric, one["scene"])
        if scene and one["scene"] != STILL:
            found.append((one["streak_px"] / one["circle_px"], one, scene))
    return sorted(found, key=lambda row: row[0])
