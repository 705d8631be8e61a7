// Elided work and the rules that elide it, as data. The sentences that people read ("left out") are
// made here from the fields.
//
// A rule has a name. It switches the rule off or on (--no-elide=RULES, --elide RULES), and plans,
// sidecars and reports use it. The rules here judge steps, planes and whole passes; those of one
// pass are in PassType::rules.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "chain/base/json.h"

namespace postchain {

struct ElisionRule {
    std::string name;           // unique in a registry
    bool on_by_default = true;  // other rules are used only if requested
    std::string help;           // the work it elides, one line
};

inline constexpr const char* kRuleConfiguration = "off_by_configuration";
inline constexpr const char* kRuleFacts = "identity_by_facts";
inline constexpr const char* kRuleCameraCut = "camera_cut";
inline constexpr const char* kRuleUnusedPlane = "unused_plane";
inline constexpr const char* kRuleUnusedStep = "unused_step";
inline constexpr const char* kRuleUnusedOutput = "unused_output";
inline constexpr const char* kRuleMissingPlane = "missing_plane";

// Names of rules; one of them is found without a string being made.
using RuleNames = std::set<std::string, std::less<>>;

// The rules that belong to no pass.
const std::vector<ElisionRule>& chain_rules();

enum class ElisionKind {
    pass,    // a whole pass
    plane,   // a plane of the frame, or a pass's reading of it
    step,    // a step of a pass
    output,  // a plane that a pass could make
    blocks,  // blocks of pixels of a step, found on the device
};
const char* name_of(ElisionKind kind);

// The reason: a name in plain words, and if they are numbers, the value found and the limit it was
// compared with. "largest half-velocity", 0.31, at_most, 0.5, "px".
struct Fact {
    enum class Relation { at_most, below, at_least };

    std::string name;
    std::optional<double> value = {};
    std::optional<double> limit = {};
    std::string unit = {};  // of value and limit; empty = none
    Relation relation = Relation::at_most;
    bool operator==(const Fact&) const = default;
};
const char* name_of(Fact::Relation relation);  // "<=", "<", ">="

// "largest half-velocity 0.31 px <= 0.5 px", "shutter_frames is 0", "smallest radius >= 3 px"
std::string text_of(const Fact& fact);

struct Saving {
    uint64_t bytes = 0;  // size of textures
    int dispatches = 0;
    uint64_t taps = 0;  // texture fetches

    bool any() const { return bytes || dispatches || taps; }
    Saving& operator+=(const Saving& other);
    bool operator==(const Saving&) const = default;
};

struct Elision {
    int pass = -1;  // index into Plan::passes; -1 = the frame's own
    ElisionKind kind = ElisionKind::pass;
    std::string item = {};  // "tile_variance", "motion"; empty for a whole pass
    std::string rule = {};  // ElisionRule::name
    Fact fact = {};
    Saving saving = {};

    // For ElisionKind::blocks: the list of the elided blocks, or with `outside`, of the other
    // blocks. The saving is unknown until the list is counted (found_in, chain/plan/plan.h).
    int work_list = -1;  // index into Plan::textures
    bool outside = false;
    uint64_t taps_per_block = 0;
    bool operator==(const Elision&) const = default;
};

// "motion_blur", "motion_blur.tile_variance", "input.motion"; "passes[2].motion_blur" if the chain
// has that pass more than once. `passes`: the types of the chain's passes, in order.
std::string item_text(const Elision& elision, const std::vector<std::string>& passes);

// Keys as in docs/sidecar.md. `what`: its item_text(); empty: no such key.
JsonObject elision_json(const Elision& elision, const std::string& what);

}  // namespace postchain
