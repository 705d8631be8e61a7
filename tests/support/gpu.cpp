#include "tests/support/gpu.h"

#include <gtest/gtest.h>

#include "chain/egl/context.h"
#include "tests/passes/registry.h"
#include "tests/support/status.h"

namespace postchain::test {

const PassRegistry& every_pass() {
    static const PassRegistry registry([] {
        std::vector<PassType> types = builtin_passes().types();
        for (const PassType& type : fixture_passes().types()) types.push_back(type);
        return types;
    }());
    return registry;
}

Executor& executor() {
    static const std::unique_ptr<egl::Context> context = must(egl::Context::create());
    static Executor made(context->device());
    return made;
}

void append(Chain& chain, const std::string& type, Settings settings) {
    Pass* pass = chain.append(every_pass(), type);
    ASSERT_NE(pass, nullptr) << "no pass '" << type << "'";
    const ParameterTable& table = *every_pass().find(type)->parameters;
    for (const auto& [key, value] : settings)
        ASSERT_EQ(error_of(table.set(pass->parameters(), key, value)), "") << type;
}

Chain chain_of(const std::string& type, Settings settings) {
    Chain chain;
    append(chain, type, settings);
    return chain;
}

PlanOptions whole_passes() {
    PlanOptions options;
    for (const auto& rule : elision_rules(every_pass())) options.rules_off.insert(rule.name);
    options.rules_off.erase(kRuleUnusedStep);
    return options;
}

PlanOptions on_device(PlanOptions options) {
    options.device = executor().device_class();
    return options;
}

FramePlanes filter(const Chain& chain, const FrameDescription& frame, const FramePlanes& planes,
                   const PlanOptions& options, Plan* plan) {
    const Plan made = must(make_plan(chain, frame, on_device(options)));
    FramePlanes result = must(executor().filter(made, planes));
    if (plan) *plan = made;
    return result;
}

Stages filter_with_stages(const Chain& chain, const FrameDescription& frame,
                          const FramePlanes& planes, const PlanOptions& options) {
    Stages stages;
    stages.outputs =
        must(executor().filter(must(make_plan(chain, frame, on_device(options))), planes,
                               [&](const Step&, const PlanTexture& texture, const ImageF& pixels) {
                                   stages.stages[texture.name] = pixels;
                                   return Status();
                               }));
    return stages;
}

ReferenceFrame reference(const Chain& chain, const FrameDescription& frame,
                         const FramePlanes& planes, const PlanOptions& options) {
    return must(run_reference(chain, frame, planes, on_device(options)));
}

}  // namespace postchain::test
