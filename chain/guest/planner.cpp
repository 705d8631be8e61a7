#include "chain/guest/planner.h"

#include <algorithm>

#include "chain/guest/followed_depths.h"
#include "chain/plan/program_source.h"

namespace postchain::guest {
namespace {

constexpr uint32_t kMaxSide = 32768;  // of the textures of any device

}  // namespace

Failure Planner::create(const pc_plan_create_info& info, std::unique_ptr<Planner>& planner) {
    if (info.max_width == 0 || info.max_height == 0 || info.max_width > kMaxSide ||
        info.max_height > kMaxSide)
        return {PC_ERROR_ARGUMENT,
                concat("max_width, max_height: ", info.max_width, "x", info.max_height,
                       "; give the largest frame, 1 to ", kMaxSide, " a side")};
    planner.reset(new Planner(info));
    return {};
}

Failure Planner::check(const ChainVersion& chain, const pc_frame& given, HostFrame& frame) const {
    const HostFormat* output = find_neutral_format(given.output.internal_format);
    if (given.output.name != 0 && output && !output->image)
        return {PC_ERROR_INPUT,
                concat("output: ", output->text,
                       " cannot be written as a storage image; give PC_FORMAT_RGBA8, "
                       "PC_FORMAT_RGBA16F or another of those in docs/own_device.md")};
    if (given.barriers != 0)
        return {PC_ERROR_ARGUMENT, "barriers is not 0; the host that executes a plan sets them"};
    RETURN_IF_ERROR(check_frame(&given, frame, find_neutral_format));
    const auto sliced = [](const HostPlanes& planes) {
        return planes.color.image.level + planes.depth.image.level + planes.motion.image.level;
    };
    if (frame.all_arrays() != 0 || frame.output.array || frame.output.image.level != 0 ||
        frame.mask.image.level != 0 ||
        sliced(frame) + sliced(frame.neighbors[0]) + sliced(frame.neighbors[1]) != 0)
        return {PC_ERROR_ARGUMENT,
                "a pc_slice is not 0; the view that the host binds selects "
                "slice and level"};
    if (uint32_t(frame.width) > info_.max_width || uint32_t(frame.height) > info_.max_height)
        return {PC_ERROR_INPUT, concat("the frame is ", frame.width, "x", frame.height,
                                       "; pc_plan_create_info states ", info_.max_width, "x",
                                       info_.max_height, " at most")};
    Depths places;
    RETURN_IF_ERROR(find_places(*chain.chain, places));
    if (!places.empty())
        return {PC_ERROR_CHAIN,
                "focus_at needs the depth at its place, which a plan cannot read; "
                "pc_chain_unset() it, and give focus_distance"};
    return (info_.flags & PC_VALIDATE) != 0 ? check_deeper(frame) : Failure();
}

Result<uint64_t> Planner::key_of_program(const ProgramKey& key) {
    std::string text = key.text();
    if (const auto known = keys_.find(text); known != keys_.end()) return known->second;
    ASSIGN_OR_RETURN(const auto source, program_source(key));
    return keys_.emplace(std::move(text), program_key(source)).first->second;
}

Result<std::unique_ptr<PlanArrays>> Planner::compile(Plan plan, const MaxFrameSize& max_size) {
    std::vector<uint64_t> programs;
    for (const Step& step : plan.steps) {
        ASSIGN_OR_RETURN(const uint64_t key, key_of_program(step.program));
        programs.push_back(key);
    }
    return std::make_unique<PlanArrays>(std::move(plan), max_size, std::move(programs),
                                        ChainHandle::new_revision());
}

Failure Planner::plan(const ChainVersion& chain, const pc_frame& given, pc_plan& out) {
    HostFrame frame;
    RETURN_IF_ERROR(check(chain, given, frame));
    Plans::Entry* entry = nullptr;
    RETURN_IF_ERROR(plans_.find_or_make(
        chain, frame, frame.max_planes(info_.max_width, info_.max_height), entry));
    ++plans_.frames;
    plans_.run(*entry, chain, frame);
    import_frame(entry->host, frame, *entry->compiled);
    entry->compiled->list(entry->host, out);
    plans_.forget_unused();
    return {};
}

Failure Planner::list_programs(const ChainVersion& chain, const pc_frame& given, uint64_t* keys,
                               uint32_t& count) {
    if (!keys && count > 0) return {PC_ERROR_ARGUMENT, "keys is NULL"};
    HostFrame frame;
    RETURN_IF_ERROR(check(chain, given, frame));
    ASSIGN_OR_RETURN(const auto host, make_host_plan(*chain.chain, frame, plans_.device()));
    std::vector<uint64_t> all;
    for (const ProgramKey& program :
         host_programs(*chain.chain, frame, host.plan, plans_.device())) {
        ASSIGN_OR_RETURN(const uint64_t key, key_of_program(program));
        if (std::ranges::find(all, key) == all.end()) all.push_back(key);
    }
    std::copy_n(all.begin(), std::min(size_t(count), all.size()), keys);
    count = uint32_t(all.size());
    return {};
}

}  // namespace postchain::guest
