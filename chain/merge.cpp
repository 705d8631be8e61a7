#include "chain/merge.h"

namespace postchain {
namespace {

// How often each texture is written. One that is written in several steps is not the same thing
// all the time: its steps are never shared.
std::vector<int> count_writes(const Plan& plan) {
    std::vector<int> writes(plan.textures.size(), 0);
    for (const auto& step : plan.steps)
        for (const auto& binding : step.bindings)
            if (step.writes(binding)) ++writes[size_t(binding.texture)];
    return writes;
}

class Merger {
  public:
    Merger(const Plan& a, const Plan& b) : b_(b), writes_a_(count_writes(a)) {
        merged_.plan = a;
        merged_.outputs[0] = a.outputs;
        for (const auto& pass : b.passes) merged_.plan.passes.push_back(pass);
        for (const auto& left : b.left_out) merged_.plan.left_out.push_back(left);
        merged_.plan.reads = a.reads | b.reads;
    }

    MergedPlan merge() {
        import_textures();
        const std::vector<int> writes = count_writes(b_);
        const size_t steps_of_a = merged_.plan.steps.size();
        for (const Step& step : b_.steps) {
            bool once = true;
            for (const auto& binding : step.bindings) once &= writes[size_t(binding.texture)] <= 1;
            if (once && share(step, steps_of_a)) continue;
            append(step);
        }
        for (const auto& [role, id] : b_.outputs) merged_.outputs[1][role] = map_[size_t(id)];
        find_lifetimes();
        return std::move(merged_);
    }

  private:
    void import_textures() {
        auto& textures = merged_.plan.textures;
        map_.assign(b_.textures.size(), -1);
        for (size_t i = 0; i < b_.textures.size(); ++i) {
            const PlanTexture& texture = b_.textures[i];
            if (!texture.imported) continue;
            for (size_t t = 0; t < textures.size(); ++t)
                if (textures[t].imported && textures[t].role == texture.role) map_[i] = int(t);
            if (map_[i] < 0) map_[i] = add(texture);
        }
    }

    TextureId add(PlanTexture texture) {
        if (!texture.imported) texture.name = "b." + texture.name;
        texture.first_step = texture.last_step = -1;
        merged_.plan.textures.push_back(std::move(texture));
        return TextureId(merged_.plan.textures.size()) - 1;
    }

    // Is `mine`, a step of A, what `step` of B does? B's textures are known where they are read.
    bool same(const Step& step, const Step& mine) const {
        if (step.program != mine.program || step.block != mine.block ||
            step.groups != mine.groups || step.bindings.size() != mine.bindings.size())
            return false;
        for (size_t i = 0; i < step.bindings.size(); ++i) {
            const Binding& b = step.bindings[i];
            const Binding& a = mine.bindings[i];
            if (b.unit != a.unit || b.access != a.access || step.writes(b) != mine.writes(a))
                return false;
            const bool imported = merged_.plan.textures[size_t(a.texture)].imported;
            if (!imported && writes_a_[size_t(a.texture)] != 1) return false;
            if (!step.writes(b)) {
                if (map_[size_t(b.texture)] != a.texture) return false;
                continue;
            }
            const PlanTexture& to = b_.textures[size_t(b.texture)];
            const PlanTexture& from = merged_.plan.textures[size_t(a.texture)];
            if (to.format != from.format || to.width != from.width || to.height != from.height)
                return false;
        }
        return true;
    }

    bool share(const Step& step, size_t steps_of_a) {
        for (size_t i = 0; i < steps_of_a; ++i) {
            const Step& mine = merged_.plan.steps[i];
            if (!same(step, mine)) continue;
            for (size_t k = 0; k < step.bindings.size(); ++k)
                if (step.writes(step.bindings[k]))
                    map_[size_t(step.bindings[k].texture)] = mine.bindings[k].texture;
            ++merged_.shared_steps;
            return true;
        }
        return false;
    }

    void append(Step step) {
        TextureId own_list = -1;
        for (auto& binding : step.bindings) {
            TextureId& id = map_[size_t(binding.texture)];
            if (id < 0) id = add(b_.textures[size_t(binding.texture)]);
            if (step.work_list == binding.texture) own_list = id;
            binding.texture = id;
        }
        step.work_list = own_list;
        step.pass += int(merged_.plan.passes.size() - b_.passes.size());
        merged_.plan.steps.push_back(std::move(step));
    }

    void find_lifetimes() {
        Plan& plan = merged_.plan;
        for (auto& texture : plan.textures) texture.first_step = texture.last_step = -1;
        for (int i = 0; i < int(plan.steps.size()); ++i) {
            for (const auto& binding : plan.steps[size_t(i)].bindings) {
                auto& texture = plan.textures[size_t(binding.texture)];
                if (texture.first_step < 0) texture.first_step = i;
                texture.last_step = i;
            }
        }
        // One past the last step: nobody gives them back before they are read.
        for (const auto& outputs : merged_.outputs)
            for (const auto& [role, id] : outputs)
                if (auto& texture = plan.textures[size_t(id)]; texture.first_step >= 0)
                    texture.last_step = int(plan.steps.size());
    }

    const Plan& b_;
    const std::vector<int> writes_a_;
    MergedPlan merged_;
    std::vector<TextureId> map_;  // B's texture -> merged texture; -1 = not yet known
};

}  // namespace

MergedPlan merge_plans(const Plan& a, const Plan& b) {
    return Merger(a, b).merge();
}

}  // namespace postchain
