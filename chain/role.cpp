#include "chain/role.h"

namespace postchain {

const char* name_of(Role role) {
    switch (role) {
        case Role::color:
            return "color";
        case Role::inverse_depth:
            return "inverse_depth";
        case Role::motion:
            return "motion";
        case Role::motion_back:
            return "motion_back";
        case Role::hint:
            return "hint";
    }
    return "unknown";
}

int channels_of(Role role) {
    switch (role) {
        case Role::color:
            return 4;
        case Role::inverse_depth:
            return 1;
        case Role::motion:
        case Role::motion_back:
        case Role::hint:
            return 2;
    }
    return 0;
}

std::string RoleSet::text() const {
    std::string text;
    for (Role role : kAllRoles) {
        if (!has(role)) continue;
        if (!text.empty()) text += ", ";
        text += name_of(role);
    }
    return text.empty() ? "nothing" : text;
}

}  // namespace postchain
