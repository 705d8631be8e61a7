#include "tests/support/gpu.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "chain/egl/context.h"
#include "tests/passes/registry.h"

namespace postchain::test {
namespace {

// The value. Ends the process on failure, because no test can run without it.
template <class T>
T must(Result<T> result) {
    if (result.ok()) return std::move(*result);
    std::fprintf(stderr, "%s\n", result.status().message().c_str());
    std::abort();
}

}  // namespace

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
    for (const auto& [key, value] : settings) {
        const Status status = table.set(pass->parameters(), key, value);
        ASSERT_TRUE(status.ok()) << type << "." << key << ": " << status.message();
    }
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

FramePlanes filter(const Chain& chain, const FrameDescription& frame, const FramePlanes& planes,
                   const PlanOptions& options, Plan* plan) {
    auto made = make_plan(chain, frame, options);
    EXPECT_TRUE(made.ok()) << made.status().message();
    if (!made.ok()) return {};
    auto result = executor().filter(*made, planes);
    EXPECT_TRUE(result.ok()) << result.status().message();
    if (plan) *plan = *made;
    return result.ok() ? std::move(*result) : FramePlanes();
}

Stages filter_with_stages(const Chain& chain, const FrameDescription& frame,
                          const FramePlanes& planes, const PlanOptions& options) {
    Stages stages;
    auto made = make_plan(chain, frame, options);
    EXPECT_TRUE(made.ok()) << made.status().message();
    if (!made.ok()) return stages;
    auto result = executor().filter(
        *made, planes, [&](const Step&, const PlanTexture& texture, const ImageF& pixels) {
            stages.stages[texture.name] = pixels;
            return Status();
        });
    EXPECT_TRUE(result.ok()) << result.status().message();
    if (result.ok()) stages.outputs = std::move(*result);
    return stages;
}

ReferenceFrame reference(const Chain& chain, const FrameDescription& frame,
                         const FramePlanes& planes, const PlanOptions& options) {
    auto result = run_reference(chain, frame, planes, options);
    EXPECT_TRUE(result.ok()) << result.status().message();
    return result.ok() ? std::move(*result) : ReferenceFrame();
}

}  // namespace postchain::test
