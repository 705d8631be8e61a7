#include "tools/sequence/run/plan_warnings.h"

#include <algorithm>

#include "tools/sequence/run/written_window.h"

namespace postchain::sequence {
namespace {

// Whether a pass needs a focus distance that the camera states.
bool asks_for_focus(const Chain& chain, FrameDescription frame) {
    FrameDescription without = frame;
    without.camera.focus_distance.reset();
    return std::any_of(chain.links.begin(), chain.links.end(), [&](const ChainLink& link) {
        return link.pass->check(frame).ok() && !link.pass->check(without).ok();
    });
}

}  // namespace

std::vector<std::string> plan_warnings(const Chain& chain, const Plan& plan,
                                       const SourceFrame& frame) {
    std::vector<std::string> warnings;
    const std::string path = frame.input.files.color_file().path();
    if (const uint64_t lost = pixels_cut_off(chain, plan, frame))
        warnings.push_back(concat(path, ": the data window ", frame.input.data_window.text(),
                                  " leaves out part of the display window ",
                                  frame.input.display_window.text(),
                                  ": light that the chain moves out of it, into ", lost,
                                  " pixels at most, is lost (--data-window grow keeps it)"));
    const FrameDescription description = planned_description(chain, frame);
    const Camera& camera = description.camera;
    if (camera.metadata_focus_m && !camera.meters_per_unit && asks_for_focus(chain, description))
        warnings.push_back(
            concat(path, ": the focus of its metadata is ", *camera.metadata_focus_m,
                   " m, but meters_per_unit is unknown: a scene unit is assumed to be "
                   "1 m (set it in --camera, in the chain or with --set)"));
    return warnings;
}

}  // namespace postchain::sequence
