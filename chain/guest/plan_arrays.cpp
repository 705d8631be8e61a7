#include "chain/guest/plan_arrays.h"

#include <algorithm>
#include <iterator>

#include "chain/plan/bands.h"
#include "chain/plan/hazards.h"
#include "chain/plan/plan_bytes.h"

namespace postchain::guest {
namespace {

constexpr size_t kBlockAlignment = 256;  // of a constant buffer of D3D12; others need less

#define FORMAT(name, ...) \
    { name, #name, __VA_ARGS__ }
// Format, channels, depth, image, half: as in host_frame.cpp.
constexpr HostFormat kNeutralFormats[] = {
    FORMAT(PC_FORMAT_RGBA32F, 4, false, true, false),
    FORMAT(PC_FORMAT_RGBA16F, 4, false, true, true),
    FORMAT(PC_FORMAT_R11G11B10F, 3, false, true, true),
    FORMAT(PC_FORMAT_RGB9E5, 3, false, false, false),
    FORMAT(PC_FORMAT_RGBA16, 4, false, true, false),
    FORMAT(PC_FORMAT_RGBA8, 4, false, true, false),
    FORMAT(PC_FORMAT_BGRA8, 4, false, true, false),
    FORMAT(PC_FORMAT_RGB10A2, 4, false, true, false),
    FORMAT(PC_FORMAT_RGBA8_SRGB, 4, false, false, false),
    FORMAT(PC_FORMAT_BGRA8_SRGB, 4, false, false, false),
    FORMAT(PC_FORMAT_RGBA16S, 4, false, true, false),
    FORMAT(PC_FORMAT_RGBA8S, 4, false, true, false),
    FORMAT(PC_FORMAT_RG32F, 2, false, true, false),
    FORMAT(PC_FORMAT_RG16F, 2, false, true, true),
    FORMAT(PC_FORMAT_RG16, 2, false, true, false),
    FORMAT(PC_FORMAT_RG8, 2, false, true, false),
    FORMAT(PC_FORMAT_RG16S, 2, false, true, false),
    FORMAT(PC_FORMAT_RG8S, 2, false, true, false),
    FORMAT(PC_FORMAT_R32F, 1, false, true, false),
    FORMAT(PC_FORMAT_R16F, 1, false, true, true),
    FORMAT(PC_FORMAT_R16, 1, false, true, false),
    FORMAT(PC_FORMAT_R8, 1, false, true, false),
    FORMAT(PC_FORMAT_D32F, 1, true, false, false),
    FORMAT(PC_FORMAT_D24, 1, true, false, false),
    FORMAT(PC_FORMAT_D16, 1, true, false, false),
};
#undef FORMAT

// Both lists begin in one order.
static_assert(int(Format::rgba32f) + 1 == PC_FORMAT_RGBA32F &&
              int(Format::r8) + 1 == PC_FORMAT_R8 && int(Format::work_list) + 1 == PC_FORMAT_LIST);
pc_format neutral_format(Format format) {
    return pc_format(format) + 1;
}

constexpr bool same(uint32_t use, uint32_t neutral) {
    return use == neutral;
}
static_assert(same(kUseFetch, PC_PLAN_SAMPLED) && same(kUseImageRead, PC_PLAN_IMAGE_READ) &&
              same(kUseImageWrite, PC_PLAN_IMAGE_WRITE) && same(kUseListRead, PC_PLAN_LIST_READ) &&
              same(kUseListWrite, PC_PLAN_LIST_WRITE) && same(kUseLaunch, PC_PLAN_INDIRECT));

uint32_t unit_kind(Access access) {
    switch (access) {
        case Access::sample_nearest:
            return PC_PLAN_UNIT_TEXTURE;
        case Access::list:
            return PC_PLAN_UNIT_LIST;
        default:
            return PC_PLAN_UNIT_IMAGE;
    }
}

uint32_t index_of(int index) {
    return index < 0 ? PC_PLAN_NONE : uint32_t(index);
}

}  // namespace

const HostFormat* find_neutral_format(unsigned format) {
    for (const auto& known : kNeutralFormats)
        if (known.name == format) return &known;
    return nullptr;
}

PlanArrays::PlanArrays(Plan plan, const MaxFrameSize& max_size, std::vector<uint64_t> programs,
                       uint64_t shape)
    : PlanValues(std::move(plan), kBlockAlignment),
      programs_(std::move(programs)),
      shape_(shape),
      shared_(share_storage(this->plan(), max_size)),
      names_(this->plan().textures.size()),
      storage_(shared_.numbers()) {
    for (const Storage& storage : shared_.all) {
        const bool list = storage.format == Format::work_list;
        slots_.push_back({neutral_format(storage.format), uint32_t(storage.width),
                          uint32_t(storage.height), uint32_t(storage.slices), storage.bytes(),
                          list ? uint32_t(kWorkListHeaderBytes) : 0, 0});
    }
    make_arrays();
    // Room for the bands of the largest frame, so that a frame of another size allocates nothing.
    Plan largest = this->plan();
    fit(largest, max_size.width, max_size.height);
    size_t most = 0;
    for (const Step& step : largest.steps)
        for (Launch launch = launch_of(largest, step); launch.bands.more(); launch.next()) ++most;
    dispatches_.reserve(most);
}

void PlanArrays::take_values(Plan plan) {
    PlanValues::take_values(std::move(plan));
    make_arrays();
}

void PlanArrays::make_arrays() {
    const Plan& plan = this->plan();
    made_width_ = plan.width;
    made_height_ = plan.height;
    texts_.clear();
    texts_.reserve(plan.steps.size() + 3 * plan.elisions.size());  // pointers to them stay valid
    const auto text = [&](std::string made) {
        return texts_.emplace_back(std::move(made)).c_str();
    };
    textures_.clear();
    for (size_t t = 0; t < plan.textures.size(); ++t) {
        const PlanTexture& from = plan.textures[t];
        pc_plan_texture to = {};
        to.name = from.name.c_str();
        to.slot = index_of(shared_.of[t]);
        to.format = from.imported ? pc_format(PC_FORMAT_NONE) : neutral_format(from.format);
        to.first_step = index_of(from.first_step);
        to.last_step = index_of(from.last_step);
        textures_.push_back(to);
    }
    const std::vector<StepBytes> bytes = bytes_of_steps(plan);
    steps_.clear();
    bindings_.clear();
    for (size_t i = 0; i < plan.steps.size(); ++i) {
        const Step& from = plan.steps[i];
        pc_plan_step to = {};
        to.name = text(plan.name_of(from));
        to.program = programs_[i];
        to.binding_count = uint32_t(from.bindings.size());
        to.bands_wait = bands_wait(from);
        to.uniform_offset = uint32_t(block(i).offset);
        to.uniform_bytes = uint32_t(block(i).bytes);
        to.fetches = from.taps;
        if (bytes[i].counts) {
            to.read_bytes = bytes[i].read;
            to.written_bytes = bytes[i].written;
        }
        steps_.push_back(to);
        for (const Binding& binding : from.bindings)
            bindings_.push_back({unit_kind(binding.access), uint32_t(binding.unit),
                                 uint32_t(binding.texture), uses_of(from, binding)});
    }
    size_t first = 0;
    for (pc_plan_step& step : steps_) {
        step.bindings = bindings_.data() + first;
        first += step.binding_count;
    }
    elisions_.clear();
    for (const Elision& from : plan.elisions)
        elisions_.push_back({text(item_text(from, plan)), text(from.rule), text(text_of(from.fact)),
                             from.saving.taps, from.saving.bytes, uint32_t(from.saving.dispatches),
                             0});
    make_barriers();
}

void PlanArrays::make_barriers() {
    const std::vector<uint32_t> waits = waits_of(plan(), storage_);
    const std::vector<Transition> all = transitions_of(plan(), storage_, waits);
    transitions_.clear();
    barriers_ = 0;
    for (pc_plan_step& step : steps_) step.barrier_count = 0;
    for (const Transition& from : all) {
        pc_plan_barrier to = {uint32_t(from.texture), index_of(from.before), from.from, from.to};
        if (from.before < 0) {
            to.before = PC_PLAN_NONE;
            const int slot = shared_.of[size_t(from.texture)];
            if (slot >= 0 && slots_[size_t(slot)].zero_bytes > 0) to.from = PC_PLAN_ZEROED;
        }
        transitions_.push_back(to);
        ++steps_[size_t(from.step)].barrier_count;
    }
    size_t first = 0;
    for (size_t i = 0; i < steps_.size(); ++i) {
        steps_[i].barriers = transitions_.data() + first;
        first += steps_[i].barrier_count;
        barriers_ += waits[i] != 0;
        steps_[i].level = barriers_;
    }
}

void PlanArrays::set_dispatches() {
    dispatches_.clear();
    for (size_t i = 0; i < steps_.size(); ++i) {
        const Step& step = plan().steps[i];
        Launch launch = launch_of(plan(), step);
        steps_[i].list = launch.by_list ? uint32_t(step.work_list) : PC_PLAN_NONE;
        const size_t first = dispatches_.size();
        while (launch.bands.more()) {
            const Band band = launch.next();
            dispatches_.push_back({{band.first[0], band.first[1]},
                                   {band.count[0], band.count[1], uint32_t(step.groups[2])},
                                   0});
        }
        steps_[i].dispatch_count = uint32_t(dispatches_.size() - first);
    }
    size_t first = 0;
    for (pc_plan_step& step : steps_) {
        step.dispatches = dispatches_.data() + first;
        first += step.dispatch_count;
    }
}

void PlanArrays::list(const HostPlan& host, pc_plan& out) {
    if (share_imports(plan(), names_, storage_)) make_barriers();
    for (size_t t = 0; t < textures_.size(); ++t) {
        const PlanTexture& texture = plan().textures[t];
        textures_[t].width = uint32_t(texture.width);
        textures_[t].height = uint32_t(texture.height);
        textures_[t].host = names_[t];
    }
    set_dispatches();
    out.result = index_of(host.result);
    out.shape = shape_;
    out.slot_count = uint32_t(slots_.size());
    out.texture_count = uint32_t(textures_.size());
    out.step_count = uint32_t(steps_.size());
    out.elision_count = uint32_t(elisions_.size());
    out.slots = slots_.data();
    out.textures = textures_.data();
    out.steps = steps_.data();
    out.elisions = elisions_.data();
    out.uniforms = bytes().data();
    out.uniform_bytes = bytes().size();
    out.slot_bytes = shared_.bytes();
    out.made_width = uint32_t(made_width_);
    out.made_height = uint32_t(made_height_);
}

}  // namespace postchain::guest
