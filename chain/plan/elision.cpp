#include "chain/plan/elision.h"

#include <algorithm>
#include <iterator>

#include "chain/base/parameter.h"
#include "chain/base/status.h"

namespace postchain {
const std::vector<ElisionRule>& chain_rules() {
    static const std::vector<ElisionRule> rules = {
        {kRuleConfiguration, true, "a pass that its parameters make the identity"},
        {kRuleFacts, true, "a pass that the facts of a frame make the identity"},
        {kRuleCameraCut, true, "motion blur of a frame whose motion leads across a camera cut"},
        {kRuleUnusedPlane, true, "converting and uploading a plane that no step reads"},
        {kRuleUnusedStep, true, "a step or plane that the parameters make unused"},
        {kRuleUnusedOutput, true, "a step whose results no output and no later step reads"},
        {kRuleMissingPlane, false, "a pass that requires a plane which the frame does not have"},
    };
    return rules;
}

const char* name_of(ElisionKind kind) {
    static constexpr const char* kNames[] = {"pass", "plane", "step", "output", "blocks"};
    static_assert(std::size(kNames) == size_t(ElisionKind::blocks) + 1);
    return kNames[size_t(kind)];
}

const char* name_of(Fact::Relation relation) {
    static constexpr const char* kNames[] = {"<=", "<", ">="};
    static_assert(std::size(kNames) == size_t(Fact::Relation::at_least) + 1);
    return kNames[size_t(relation)];
}

std::string text_of(const Fact& fact) {
    const std::string unit = fact.unit.empty() ? "" : " " + fact.unit;
    std::string text = fact.name;
    if (fact.value) text += concat(fact.limit ? " " : " is ", *fact.value, unit);
    if (fact.limit) text += concat(" ", name_of(fact.relation), " ", *fact.limit, unit);
    return text;
}

Saving& Saving::operator+=(const Saving& other) {
    bytes += other.bytes;
    dispatches += other.dispatches;
    taps += other.taps;
    return *this;
}

std::string item_text(const Elision& elision, const std::vector<std::string>& passes) {
    if (elision.pass < 0) return "input." + elision.item;
    const std::string& type = passes[size_t(elision.pass)];
    std::string text = std::count(passes.begin(), passes.end(), type) > 1
                           ? concat("passes[", elision.pass, "].", type)
                           : type;
    if (!elision.item.empty()) text += "." + elision.item;
    return text;
}

JsonObject elision_json(const Elision& elision, const std::string& what) {
    const Fact& fact = elision.fact;
    const auto number = [](const std::optional<double>& value) {
        return value ? JsonValue(*value) : JsonValue();
    };
    JsonObject json = {{"pass", elision.pass < 0 ? JsonValue() : elision.pass},
                       {"kind", name_of(elision.kind)},
                       {"item", elision.item},
                       {"rule", elision.rule},
                       {"reason", text_of(fact)},
                       {"fact", JsonObject{{"name", fact.name},
                                           {"value", number(fact.value)},
                                           {"relation", name_of(fact.relation)},
                                           {"limit", number(fact.limit)},
                                           {"unit", fact.unit}}},
                       {"bytes", elision.saving.bytes},
                       {"dispatches", elision.saving.dispatches},
                       {"taps", elision.saving.taps}};
    if (!what.empty()) json.insert(json.begin(), {"what", what});
    if (elision.work_list >= 0)
        json.insert(json.end(), {{"work_list", elision.work_list},
                                 {"outside", elision.outside},
                                 {"taps_per_block", elision.taps_per_block}});
    return json;
}

}  // namespace postchain
