// A plan as text for people, JSON for programs, dot for pictures.
#pragma once

#include <string>

#include "chain/plan.h"

namespace postchain {

std::string plan_as_text(const Plan& plan);
std::string plan_as_json(const Plan& plan);  // one object on one line
std::string plan_as_dot(const Plan& plan);   // graphviz

}  // namespace postchain
