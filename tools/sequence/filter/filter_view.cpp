#include "tools/sequence/filter/filter_view.h"

#include "chain/text.h"
#include "tools/sequence/layers/fill_mask.h"
#include "tools/sequence/source/layers_apart.h"

namespace postchain::sequence {
namespace {

// Coverage of one id in one pixel; a smaller loss is invisible.
constexpr float kLostCoverage = 0.02f;

}  // namespace

Result<FilteredView> filter_view(const Chain& chain, const Plan& plan, const SourceFrame& source,
                                 const PlanOptions& options, Executor& executor,
                                 const StageObserver& observer,
                                 const std::function<void()>& color_is_done) {
    const bool masked = !source.layers.fill_mask.empty();
    CryptomatteFilter cryptomattes(
        chain, plan, source,
        masked ? planes_with_fill_mask(source.planes, source.description) : source.planes, options,
        executor);
    ASSIGN_OR_RETURN(auto result, cryptomattes.filter_color(observer));
    FilteredView view;
    view.color = std::move(result.at(Role::color));
    if (const auto layers = result.find(Role::layers); layers != result.end())
        view.layers = std::move(layers->second);
    if (masked) view.fill_mask = take_fill_mask(view.layers, view.color.height);
    if (color_is_done) color_is_done();
    if (!source.layers_apart.empty()) {
        ASSIGN_OR_RETURN(view.layers, filter_apart(chain, source, options, executor, view.layers));
    }
    ASSIGN_OR_RETURN(view.cryptomattes, cryptomattes.filter_rest(view.reports));
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
