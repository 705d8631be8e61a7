// What is elided, and by which rule: as data. People read "left out"; the words are made here, from
// the fields, when they are printed.
//
// A rule has a name, under which it is switched off or on (--no-elide=RULES, --elide RULES) and
// under which plans, sidecars and reports say what it did. The rules here judge steps, planes and
// whole passes; those of one pass are in PassType::rules.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "chain/json.h"

namespace postchain {

struct ElisionRule {
    std::string name;              // of this rule alone in a registry
    bool on_by_default = true;     // those that are not are used only when asked for
    std::string help;              // what it leaves out, one line
    std::string former_name = {};  // still accepted, with a warning (docs/compatibility.md)
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

// Those that belong to no pass.
const std::vector<ElisionRule>& chain_rules();

enum class ElisionKind {
    pass,    // a whole pass
    plane,   // a plane of the frame, or a pass's reading of it
    step,    // a step of a pass
    output,  // a plane that a pass could make
    blocks,  // blocks of pixels of a step, found on the device
};
const char* name_of(ElisionKind kind);

// Why: a name in plain words, with what was found and the limit it was held against where these
// are numbers. "largest half-velocity", 0.31, at_most, 0.5, "px".
struct Fact {
    enum class Relation { at_most, below, at_least };

    std::string name;
    std::optional<double> value = {};
    std::optional<double> limit = {};
    std::string unit = {};  // of both; empty = none
    Relation relation = Relation::at_most;
    bool operator==(const Fact&) const = default;
};
const char* name_of(Fact::Relation relation);  // "<=", "<", ">="

// "largest half-velocity 0.31 px <= 0.5 px", "shutter_frames is 0", "smallest radius >= 3 px"
std::string text_of(const Fact& fact);

struct Saving {
    uint64_t bytes = 0;  // of textures
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

    // Of ElisionKind::blocks: the list of the blocks that are elided, or, with `outside`, of those
    // that are not. The saving is unknown until the list is counted (found_in, chain/plan.h).
    int work_list = -1;  // index into Plan::textures
    bool outside = false;
    uint64_t taps_per_block = 0;
    bool operator==(const Elision&) const = default;
};

// "motion_blur", "motion_blur.tile_variance", "input.motion"; "passes[2].motion_blur" where that
// pass is in the chain more than once. `passes`: the types of the chain's passes, in order.
std::string item_text(const Elision& elision, const std::vector<std::string>& passes);

// Keys as in docs/sidecar.md. `what`: its item_text(); empty: no such key.
JsonObject elision_json(const Elision& elision, const std::string& what);

}  // namespace postchain
