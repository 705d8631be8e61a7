#include "tools/sequence/source/frame_plan.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <set>

#include "chain/pass/depth_at.h"
#include "chain/pass/matte.h"
#include "chain/pass/resolved_chain.h"
#include "tools/sequence/layers/fill_mask.h"

namespace postchain::sequence {
namespace {

using namespace std::string_literals;

// Scans planes if a pass holds an object in its place.
FrameDescription planned_description(const Chain& chain, const SourceFrame& frame) {
    FrameDescription description = frame.description;
    std::vector<std::string> mattes;
    for (const MatteSource& matte : frame.header.layers.mattes) mattes.push_back(matte.name);
    description.mattes = matte_indices(chain, mattes);
    if (mattes_of(chain).empty())
        for (Role role : {Role::mattes, Role::mattes_before, Role::mattes_after})
            description.planes.remove(role);
    find_depths(chain, frame.planes, description);
    find_speeds(chain, frame.planes, description);
    description.camera = description.camera.overlaid_by(chain.camera);
    return description;
}

io::Window reached(const Chain& chain, const FramePlan& plan, const SourceFrame& frame) {
    const double px = reach_of(chain, plan);
    return color_part(frame.header)
        .data_window.grown(int(std::ceil(std::min(px, double(io::kMaxSide)))));
}

// Number of display-window pixels, outside the filtered window, that the passes may move light to:
// for a cropped frame under DataWindow::keep.
uint64_t pixels_cut_off(const Chain& chain, const FramePlan& plan, const SourceFrame& frame) {
    const io::Window lit =
        reached(chain, plan, frame).intersected(color_part(frame.header).display_window);
    return lit.pixels() - lit.intersected(frame.header.window).pixels();
}

// Whether a pass needs a focus distance that the camera states.
bool asks_for_focus(const Chain& chain, FrameDescription frame) {
    FrameDescription without = frame;
    without.camera.focus_distance.reset();
    return std::any_of(chain.links.begin(), chain.links.end(), [&](const ChainLink& link) {
        return link.pass->resolve(frame).ok() && !link.pass->resolve(without).ok();
    });
}

// Pixels with a value that exceeds the limit; of motion its length.
uint64_t pixels_beyond(const ExceededLimit& limit, const SourceFrame& frame) {
    const ImageF& first = *frame.planes.begin()->second;
    std::vector<char> exceeds(first.pixels());
    for (const auto& [role, plane] : frame.planes) {
        if (!limit.planes.has(role)) continue;
        for (size_t i = 0; i < exceeds.size(); ++i) {
            const float* value = plane->data.data() + i * size_t(plane->channels);
            const double size = plane->channels == 2
                                    ? std::hypot(double(value[0]), double(value[1]))
                                    : double(value[0]);
            exceeds[i] |= char(size < limit.low || size > limit.high);
        }
    }
    return uint64_t(std::count(exceeds.begin(), exceeds.end(), 1));
}

// One line for each limit of a pass that some pixels exceed.
void add_exceeded_limits(const Chain& chain, const FramePlan& plan, const SourceFrame& frame,
                         std::vector<std::string>& warnings) {
    for (size_t i = 0; i < chain.links.size(); ++i) {
        const auto pass = resolve_link(chain, i, plan.description);
        if (!pass.ok() || plan.passes[i].elided) continue;
        const std::string& name = chain.links[i].type->name;
        for (const ExceededLimit& limit : (*pass)->exceeded_limits())
            if (const uint64_t pixels = pixels_beyond(limit, frame))
                warnings.push_back(concat(
                    color_path(frame.header), ": ", name, ": the ", limit.what, " of ", pixels,
                    pixels == 1 ? " pixel" : " pixels", " is clamped to ", limit.limit_px,
                    " px; the largest is ", limit.largest_px, " px (set ", limit.parameter, ")"));
    }
}

std::string digits_of(double value) {
    char digits[32];
    std::snprintf(digits, sizeof(digits), "%.3g", value);
    return digits;
}

// Why focus and depth seem to have different units, or a unit other than the one assumed.
void add_doubts_of_lens(const Chain& chain, const FramePlan& plan, const SourceFrame& frame,
                        std::vector<std::string>& warnings) {
    const FrameBounds& bounds = plan.description.bounds;
    const double farthest = frame.findings.health.farthest_surface;
    if (!plan.description.planes.has(Role::inverse_depth) || farthest <= 0 ||
        !std::isfinite(bounds.max_inverse_depth))
        return;
    const double nearest = 1 / bounds.max_inverse_depth;
    const bool sky = is_infinitely_far(float(bounds.min_inverse_depth));
    // A focus may well lie before everything, or behind it, but hardly by so much.
    constexpr double kOutside = 4;
    for (size_t i = 0; i < chain.links.size(); ++i) {
        const auto pass = resolve_link(chain, i, plan.description);
        if (!pass.ok()) continue;
        const std::vector<UsedValue> used = (*pass)->used_values();
        const auto value_of = [&](std::string_view key) -> std::optional<double> {
            for (const UsedValue& one : used)
                if (one.key == key)
                    if (const auto* number = std::get_if<double>(&one.value)) return *number;
            return std::nullopt;
        };
        const auto add = [&](const std::string& text) {
            warnings.push_back(
                concat(color_path(frame.header), ": ", chain.links[i].type->name, ": ", text));
        };
        const auto focus = value_of("focus_distance"), f_stop = value_of("f_stop"),
                   circle = value_of("largest_circle_px");
        if (focus && (*focus * kOutside < nearest || (!sky && *focus > farthest * kOutside)))
            add(concat(
                "the focus distance ", digits_of(*focus), " lies far outside the frame's ",
                "depths, ", digits_of(nearest), " to ", digits_of(farthest),
                "; are both in the same unit? (focus_distance is in scene units, as depth)"));
        else if (f_stop && circle && *circle < 1 && !plan.description.camera.meters_per_unit)
            add(concat("the largest circle of confusion is ", digits_of(*circle), " px at f/",
                       digits_of(*f_stop),
                       ": a scene unit is assumed to be 1 m; if it is not, set meters_per_unit "
                       "(0.01: centimeters)"));
    }
}

// Frames of one sample a pixel before a pass that expects antialiased ones.
void add_doubt_of_samples(const Chain& chain, const SourceFrame& frame,
                          std::vector<std::string>& warnings) {
    constexpr double kHardEdges = 0.6;
    for (const ChainLink& link : chain.links) {
        const Parameter* where = link.type->parameters->find("where");
        if (!where || where->get(link.pass->parameters()) != ParameterValue("blurred"s)) continue;
        const auto hard = part_of_hard_edges(*frame.planes.at(Role::color));
        if (hard && *hard > kHardEdges)
            warnings.push_back(concat(
                color_path(frame.header), ": ", link.type->name, ": ", std::lround(100 * *hard),
                " % of the edges are jagged, as with one sample a pixel, and those that are not "
                "blurred stay so; set where: everywhere"));
        return;
    }
}

// Motion vectors against the color of the frame after, or before.
void add_doubt_of_speed(const SourceFrame& frame, std::vector<std::string>& warnings) {
    const double speed = frame.findings.health.fastest_stored_px;
    for (const Neighbor neighbor : {Neighbor::after, Neighbor::before}) {
        const auto other = frame.planes.find(role_of(neighbor, Role::color));
        if (other == frame.planes.end() || !frame.description.planes.has(Role::motion)) continue;
        if (!doubt_of_speed(speed, 1).empty())
            if (const std::string doubt = doubt_of_speed(
                    speed, color_change(*frame.planes.at(Role::color), *other->second));
                !doubt.empty())
                warnings.push_back(concat(color_path(frame.header), ": ", doubt));
        return;
    }
}

}  // namespace

RoleSet planes_needed(const Chain& chain, const SourceSettings& settings, const FrameHeader& header,
                      const PlanOptions& options) {
    FrameDescription frame = describe(header);
    // Which planes are read does not depend on depth.
    for (const auto& link : chain.links)
        for (const Place& place : link.pass->depth_places())
            frame.bounds.inverse_depth_at[place] = 0;
    frame.mattes = matte_indices(chain, settings.layers.mattes);
    RoleSet own = roles_in_files(header);
    // Cryptomattes are filtered as layers too, in chunks.
    frame.layers = std::max(int(header.layers.filtered.size()), int(own.has(Role::layers)));
    if (mattes_of(chain).empty()) own.remove(Role::mattes);
    const RoleSet usable = chain.required() | chain.optional();
    bool planned = false;
    const auto read_with = [&](const std::vector<Neighbor>& neighbors) {
        frame.planes = own;
        for (Neighbor neighbor : neighbors)
            for (Role role : kNeighborRoles)
                if (own.has(role) && usable.has(is_stacked(role) ? role_of(neighbor, Role::color)
                                                                 : role_of(neighbor, role)))
                    frame.planes.add(role_of(neighbor, role));
        const auto plan = make_plan(chain, frame, options);
        if (!plan.ok()) return RoleSet();
        planned = true;
        return plan->reads;
    };
    RoleSet all = read_with({});
    if (!usable.of(Neighbor::before).empty() || !usable.of(Neighbor::after).empty()) {
        all = all | read_with({Neighbor::before}) | read_with({Neighbor::after}) |
              read_with({Neighbor::before, Neighbor::after});
    }
    // If a pass reads the depth at a place, planning needs it.
    if (!frame.bounds.inverse_depth_at.empty()) all.add(Role::inverse_depth);
    return planned ? all : usable;
}

Result<FramePlan> plan_source_frame(const Chain& chain, const SourceFrame& frame,
                                    const PlanOptions& options) {
    FrameDescription description = planned_description(chain, frame);
    const bool masked = !frame.header.layers.fill_mask.empty();
    auto plan = make_plan(chain, masked ? with_fill_mask(description) : description, options);
    if (plan.ok()) return FramePlan{std::move(*plan), std::move(description)};
    const Status status = plan.status();
    std::string text = color_path(frame.header) + ": " + status.message();
    if (status.code() == StatusCode::input) {
        for (const auto& [role, names] : frame.header.match.missing)
            if (chain.required().has(role))
                text += concat("; ", name_of(role), " was looked for as ", names);
        text += "; found were";
        for (const auto& [role, file] : frame.header.files.files) text += names_in(*file);
        text += " (profile " + frame.header.match.profile + ")";
    }
    return Status(status.code(), text);
}

double reach_of(const Chain& chain, const FramePlan& plan) {
    std::set<int> left_out;
    for (const Elision& elision : plan.elisions)
        if (elision.kind == ElisionKind::pass) left_out.insert(elision.pass);
    double px = 0;
    for (size_t i = 0; i < chain.links.size(); ++i)
        if (!left_out.count(int(i)))
            px += postchain::reach_of(*chain.links[i].pass, plan.description).spreads_px;
    return px;
}

io::Window written_window(const Chain& chain, const FramePlan& plan, const SourceFrame& frame) {
    return reached(chain, plan, frame).intersected(frame.header.window);
}

std::vector<std::string> plan_warnings(const Chain& chain, const FramePlan& plan,
                                       const SourceFrame& frame) {
    std::vector<std::string> warnings;
    const std::string path = color_path(frame.header);
    const io::Window whole =
        color_part(frame.header).data_window.united(color_part(frame.header).display_window);
    if (const uint64_t lost = pixels_cut_off(chain, plan, frame))
        warnings.push_back(concat(
            path, ": the data window ", color_part(frame.header).data_window.text(),
            " leaves out part of the display window ",
            color_part(frame.header).display_window.text(),
            ": light that the chain moves out of it, into ", lost, " pixels at most, is lost",
            fits(whole) ? " ({data_window=grow} keeps it)"_keyed : ""));
    add_exceeded_limits(chain, plan, frame, warnings);
    add_doubts_of_lens(chain, plan, frame, warnings);
    add_doubt_of_speed(frame, warnings);
    add_doubt_of_samples(chain, frame, warnings);
    const Camera& camera = plan.description.camera;
    if (camera.metadata_focus_m && !camera.meters_per_unit &&
        asks_for_focus(chain, plan.description))
        warnings.push_back(
            concat(path, ": the focus of its metadata is ", *camera.metadata_focus_m,
                   " m, but meters_per_unit is unknown: a scene unit is assumed to be "
                   "1 m (set it in {camera}, in the chain or with {set})"_keyed));
    return warnings;
}

}  // namespace postchain::sequence
