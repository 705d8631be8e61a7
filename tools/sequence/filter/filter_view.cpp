#include "tools/sequence/filter/filter_view.h"

#include "chain/base/text.h"
#include "chain/frame/layers.h"
#include "tools/sequence/layers/fill_mask.h"
#include "tools/sequence/source/frame_plan.h"

namespace postchain::sequence {
namespace {

// Coverage of one id in one pixel; a smaller loss is invisible.
constexpr float kLostCoverage = 0.02f;

// All filtered layers of the frame, stacked in the order of FrameLayers::filtered. `together`:
// those filtered with color. `whole`: the frame's plan. Errors: those of planning and filtering.
Result<ImageF> filter_separately(const Chain& chain, const FramePlan& whole,
                                 const SourceFrame& frame, const PlanOptions& options,
                                 Executor& executor, const ImageF& together) {
    const int height = frame.description.height;
    std::vector<ImageF> filtered(frame.header.layers.filtered.size());
    for (const SeparateLayers& group : frame.separate_layers) {
        SharedPlanes planes = frame.planes;
        FrameDescription description = whole.description;
        description.layers = int(group.layers.size());
        for (Role role : {Role::layers, Role::layers_before, Role::layers_after}) {
            planes.erase(role);
            description.planes.remove(role);
            const auto plane = group.planes.find(role);
            if (plane == group.planes.end()) continue;
            planes[role] = plane->second;
            description.planes.add(role);
        }
        ASSIGN_OR_RETURN(const auto plan, make_plan(chain, description, options));
        ASSIGN_OR_RETURN(const auto result, executor.filter(plan, planes, {}));
        for (size_t i = 0; i < group.layers.size(); ++i)
            filtered[group.layers[i]] = plane_of_stack(result.at(Role::layers), int(i), height);
    }
    int next = 0;
    for (ImageF& layer : filtered)
        if (layer.empty()) layer = plane_of_stack(together, next++, height);
    return stack_planes(filtered);
}

}  // namespace

Result<FilteredView> filter_view(const Chain& chain, const FramePlan& plan,
                                 const SourceFrame& source, const PlanOptions& options,
                                 Executor& executor, const StageObserver& observer,
                                 const std::function<void()>& color_is_done) {
    const bool masked = !source.header.layers.fill_mask.empty();
    const SharedPlanes planes =
        masked ? planes_with_fill_mask(source.planes, source.description) : source.planes;
    std::optional<CryptomatteFilter> cryptomattes;
    if (source.cryptomattes) cryptomattes.emplace(chain, plan, source, planes, options, executor);
    ASSIGN_OR_RETURN(auto result, cryptomattes ? cryptomattes->filter_color(observer)
                                               : executor.filter(plan, planes, observer));
    FilteredView view;
    view.color = std::move(result.at(Role::color));
    if (const auto layers = result.find(Role::layers); layers != result.end())
        view.layers = std::move(layers->second);
    if (masked) view.fill_mask = take_fill_mask(view.layers, view.color.height);
    if (color_is_done) color_is_done();
    if (!source.separate_layers.empty()) {
        ASSIGN_OR_RETURN(view.layers,
                         filter_separately(chain, plan, source, options, executor, view.layers));
    }
    if (cryptomattes) {
        ASSIGN_OR_RETURN(view.cryptomattes, cryptomattes->filter_rest(view.reports));
    }
    return view;
}

std::vector<std::string> lost_coverage(const std::vector<CryptomatteReport>& reports,
                                       const std::string& path) {
    std::vector<std::string> lines;
    for (const CryptomatteReport& one : reports)
        if (one.largest_lost > kLostCoverage)
            lines.push_back(concat(path, ": cryptomatte ", one.name, ": ", one.pixels_short,
                                   " pixels have more ids than ranks, and up to ", one.largest_lost,
                                   " of a pixel is lost (render it with more ranks)"));
    return lines;
}

}  // namespace postchain::sequence
