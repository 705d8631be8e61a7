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
};

inline constexpr std::array<Role, 5> kAllRoles = {Role::color, Role::inverse_depth, Role::motion,
                                                  Role::motion_back, Role::hint};

const char* name_of(Role role);
int channels_of(Role role);  // 4, 1, 2, 2, 2

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

  private:
    static constexpr uint32_t bit(Role role) { return 1u << static_cast<uint32_t>(role); }
    static constexpr RoleSet from(uint32_t bits) {
        RoleSet set;
        set.bits_ = bits;
        return set;
    }
    uint32_t bits_ = 0;
};

}  // namespace postchain
