// Words and group of a parameter, as a panel shows it.
#pragma once

#include <string>
#include <vector>

#include "chain/base/parameter.h"

namespace postchain::view {

struct ParameterWords {
    std::string label;  // "f-stop"
    std::string group;  // one of parameter_groups(); empty: the row has no place yet
    std::string unset;  // what a value that is not set means: "focus decides"
};
ParameterWords words_of(const Parameter& row);

// In the order of panels. The first ones begin open.
struct ParameterGroup {
    std::string name;
    bool open = false;
};
const std::vector<ParameterGroup>& parameter_groups();

}  // namespace postchain::view
