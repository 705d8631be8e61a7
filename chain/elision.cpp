#include "chain/elision.h"

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

}  // namespace postchain
