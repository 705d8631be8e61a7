#include "chain/merge.h"

#include <algorithm>
#include <map>
#include <set>

namespace postchain {
namespace {

// Index of the last step that writes each texture; -1 = none.
std::vector<int> last_writers(const Plan& plan) {
    std::vector<int> last(plan.textures.size(), -1);
    for (int i = 0; i < int(plan.steps.size()); ++i)
        for (const auto& binding : plan.steps[size_t(i)].bindings)
            if (plan.steps[size_t(i)].writes(binding)) last[size_t(binding.texture)] = i;
    return last;
}

// The steps that write a texture together (each its own blocks of the frame, or one over another),
// those that read it in between, this step among them, in order.
std::vector<int> steps_together(const Plan& plan, int step) {
    std::set<int> steps = {step};
    for (size_t before = 0; before < steps.size();) {
        before = steps.size();
        std::map<TextureId, std::vector<int>> writers;
        for (int i : steps)
            for (const auto& binding : plan.steps[size_t(i)].bindings)
                if (plan.steps[size_t(i)].writes(binding)) writers[binding.texture];
        for (int i = 0; i < int(plan.steps.size()); ++i)
            for (const auto& binding : plan.steps[size_t(i)].bindings)
                if (plan.steps[size_t(i)].writes(binding) && writers.contains(binding.texture))
                    writers[binding.texture].push_back(i);
        for (int i = 0; i < int(plan.steps.size()); ++i)
            for (const auto& binding : plan.steps[size_t(i)].bindings) {
                const auto found = writers.find(binding.texture);
                if (found != writers.end() && i >= found->second.front() &&
                    i <= found->second.back())
                    steps.insert(i);
            }
    }
    return {steps.begin(), steps.end()};
}

bool contains(const std::vector<int>& sorted, int step) {
    return std::binary_search(sorted.begin(), sorted.end(), step);
}

class Merger {
  public:
    Merger(const Plan& a, const Plan& b)
        : a_(a), b_(b), last_writers_a_(last_writers(a)), last_writers_b_(last_writers(b)) {
        merged_.plan = a;
        merged_.outputs[0] = a.outputs;
        for (const auto& pass : b.passes) merged_.plan.passes.push_back(pass);
        merged_.plan.reads = a.reads | b.reads;
        merged_.plan.missing_neighbors.insert(b.missing_neighbors.begin(),
                                              b.missing_neighbors.end());
    }

    MergedPlan merge() {
        import_textures();
        std::vector<char> decided(b_.steps.size(), 0), shared = decided;
        for (int i = 0; i < int(b_.steps.size()); ++i) {
            if (!decided[size_t(i)]) {
                // Steps that write one texture together are shared together or not at all.
                const std::vector<int> group = steps_together(b_, i);
                const bool found = share(group);
                for (int step : group) {
                    decided[size_t(step)] = 1;
                    shared[size_t(step)] = found;
                }
            }
            if (shared[size_t(i)])
                ++merged_.shared_steps;
            else
                append(b_.steps[size_t(i)]);
        }
        for (const auto& [role, id] : b_.outputs) merged_.outputs[1][role] = map_[size_t(id)];
        merge_elisions();
        std::vector<TextureId> outputs;
        for (const auto& of_one : merged_.outputs)
            for (const auto& [role, id] : of_one) outputs.push_back(id);
        find_lifetimes(merged_.plan, outputs);
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
        if (texture.pass >= 0) texture.pass += int(merged_.plan.passes.size() - b_.passes.size());
        texture.first_step = texture.last_step = -1;
        merged_.plan.textures.push_back(std::move(texture));
        return TextureId(merged_.plan.textures.size()) - 1;
    }

    // True if step `in_a` of A does the same as step `in_b` of B. The inputs of B's step must be
    // finished by steps that are already shared, in B and in A, or written in these groups.
    bool same(int in_b, const std::vector<int>& group, int in_a,
              const std::vector<int>& mine_together) const {
        const Step& step = b_.steps[size_t(in_b)];
        const Step& mine = a_.steps[size_t(in_a)];
        if (step.program != mine.program || step.uniforms != mine.uniforms ||
            step.groups != mine.groups || step.first_layer != mine.first_layer ||
            step.bindings.size() != mine.bindings.size())
            return false;
        for (size_t i = 0; i < step.bindings.size(); ++i) {
            const Binding& b = step.bindings[i];
            const Binding& a = mine.bindings[i];
            if (b.unit != a.unit || b.access != a.access || step.writes(b) != mine.writes(a))
                return false;
            if (!step.writes(b)) {
                const int last_in_b = last_writers_b_[size_t(b.texture)];
                const int last_in_a = last_writers_a_[size_t(a.texture)];
                if (map_[size_t(b.texture)] != a.texture ||
                    (last_in_b >= in_b && !contains(group, last_in_b)) ||
                    (last_in_a >= in_a && !contains(mine_together, last_in_a)))
                    return false;
                continue;
            }
            const PlanTexture& to = b_.textures[size_t(b.texture)];
            const PlanTexture& from = a_.textures[size_t(a.texture)];
            if (to.format != from.format || to.width != from.width || to.height != from.height)
                return false;
            if (map_[size_t(b.texture)] >= 0 && map_[size_t(b.texture)] != a.texture) return false;
        }
        return true;
    }

    // Finds steps of A that do the same as these of B, and maps their results.
    bool share(const std::vector<int>& group) {
        for (int first = 0; first < int(a_.steps.size()); ++first) {
            if (a_.steps[size_t(first)].program != b_.steps[size_t(group.front())].program)
                continue;
            const std::vector<int> mine = steps_together(a_, first);
            if (mine.size() != group.size() || mine.front() != first) continue;
            const std::vector<TextureId> before = map_;
            bool all = true;
            for (size_t i = 0; i < group.size() && all; ++i) {
                all = same(group[i], group, mine[i], mine);
                const Step& step = b_.steps[size_t(group[i])];
                for (size_t k = 0; k < step.bindings.size() && all; ++k)
                    if (step.writes(step.bindings[k]))
                        map_[size_t(step.bindings[k].texture)] =
                            a_.steps[size_t(mine[i])].bindings[k].texture;
            }
            if (all) return true;
            map_ = before;
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

    // A plane that one of them reads is not elided.
    void merge_elisions() {
        merged_.elisions = {a_.elisions, b_.elisions};
        for (Elision& elision : merged_.elisions[1])
            if (elision.work_list >= 0) elision.work_list = map_[size_t(elision.work_list)];
        std::vector<Elision>& all = merged_.plan.elisions;
        std::erase_if(all, [&](const Elision& elision) {
            const auto& others = b_.elisions;
            return elision.pass < 0 &&
                   std::find(others.begin(), others.end(), elision) == others.end();
        });
        for (Elision elision : merged_.elisions[1]) {
            if (elision.pass < 0) continue;
            elision.pass += int(a_.passes.size());
            all.push_back(std::move(elision));
        }
    }

    const Plan& a_;
    const Plan& b_;
    const std::vector<int> last_writers_a_, last_writers_b_;
    MergedPlan merged_;
    std::vector<TextureId> map_;  // B's texture -> merged texture; -1 = not yet known
};

}  // namespace

MergedPlan merge_plans(const Plan& a, const Plan& b) {
    return Merger(a, b).merge();
}

}  // namespace postchain
