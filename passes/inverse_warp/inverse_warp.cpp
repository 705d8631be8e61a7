#include "passes/inverse_warp/inverse_warp.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "chain/pass/work_list.h"
#include "passes/common/lens_samples.h"
#include "passes/inverse_warp/reference.h"
#include "passes/inverse_warp/steps.h"

namespace postchain::inverse_warp {
namespace {

constexpr double kMinHalfOpen = 1.0 / 16;  // frames

// To the farthest cell, 16 of 2 px away, in which continuation.comp looks for a hidden surface.
constexpr double kContinuationReachPx = 2 * 16 + 2;

}  // namespace

const ParameterTable& search_table() {
    static const ParameterTable table =
        ParameterTableBuilder<SearchParameters>()
            .integer("starts", &SearchParameters::starts,
                     {.min = 1,
                      .max = kMaxStarts,
                      .help = "start surfaces of the search from the blocks around, "
                              "beside the pixel's own"})
            .choice("neighbors", &SearchParameters::neighbors, {"none", "before", "both"},
                    {.help = "frames searched for surfaces occluded in this one, if their planes "
                             "are available: none, the one before, or both"})
            .table();
    return table;
}

Shutter shutter_on(const FrameDescription& frame, const Parameters& parameters) {
    const double default_max_path_px = std::clamp(frame.display_width / 8.0, 40.0, 512.0);
    Shutter shutter;
    shutter.max_path_px = shutter::limit_px(parameters.shutter, parameters.max_blur_px, frame)
                              .value_or(default_max_path_px);
    const auto [opens, closes] = shutter::interval(parameters.shutter, frame.camera);
    shutter.half_open = std::max(-opens, closes);
    if (opens != -closes) {
        shutter.time_scale = 0.5 * (closes - opens) / shutter.half_open;
        shutter.time_shift = 0.5 * (closes + opens) / shutter.half_open;
    }
    return shutter;
}

Lens lens_on(const FrameDescription& frame, const Parameters& parameters,
             const lens::CircleOfConfusion& coc) {
    return {coc, lens::aperture_of(parameters.aperture, frame.camera, coc.axes)};
}

noise::Parameters Settings::noise() const {
    noise::Parameters noise = parameters.noise;
    if (!lens && parameters.time_jitter == 0) noise.noise = noise::Kind::none;
    return noise;
}

RoleSet required_planes(bool shutter) {
    RoleSet planes = {Role::color, Role::inverse_depth};
    if (shutter) planes.add(Role::motion);
    return planes;
}

RoleSet optional_planes(bool shutter, Neighbors neighbors) {
    RoleSet planes = {Role::behind};
    if (shutter) planes.add(Role::motion_back);
    if (neighbors == Neighbors::none) return planes;
    planes = planes | RoleSet{Role::motion, Role::motion_back};
    for (const Neighbor neighbor : kNeighbors)
        if (neighbor == Neighbor::before || neighbors == Neighbors::both)
            for (const Role role : kNeighborRoles) planes.add(role_of(neighbor, role));
    return planes - required_planes(shutter);
}

NeighborList searched_neighbors(const Settings& settings, RoleSet available) {
    NeighborList found;
    const Neighbors neighbors = settings.parameters.search.neighbors;
    if (settings.shutter && settings.shutter->half_open < kMinHalfOpen) return found;
    for (const Neighbor neighbor : kNeighbors) {
        if (neighbors == Neighbors::none) break;
        if (neighbors == Neighbors::before && neighbor != Neighbor::before) continue;
        bool all = available.has(Role::motion);
        for (const Role role : {Role::color, Role::inverse_depth, Role::motion})
            all = all && available.has(role_of(neighbor, role));
        // A neighbor that fills color must fill the layers too, or they would not sum to it.
        if (available.has(Role::layers))
            all = all && available.has(role_of(neighbor, Role::layers));
        if (all) found.add(neighbor);
    }
    return found;
}

bool uses_second_layer(const Settings& settings, const PlanContext& context) {
    const bool given_hint =
        !settings.shutter && context.available.has(Role::hint) && context.wanted.has(Role::hint);
    return context.available.has(Role::behind) && !given_hint;
}

bool uses_hidden_surfaces(const Settings& settings, const PlanContext& context) {
    return !searched_neighbors(settings, context.available).empty() ||
           uses_second_layer(settings, context);
}

Guarantees guarantees_of(const Settings& settings) {
    Guarantees guarantees;
    guarantees.keeps_constants = true;
    guarantees.convex = 1e-6;
    // The barrel's cut depends on the place in the frame.
    const bool barrel = settings.lens && settings.lens->aperture.cats_eye > 0;
    guarantees.lattice_px = barrel ? 0 : kBlockPx;
    // Random numbers belong to places. On a tie between surfaces a block takes the first, which
    // prefers a side.
    if (settings.noise().noise == noise::Kind::none && !barrel)
        guarantees.symmetries = {Symmetry::shift};
    return guarantees;
}

std::vector<Settings> every_shape(const Settings& settings) {
    if (!settings.shutter) return {settings};
    Settings closed = settings, open = settings;
    closed.shutter->half_open = 0;
    open.shutter->half_open = 1;
    return {closed, open};
}

std::vector<UsedValue> WarpOnFrame::used_values() const {
    const Parameters& parameters = settings_.parameters;
    std::vector<UsedValue> values;
    const auto add = [&](std::vector<UsedValue> more) {
        std::move(more.begin(), more.end(), std::back_inserter(values));
    };
    if (settings_.shutter) add(shutter::used_values(parameters.shutter, frame_));
    if (settings_.lens) {
        add(lens::used_values(parameters.lens, settings_.lens->coc, frame_,
                              shared::kSharpRadiusPx));
        add(lens::used_values(parameters.aperture, frame_.camera));
    }
    return values;
}

std::vector<ExceededLimit> WarpOnFrame::exceeded_limits() const {
    std::vector<ExceededLimit> limits;
    if (settings_.shutter)
        limits = shutter::exceeded_limits(settings_.parameters.shutter, frame_,
                                          settings_.shutter->max_path_px);
    if (settings_.lens)
        for (ExceededLimit& limit : lens::exceeded_limits(settings_.lens->coc, frame_))
            limits.push_back(std::move(limit));
    return limits;
}

// The blocks that can reach a pixel's block end `ring` blocks from it, and the edges of a surface
// there are found in up to four pixels around it. Every position of the search lies on a path that
// ends at the pixel; occluded surfaces come from cells up to kContinuationReachPx around, and
// denoised colors from two pixels further.
Reach WarpOnFrame::reach() const {
    // In a neighboring frame paths are as long as the motion vectors.
    if (!searched_neighbors(settings_, frame_.planes).empty()) return {};
    const double longest = longest_px(settings_);
    const double hidden = longest + kContinuationReachPx + 7;
    return {std::max(kBlockPx * (ring_of(longest) + 1) + 7.0, hidden), hidden};
}

// The table of lens samples is of an aperture, not of a frame: plan() makes it.
ShapeNumbers WarpOnFrame::shape(const PlanContext& context) const {
    uint64_t searched = 0;
    for (const Neighbor neighbor : searched_neighbors(settings_, context.available))
        searched |= uint64_t(1) << uint64_t(neighbor);
    return {searched, settings_.lens ? lens::hash_of(settings_.lens->aperture) : 0};
}

void WarpOnFrame::plan(PassPlanner& planner) const {
    add_steps(planner, settings_);
}

void WarpOnFrame::write_uniforms(const PlanContext& context, UniformWriter& uniforms) const {
    write_step_uniforms(settings_, frame_, searched_neighbors(settings_, context.available),
                        uniforms);
    noise::write_uniforms(settings_.noise(), frame_.frame_number, uniforms);
}

void WarpOnFrame::reference(const PlanContext& context, ReferenceFrame& frame) const {
    warp_reference(context, settings_, frame);
}

}  // namespace postchain::inverse_warp
