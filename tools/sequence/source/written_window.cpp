#include "tools/sequence/source/written_window.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace postchain::sequence {
namespace {

io::Window reached(const Chain& chain, const Plan& plan, const SourceFrame& frame) {
    const double px = reach_of(chain, plan, frame);
    return frame.input.data_window.grown(int(std::ceil(std::min(px, double(io::kMaxSide)))));
}

}  // namespace

double reach_of(const Chain& chain, const Plan& plan, const SourceFrame& frame) {
    const FrameDescription description = planned_description(chain, frame);
    std::set<int> left_out;
    for (const Elision& elision : plan.elisions)
        if (elision.kind == ElisionKind::pass) left_out.insert(elision.pass);
    double px = 0;
    for (size_t i = 0; i < chain.links.size(); ++i)
        if (!left_out.count(int(i)))
            px += postchain::reach_of(*chain.links[i].pass, description).spreads_px;
    return px;
}

io::Window written_window(const Chain& chain, const Plan& plan, const SourceFrame& frame) {
    return reached(chain, plan, frame).intersected(frame.input.window);
}

uint64_t pixels_cut_off(const Chain& chain, const Plan& plan, const SourceFrame& frame) {
    const io::Window lit = reached(chain, plan, frame).intersected(frame.input.display_window);
    return lit.pixels() - lit.intersected(frame.input.window).pixels();
}

}  // namespace postchain::sequence
