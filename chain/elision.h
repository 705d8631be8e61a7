// The rules by which work is left out. Each has a name, under which it is switched off or on
// (--no-elide=RULES, --elide RULES) and under which plans, sidecars and reports say what it did.
// The rules here judge steps, planes and whole passes; those of one pass are in PassType::rules.
#pragma once

#include <string>
#include <vector>

namespace postchain {

struct ElisionRule {
    std::string name;           // of this rule alone in a registry
    bool on_by_default = true;  // those that are not are used only when asked for
    std::string help;           // what it leaves out, one line
};

inline constexpr const char* kRuleConfiguration = "off_by_configuration";
inline constexpr const char* kRuleFacts = "identity_by_facts";
inline constexpr const char* kRuleCameraCut = "camera_cut";
inline constexpr const char* kRuleUnusedPlane = "unused_plane";
inline constexpr const char* kRuleUnusedStep = "unused_step";
inline constexpr const char* kRuleUnusedOutput = "unused_output";
inline constexpr const char* kRuleMissingPlane = "missing_plane";

// Those that belong to no pass.
const std::vector<ElisionRule>& chain_rules();

}  // namespace postchain
