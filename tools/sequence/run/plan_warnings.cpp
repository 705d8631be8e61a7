#include "tools/sequence/run/plan_warnings.h"

#include <algorithm>
#include <cmath>

#include "chain/resolved_chain.h"
#include "tools/sequence/source/written_window.h"

namespace postchain::sequence {
namespace {

// Whether a pass needs a focus distance that the camera states.
bool asks_for_focus(const Chain& chain, FrameDescription frame) {
    FrameDescription without = frame;
    without.camera.focus_distance.reset();
    return std::any_of(chain.links.begin(), chain.links.end(), [&](const ChainLink& link) {
        return link.pass->resolve(frame).ok() && !link.pass->resolve(without).ok();
    });
}

// Pixels with a value outside the cut's limits; of motion its length.
uint64_t pixels_cut(const Cut& cut, const SourceFrame& frame) {
    const ImageF& first = *frame.planes.begin()->second;
    std::vector<char> is_cut(first.pixels());
    for (const auto& [role, plane] : frame.planes) {
        if (!cut.planes.has(role)) continue;
        for (size_t i = 0; i < is_cut.size(); ++i) {
            const float* value = plane->data.data() + i * size_t(plane->channels);
            const double size = plane->channels == 2
                                    ? std::hypot(double(value[0]), double(value[1]))
                                    : double(value[0]);
            is_cut[i] |= char(size < cut.low || size > cut.high);
        }
    }
    return uint64_t(std::count(is_cut.begin(), is_cut.end(), 1));
}

// One line for each limit of a pass that some pixels exceed.
void add_cuts(const Chain& chain, const Plan& plan, const SourceFrame& frame,
              const FrameDescription& description, std::vector<std::string>& warnings) {
    for (size_t i = 0; i < chain.links.size(); ++i) {
        const auto pass = resolve_link(chain, i, description);
        if (!pass.ok() || plan.passes[i].elided) continue;
        const std::string& name = chain.links[i].type->name;
        for (const Cut& cut : (*pass)->cuts())
            if (const uint64_t pixels = pixels_cut(cut, frame))
                warnings.push_back(concat(
                    frame.input.files.color_file().path(), ": ", name, ": the ", cut.what, " of ",
                    pixels, pixels == 1 ? " pixel" : " pixels", " is cut to ", cut.limit_px,
                    " px; the largest is ", cut.largest_px, " px (set ", cut.parameter, ")"));
    }
}

}  // namespace

std::vector<std::string> plan_warnings(const Chain& chain, const Plan& plan,
                                       const SourceFrame& frame) {
    std::vector<std::string> warnings;
    const std::string path = frame.input.files.color_file().path();
    const io::Window whole = frame.input.data_window.united(frame.input.display_window);
    if (const uint64_t lost = pixels_cut_off(chain, plan, frame))
        warnings.push_back(concat(
            path, ": the data window ", frame.input.data_window.text(),
            " leaves out part of the display window ", frame.input.display_window.text(),
            ": light that the chain moves out of it, into ", lost, " pixels at most, is lost",
            fits(whole) ? " (--data-window grow keeps it)" : ""));
    const FrameDescription description = planned_description(chain, frame);
    add_cuts(chain, plan, frame, description, warnings);
    const Camera& camera = description.camera;
    if (camera.metadata_focus_m && !camera.meters_per_unit && asks_for_focus(chain, description))
        warnings.push_back(
            concat(path, ": the focus of its metadata is ", *camera.metadata_focus_m,
                   " m, but meters_per_unit is unknown: a scene unit is assumed to be "
                   "1 m (set it in --camera, in the chain or with --set)"));
    return warnings;
}

}  // namespace postchain::sequence
