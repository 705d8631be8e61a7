// A plan as text for people, JSON for programs, dot for diagrams.
#pragma once

#include <string>

#include "chain/base/json.h"
#include "chain/plan/plan.h"

namespace postchain {

std::string plan_as_text(const Plan& plan);
JsonObject plan_json(const Plan& plan);
std::string plan_as_dot(const Plan& plan);  // graphviz

}  // namespace postchain
