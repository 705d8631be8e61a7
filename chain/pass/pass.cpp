#include "chain/pass/pass.h"

#include <algorithm>

namespace postchain {

TextureId PassPlanner::input(Role role) const {
    const auto found = target_.current.find(role);
    return found == target_.current.end() ? -1 : found->second;
}

TextureId PassPlanner::texture(const std::string& name, Format format, const Area& area) {
    PlanTexture texture;
    texture.name =
        std::to_string(target_.pass) + "." + target_.plan.passes.back().type + "." + name;
    texture.format = format;
    texture.pass = target_.pass;
    texture.area = area;
    const auto size = size_of(texture, frame_size());
    texture.width = size[0];
    texture.height = size[1];
    target_.plan.textures.push_back(std::move(texture));
    return TextureId(target_.plan.textures.size()) - 1;
}

TextureId PassPlanner::layers(const std::string& name, Format format, const Area& area) {
    return array(name, format, area, context_.frame.layers);
}

TextureId PassPlanner::array(const std::string& name, Format format, const Area& area, int planes) {
    const TextureId id = texture(name, format, area);
    target_.plan.textures.back().slices = planes;
    return id;
}

FrameSize PassPlanner::frame_size() const {
    return {context_.frame.width, context_.frame.height, target_.plan.passes.back().tiles.px};
}

const PlanTexture& PassPlanner::describe(TextureId texture) const {
    return target_.plan.textures[size_t(texture)];
}

void PassPlanner::step(Step step) {
    step.pass = target_.pass;
    const auto groups = step.spread.of(frame_size());
    step.groups[0] = groups[0];
    step.groups[1] = groups[1];
    // The same for frames of all sizes; the step's taps are those of this one.
    const auto of_plane = uint64_t(groups[0]) * uint64_t(groups[1]) * uint64_t(step.groups[2]);
    if (step.group_taps == 0 && step.taps > 0)
        step.group_taps = (step.taps + of_plane - 1) / of_plane;
    target_.plan.steps.push_back(std::move(step));
}

void PassPlanner::output(Role role, TextureId texture) {
    if (texture < 0)
        target_.current.erase(role);
    else
        target_.current[role] = texture;
}

void PassPlanner::unused(const std::string& step, Fact why) {
    target_.reasons[{target_.pass, step}] = std::move(why);
}

void PassPlanner::elide(Elision elision) {
    elision.pass = target_.pass;
    target_.plan.elisions.push_back(std::move(elision));
}

void PassPlanner::fail(Status status) {
    if (target_.status.ok()) target_.status = std::move(status);
}

void add_layered_step(PassPlanner& planner, Step step, const std::vector<Binding>& arrays,
                      uint64_t taps) {
    const int layers = planner.has(Role::layers) ? planner.context().frame.layers : 0;
    if (layers == 0) {
        planner.step(std::move(step));
        return;
    }
    const FrameDescription& frame = planner.context().frame;
    const auto groups = step.spread.of({frame.width, frame.height});
    for (int first = 0; first < layers; first += kLayersPerStep) {
        Step one = step;
        one.layers = std::min(layers, kLayersPerStep);
        one.first_layer = std::min(first, layers - one.layers);
        one.taps += taps * uint64_t(one.layers);
        if (one.group_taps > 0)
            one.group_taps +=
                taps * uint64_t(one.layers) / (uint64_t(groups[0]) * uint64_t(groups[1]));
        one.program.defines["LAYERS"] = std::to_string(one.layers);
        if (first > 0) {
            one.name += concat("_layers_", first);
            one.program.defines["LAYERS_ONLY"] = "1";
            std::erase_if(one.bindings, [](const Binding& b) { return b.access == Access::write; });
        }
        one.bindings.insert(one.bindings.end(), arrays.begin(), arrays.end());
        planner.step(std::move(one));
    }
}

void UniformWriter::write(std::string_view name, std::string_view type,
                          std::span<const std::byte> bytes) {
    for (Step& step : plan_.steps) {
        if (step.pass != pass_ || step.uniforms_type != type) continue;
        // A step over many layers runs in parts, NAME_layers_4 (add_layered_step()).
        const std::string_view own =
            std::string_view(step.name).substr(0, step.name.starts_with(name) ? name.size() : 0);
        const std::string_view rest = std::string_view(step.name).substr(own.size());
        if (!name.empty() && (own != name || !(rest.empty() || rest.starts_with("_layers_"))))
            continue;
        step.uniforms.resize(bytes.size());
        std::copy(bytes.begin(), bytes.end(), step.uniforms.begin());
    }
}

void plan_pass(const PassOnFrame& pass, PassPlanner& planner) {
    const TextureId color = planner.input(Role::color), layers = planner.input(Role::layers);
    pass.plan(planner);
    if (layers >= 0 && planner.input(Role::color) != color && planner.input(Role::layers) == layers)
        planner.fail(Status(
            StatusCode::chain,
            "filters color alone, and this frame has extra layers; leave the layers or the pass "
            "out (of a new pass: docs/adding_a_pass.md says what filters them)"));
}

Reach reach_of(const Pass& pass, const FrameDescription& frame) {
    const auto resolved = pass.resolve(frame);
    return resolved.ok() ? (*resolved)->reach() : Reach{};
}

std::vector<ResolvedPass> Pass::every_shape(const FrameDescription& frame) const {
    std::vector<ResolvedPass> shapes;
    if (auto resolved = resolve(frame); resolved.ok()) shapes.push_back(std::move(*resolved));
    return shapes;
}

const PassType* PassRegistry::find(std::string_view name) const {
    for (const auto& type : types_)
        if (type.name == name) return &type;
    return nullptr;
}

std::vector<ElisionRule> elision_rules(const PassRegistry& registry) {
    std::vector<ElisionRule> rules = chain_rules();
    for (const auto& type : registry.types())
        rules.insert(rules.end(), type.rules.begin(), type.rules.end());
    return rules;
}

}  // namespace postchain
