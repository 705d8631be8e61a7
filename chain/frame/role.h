// Roles: what a plane means to the chain (docs/frame.md), and sets of them.
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace postchain {

enum class Role : uint8_t {
    color,          // RGBA, scene-linear (or display-referred by declaration), premultiplied
    inverse_depth,  // 1/d, d along the view axis in scene units; 0 = sky
    motion,         // to the next frame, pixels of this image per frame, +x right, +y down
    motion_back,    // from the previous frame to this one, same axes
    hint,           // FXAA's hint: x = tile gate, y = pixel gate, each in 0..1 (docs/fxaa.md)
    color_before,   // the first four of the previous frame, as that frame has them ...
    inverse_depth_before,
    motion_before,
    motion_back_before,
    color_after,  // ... and of the next one
    inverse_depth_after,
    motion_after,
    motion_back_after,
    layers,  // extra color layers, each RGBA, filtered as color is (chain/frame/layers.h)
    layers_before,
    layers_after,
    mattes,  // one channel each, 0..1: objects that passes leave as they are (chain/frame/layers.h)
    mattes_before,
    mattes_after,
    behind,  // the first surface behind each pixel's, four channels a plane (chain/frame/behind.h)
};

inline constexpr std::array<Role, 20> kAllRoles = {Role::color,
                                                   Role::inverse_depth,
                                                   Role::motion,
                                                   Role::motion_back,
                                                   Role::hint,
                                                   Role::color_before,
                                                   Role::inverse_depth_before,
                                                   Role::motion_before,
                                                   Role::motion_back_before,
                                                   Role::color_after,
                                                   Role::inverse_depth_after,
                                                   Role::motion_after,
                                                   Role::motion_back_after,
                                                   Role::layers,
                                                   Role::layers_before,
                                                   Role::layers_after,
                                                   Role::mattes,
                                                   Role::mattes_before,
                                                   Role::mattes_after,
                                                   Role::behind};

// Planes that the files of one frame can have, one plane each.
inline constexpr std::array<Role, 4> kFileRoles = {Role::color, Role::inverse_depth, Role::motion,
                                                   Role::motion_back};

// Another frame, seen from the one that is filtered.
enum class Neighbor : uint8_t { before, after };
inline constexpr std::array<Neighbor, 2> kNeighbors = {Neighbor::before, Neighbor::after};
const char* name_of(Neighbor neighbor);
constexpr int frames_to(Neighbor neighbor) {
    return neighbor == Neighbor::before ? -1 : 1;
}

// Planes that are read of another frame: the file's, its layers and mattes.
inline constexpr std::array<Role, 6> kNeighborRoles = {
    Role::color, Role::inverse_depth, Role::motion, Role::motion_back, Role::layers, Role::mattes};

// That frame's plane: (before, motion) -> motion_before. `role`: one of kNeighborRoles.
constexpr Role role_of(Neighbor neighbor, Role role) {
    if (role == Role::layers)
        return neighbor == Neighbor::before ? Role::layers_before : Role::layers_after;
    if (role == Role::mattes)
        return neighbor == Neighbor::before ? Role::mattes_before : Role::mattes_after;
    const Role first = neighbor == Neighbor::before ? Role::color_before : Role::color_after;
    return Role(uint8_t(first) + uint8_t(role));
}

const char* name_of(Role role);
int channels_of(Role role);  // 4, 1, 2, 2, 2, likewise of a neighbor; a layer 4, a matte 1,
                             // a plane of `behind` 4
// Planes of this role are stacked one below another: FrameDescription has their number.
constexpr bool is_stacked(Role role) {
    return role == Role::layers || role == Role::layers_before || role == Role::layers_after ||
           role == Role::mattes || role == Role::mattes_before || role == Role::mattes_after ||
           role == Role::behind;
}

class RoleSet {
  public:
    constexpr RoleSet() = default;
    constexpr RoleSet(std::initializer_list<Role> roles) {
        for (Role role : roles) bits_ |= bit(role);
    }
    constexpr bool has(Role role) const { return (bits_ & bit(role)) != 0; }
    constexpr void add(Role role) { bits_ |= bit(role); }
    constexpr void remove(Role role) { bits_ &= ~bit(role); }
    constexpr bool empty() const { return bits_ == 0; }
    constexpr RoleSet operator|(RoleSet o) const { return from(bits_ | o.bits_); }
    constexpr RoleSet operator-(RoleSet o) const { return from(bits_ & ~o.bits_); }
    constexpr RoleSet operator&(RoleSet o) const { return from(bits_ & o.bits_); }
    constexpr bool operator==(const RoleSet&) const = default;
    std::string text() const;  // "color, motion"

    // The neighbor's planes in this set, under the names that they have in their own frame:
    // {color, motion_before}.of(before) = {motion}.
    constexpr RoleSet of(Neighbor neighbor) const {
        RoleSet set;
        for (Role role : kNeighborRoles)
            if (has(role_of(neighbor, role))) set.add(role);
        return set;
    }

  private:
    static constexpr uint32_t bit(Role role) { return 1u << static_cast<uint32_t>(role); }
    static constexpr RoleSet from(uint32_t bits) {
        RoleSet set;
        set.bits_ = bits;
        return set;
    }
    uint32_t bits_ = 0;
};

inline constexpr RoleSet kEveryRole = [] {
    RoleSet all;
    for (const Role role : kAllRoles) all.add(role);
    return all;
}();

}  // namespace postchain
