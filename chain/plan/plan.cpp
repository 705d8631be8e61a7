#include "chain/plan/plan.h"

#include <algorithm>
#include <iterator>

#include "chain/base/parameter.h"
#include "chain/plan/plan_print.h"

namespace postchain {
namespace {

struct FormatRow {
    const char* name;
    int channels, bytes;  // of a pixel; of a work list, bytes of a block
};

const FormatRow& row_of(Format format) {
    static constexpr FormatRow kRows[] = {
        {"rgba32f", 4, 16}, {"rgba16f", 4, 8},   {"rg32f", 2, 8}, {"rg16f", 2, 4},
        {"r32f", 1, 4},     {"r16f", 1, 2},      {"rgba8", 4, 4}, {"rg8", 2, 2},
        {"r8", 1, 1},       {"rgba32ui", 4, 16}, {"r32ui", 1, 4}, {"work_list", 0, 4}};
    static_assert(std::size(kRows) == size_t(Format::work_list) + 1);
    return kRows[size_t(format)];
}

bool same_on_all_sizes(const PlanTexture& a, PlanTexture b) {
    b.width = a.width;
    b.height = a.height;
    return a == b;
}

}  // namespace

const char* name_of(Format format) {
    return row_of(format).name;
}

int channels_of(Format format) {
    return row_of(format).channels;
}

int bytes_per_pixel(Format format) {
    return row_of(format).bytes;
}

Format plane_format(int channels, Precision precision) {
    const bool half = precision == Precision::fp16;
    if (channels == 1) return half ? Format::r16f : Format::r32f;
    if (channels == 2) return half ? Format::rg16f : Format::rg32f;
    return half ? Format::rgba16f : Format::rgba32f;
}

uint64_t Storage::bytes() const {
    const uint64_t header = format == Format::work_list ? kWorkListHeaderBytes : 0;
    return uint64_t(width) * uint64_t(height) * uint64_t(bytes_per_pixel(format)) *
               uint64_t(std::max(slices, 1)) +
           header;
}

std::string Storage::text() const {
    return concat(width, "x", height, slices > 0 ? concat("x", slices) : std::string(), " ",
                  name_of(format));
}

std::string ProgramKey::text() const {
    std::string text = file;
    for (const auto& [name, value] : defines) text += " " + name + "=" + value;
    return text;
}

uint64_t Plan::transient_bytes() const {
    uint64_t sum = 0;
    for (const auto& texture : textures)
        if (!texture.imported) sum += texture.bytes();
    return sum;
}

uint64_t Plan::peak_bytes() const {
    uint64_t peak = 0;
    for (int step = 0; step < int(steps.size()); ++step) {
        uint64_t alive = 0;
        for (const auto& texture : textures)
            if (texture.first_step <= step && step <= texture.last_step) alive += texture.bytes();
        peak = std::max(peak, alive);
    }
    return peak;
}

std::optional<Elision> found_in(const Elision& elision, const Plan& plan,
                                const std::vector<WorkDone>& done) {
    if (elision.work_list < 0) return elision;
    const std::string& name = plan.textures[size_t(elision.work_list)].name;
    for (const auto& list : done) {
        if (list.list != name) continue;
        const unsigned blocks = elision.outside ? list.of - list.blocks : list.blocks;
        if (blocks == 0) return std::nullopt;
        Elision found = elision;
        found.saving.taps = blocks * elision.taps_per_block;
        return found;
    }
    return elision;
}

std::string item_text(const Elision& elision, const Plan& plan) {
    return item_text(elision, plan.types());
}

std::array<int, 2> size_of(const PlanTexture& texture, const FrameSize& frame) {
    const auto [width, height] = texture.area.of(frame);
    if (texture.format == Format::work_list) return {width * height, 1};
    return {width, height};
}

bool same_shape(const Plan& a, const Plan& b) {
    // The least edge of a tile decides how large textures are (chain/plan/storage.h).
    const auto same_tiles = [](const PlanPass& x, const PlanPass& y) {
        return x.tiles.least_px == y.tiles.least_px;
    };
    if (a.steps.size() != b.steps.size() || a.outputs != b.outputs ||
        !std::equal(a.passes.begin(), a.passes.end(), b.passes.begin(), b.passes.end(),
                    same_tiles) ||
        !std::equal(a.textures.begin(), a.textures.end(), b.textures.begin(), b.textures.end(),
                    same_on_all_sizes))
        return false;
    for (size_t i = 0; i < a.steps.size(); ++i) {
        const Step &x = a.steps[i], &y = b.steps[i];
        if (x.pass != y.pass || x.name != y.name || !(x.program == y.program) ||
            x.bindings != y.bindings || x.uniforms.size() != y.uniforms.size() ||
            x.uniforms_type != y.uniforms_type || x.spread != y.spread ||
            x.groups[2] != y.groups[2] || x.work_list != y.work_list ||
            x.first_layer != y.first_layer)
            return false;
    }
    return true;
}

void fit(Plan& plan, int width, int height) {
    plan.width = width;
    plan.height = height;
    const auto frame_of = [&](int pass) {
        return FrameSize{width, height, pass < 0 ? 1 : plan.passes[size_t(pass)].tiles.px};
    };
    for (PlanTexture& texture : plan.textures) {
        const auto size = size_of(texture, frame_of(texture.pass));
        texture.width = size[0];
        texture.height = size[1];
    }
    for (Step& step : plan.steps) {
        const auto groups = step.spread.of(frame_of(step.pass));
        step.groups[0] = groups[0];
        step.groups[1] = groups[1];
    }
}

void find_lifetimes(Plan& plan, const std::vector<TextureId>& outputs) {
    for (auto& texture : plan.textures) texture.first_step = texture.last_step = -1;
    for (int i = 0; i < int(plan.steps.size()); ++i) {
        for (const auto& binding : plan.steps[size_t(i)].bindings) {
            auto& texture = plan.textures[size_t(binding.texture)];
            if (texture.first_step < 0) texture.first_step = i;
            texture.last_step = i;
        }
    }
    for (const TextureId id : outputs)
        if (auto& texture = plan.textures[size_t(id)]; texture.first_step >= 0)
            texture.last_step = int(plan.steps.size());
}

std::string Plan::name_of(const Step& step) const {
    return passes[size_t(step.pass)].type + "." + step.name;
}

std::vector<std::string> Plan::types() const {
    std::vector<std::string> types;
    for (const auto& pass : passes) types.push_back(pass.type);
    return types;
}

uint64_t Plan::hash() const {
    uint64_t hash = hash_text(plan_as_text(*this));
    for (const auto& step : steps) hash = hash_bytes(step.uniforms, hash);
    return hash;
}

}  // namespace postchain
