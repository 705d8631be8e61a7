#include "chain/frame/role.h"

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
        case Role::color_before:
            return "color_before";
        case Role::inverse_depth_before:
            return "inverse_depth_before";
        case Role::motion_before:
            return "motion_before";
        case Role::motion_back_before:
            return "motion_back_before";
        case Role::color_after:
            return "color_after";
        case Role::inverse_depth_after:
            return "inverse_depth_after";
        case Role::motion_after:
            return "motion_after";
        case Role::motion_back_after:
            return "motion_back_after";
        case Role::layers:
            return "layers";
        case Role::layers_before:
            return "layers_before";
        case Role::layers_after:
            return "layers_after";
        case Role::mattes:
            return "mattes";
        case Role::mattes_before:
            return "mattes_before";
        case Role::mattes_after:
            return "mattes_after";
        case Role::behind:
            return "behind";
    }
    return "unknown";
}

const char* name_of(Neighbor neighbor) {
    return neighbor == Neighbor::before ? "before" : "after";
}

int channels_of(Role role) {
    switch (role) {
        case Role::color:
        case Role::color_before:
        case Role::color_after:
        case Role::layers:
        case Role::layers_before:
        case Role::layers_after:
        case Role::behind:
            return 4;
        case Role::inverse_depth:
        case Role::inverse_depth_before:
        case Role::inverse_depth_after:
        case Role::mattes:
        case Role::mattes_before:
        case Role::mattes_after:
            return 1;
        case Role::motion:
        case Role::motion_back:
        case Role::hint:
        case Role::motion_before:
        case Role::motion_back_before:
        case Role::motion_after:
        case Role::motion_back_after:
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
