#include "chain/frame/role.h"

#include <iterator>

namespace postchain {

namespace {

struct RoleRow {
    const char* name;
    int channels;
};

const RoleRow& row_of(Role role) {
    static constexpr RoleRow kRows[] = {{"color", 4},
                                        {"inverse_depth", 1},
                                        {"motion", 2},
                                        {"motion_back", 2},
                                        {"hint", 2},
                                        {"color_before", 4},
                                        {"inverse_depth_before", 1},
                                        {"motion_before", 2},
                                        {"motion_back_before", 2},
                                        {"color_after", 4},
                                        {"inverse_depth_after", 1},
                                        {"motion_after", 2},
                                        {"motion_back_after", 2},
                                        {"layers", 4},
                                        {"layers_before", 4},
                                        {"layers_after", 4},
                                        {"mattes", 1},
                                        {"mattes_before", 1},
                                        {"mattes_after", 1},
                                        {"behind", 4}};
    static_assert(std::size(kRows) == kAllRoles.size());
    return kRows[size_t(role)];
}

}  // namespace

const char* name_of(Role role) {
    return row_of(role).name;
}

const char* name_of(Neighbor neighbor) {
    return neighbor == Neighbor::before ? "before" : "after";
}

int channels_of(Role role) {
    return row_of(role).channels;
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
