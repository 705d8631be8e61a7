#include "chain/plan/plan.h"

#include <algorithm>

#include "chain/base/parameter.h"
#include "chain/plan/plan_print.h"

namespace postchain {
namespace {

bool same_on_all_sizes(const PlanTexture& a, PlanTexture b) {
    b.width = a.width;
    b.height = a.height;
    return a == b;
}

}  // namespace

const char* name_of(Format format) {
    switch (format) {
        case Format::rgba32f:
            return "rgba32f";
        case Format::rgba16f:
            return "rgba16f";
        case Format::rg32f:
            return "rg32f";
        case Format::rg16f:
            return "rg16f";
        case Format::r32f:
            return "r32f";
        case Format::r16f:
            return "r16f";
        case Format::rgba8:
            return "rgba8";
        case Format::rg8:
            return "rg8";
        case Format::r8:
            return "r8";
        case Format::rgba32ui:
            return "rgba32ui";
        case Format::r32ui:
            return "r32ui";
        case Format::work_list:
            return "work_list";
    }
    return "unknown";
}

int channels_of(Format format) {
    switch (format) {
        case Format::rgba32f:
        case Format::rgba16f:
        case Format::rgba8:
        case Format::rgba32ui:
            return 4;
        case Format::rg32f:
        case Format::rg16f:
        case Format::rg8:
            return 2;
        case Format::r32f:
        case Format::r16f:
        case Format::r8:
        case Format::r32ui:
            return 1;
        case Format::work_list:
            return 0;
    }
    return 0;
}

int bytes_per_pixel(Format format) {
    switch (format) {
        case Format::rgba32f:
        case Format::rg32f:
        case Format::r32f:
        case Format::rgba32ui:
        case Format::r32ui:
            return 4 * channels_of(format);
        case Format::rgba16f:
        case Format::rg16f:
        case Format::r16f:
            return 2 * channels_of(format);
        case Format::rgba8:
        case Format::rg8:
        case Format::r8:
            return channels_of(format);
        case Format::work_list:
            return 4;
    }
    return 0;
}

Format plane_format(int channels, Precision precision) {
    const bool half = precision == Precision::fp16;
    if (channels == 1) return half ? Format::r16f : Format::r32f;
    if (channels == 2) return half ? Format::rg16f : Format::rg32f;
    return half ? Format::rgba16f : Format::rgba32f;
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
            if (texture.first_step >= 0 && texture.first_step <= step && step <= texture.last_step)
                alive += texture.bytes();
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
    for (const auto& step : steps) {
        hash = hash_text(
            {reinterpret_cast<const char*>(step.uniforms.data()), step.uniforms.size()}, hash);
    }
    return hash;
}

}  // namespace postchain
