#include "chain/plan/plan_bytes.h"

#include <map>
#include <set>

namespace postchain {
namespace {

StepBytes bytes_of(const Plan& plan, const Step& step) {
    std::set<TextureId> read, written;
    for (const Binding& binding : step.bindings)
        (step.writes(binding) ? written : read).insert(binding.texture);
    StepBytes bytes;
    // The slices of an array that are the step's layers.
    const auto of = [&](TextureId id) {
        const PlanTexture& texture = plan.textures[size_t(id)];
        if (texture.slices == 0 || step.layers == 0) return texture.bytes();
        return texture.bytes() / uint64_t(texture.slices) * uint64_t(step.layers);
    };
    for (const TextureId texture : read) bytes.read += of(texture);
    for (const TextureId texture : written) bytes.written += of(texture);
    return bytes;
}

// The lists of one step other than the one whose steps move most.
std::set<TextureId> empty_lists(const Plan& plan, const std::vector<StepBytes>& bytes) {
    std::map<TextureId, uint64_t> by_list;
    for (size_t i = 0; i < plan.steps.size(); ++i)
        if (plan.steps[i].work_list >= 0)
            by_list[plan.steps[i].work_list] += bytes[i].read + bytes[i].written;
    std::set<TextureId> empty;
    for (const Step& step : plan.steps) {
        TextureId most = -1;
        for (const Binding& binding : step.bindings) {
            const auto list = by_list.find(binding.texture);
            if (list == by_list.end() || !step.writes(binding)) continue;
            if (most >= 0) empty.insert(list->second > by_list[most] ? most : list->first);
            if (most < 0 || list->second > by_list[most]) most = list->first;
        }
    }
    return empty;
}

}  // namespace

std::vector<StepBytes> bytes_of_steps(const Plan& plan) {
    std::vector<StepBytes> bytes;
    for (const Step& step : plan.steps) bytes.push_back(bytes_of(plan, step));
    const std::set<TextureId> empty = empty_lists(plan, bytes);
    for (size_t i = 0; i < plan.steps.size(); ++i)
        bytes[i].counts = empty.count(plan.steps[i].work_list) == 0;
    return bytes;
}

double bytes_per_pixel(const Plan& plan, int pass) {
    const std::vector<StepBytes> bytes = bytes_of_steps(plan);
    uint64_t sum = 0;
    for (size_t i = 0; i < plan.steps.size(); ++i)
        if (plan.steps[i].pass == pass) sum += bytes[i].moved();
    return double(sum) / (double(plan.width) * plan.height);
}

double bytes_per_pixel(const Plan& plan) {
    double sum = 0;
    for (size_t i = 0; i < plan.passes.size(); ++i) sum += bytes_per_pixel(plan, int(i));
    return sum;
}

}  // namespace postchain
