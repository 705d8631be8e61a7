// Fault points, which insert.py puts into a copy of the source. One fault is active.
//
//   POSTCHAIN_FAULT=NUMBER   the active fault: 8 * point + kind
//   POSTCHAIN_REACHED=FILE   of kMaxPoints bytes. Each process that has it sets in a point's byte
//   what it has seen
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <type_traits>

namespace postchain::fault_point {

inline constexpr int kMaxPoints = 1 << 16;
// In the order of KINDS in insert.py. condition() tells the first two apart by the last bit.
enum Kind {
    always_true,
    always_false,
    boundary,
    left_out,
    flipped,
    one_is_zero,
    other_sign,
    other_end
};
enum Seen { seen_false = 1, seen_true = 2, seen = 4 };

inline unsigned char nowhere[kMaxPoints];
inline unsigned char* reached = nowhere;
inline int active = -1;

// Before main() and before the process is confined.
__attribute__((constructor(101))) inline void begin() {
    if (reached != nowhere) return;
    if (const char* number = std::getenv("POSTCHAIN_FAULT")) active = std::atoi(number);
    const char* path = std::getenv("POSTCHAIN_REACHED");
    const int file = path ? open(path, O_RDWR | O_CLOEXEC) : -1;
    if (file < 0) return;
    void* at = mmap(nullptr, kMaxPoints, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (at != MAP_FAILED) reached = static_cast<unsigned char*>(at);
    close(file);
}

inline void mark(int point, Seen what) {
    if (!(reached[point] & what)) reached[point] |= what;
}

constexpr bool is_active(int point, Kind kind) {
    if (std::is_constant_evaluated()) return false;
    mark(point, seen);
    return active == 8 * point + kind;
}

constexpr bool condition(int point, bool value) {
    if (std::is_constant_evaluated()) return value;
    mark(point, value ? seen_true : seen_false);
    return active >> 1 == 4 * point ? active % 2 == 0 : value;
}

constexpr bool returned(int point, bool value) {
    return is_active(point, flipped) ? !value : value;
}

constexpr int one(int point) {
    return is_active(point, one_is_zero) ? 0 : 1;
}

// The sign of a term: of a number, or of what has a negative of its type. Texts have none.
struct Sign {
    int point;

    template <class T>
    friend constexpr decltype(auto) operator*(Sign sign, T&& term) {
        using Value = std::decay_t<T>;
        if constexpr (std::is_arithmetic_v<Value>)
            return static_cast<Value>(is_active(sign.point, other_sign) ? -term : term);
        else if constexpr (requires { requires std::is_same_v<decltype(-term), Value>; })
            return is_active(sign.point, other_sign) ? -term : Value(term);
        else
            return static_cast<T&&>(term);
    }
};

}  // namespace postchain::fault_point

// std::min(a, b) and std::max(a, b) with the prefix ends::.
namespace postchain::ends::std {

template <class T>
constexpr const T& min(int point, const T& a, const T& b) {
    return fault_point::is_active(point, fault_point::other_end) == (b < a) ? a : b;
}
template <class T>
constexpr const T& max(int point, const T& a, const T& b) {
    return fault_point::is_active(point, fault_point::other_end) == (a < b) ? a : b;
}

}  // namespace postchain::ends::std
