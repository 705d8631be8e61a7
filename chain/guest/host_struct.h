// Structs of a host that was compiled with an older or newer postchain.h than this library.
//
// A smaller struct is read as if the members that it lacks were 0, their default. A larger one is
// read if all bytes beyond this library's struct are 0. And the callbacks
// of a host, and texts for it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "chain/guest/failure.h"
#include "chain/plan/program_source.h"
#include "chain/plan/times.h"

namespace postchain::guest {

// Bytes up to the members that every host has set since the first version.
template <class Struct>
inline constexpr size_t kMinSize = 0;
template <>
inline constexpr size_t kMinSize<pc_create_info> = offsetof(pc_create_info, flags);
template <>
inline constexpr size_t kMinSize<pc_frame> = offsetof(pc_frame, depth);
template <>
inline constexpr size_t kMinSize<pc_capabilities> = offsetof(pc_capabilities, software);
template <>
inline constexpr size_t kMinSize<pc_parameter> = offsetof(pc_parameter, pass_name);
template <>
inline constexpr size_t kMinSize<pc_counters> = offsetof(pc_counters, frames);

template <>
inline constexpr size_t kMinSize<pc_budget> = sizeof(pc_budget);
template <>
inline constexpr size_t kMinSize<pc_budget_state> = sizeof(pc_budget_state);
template <>
inline constexpr size_t kMinSize<pc_frame_needs> = offsetof(pc_frame_needs, texture_bytes);

// Larger than every version's: such a size was not initialized, and may be beyond the host's
// memory.
inline constexpr size_t kMaxSize = 1 << 16;

template <class Struct>
Failure check_size(const Struct* given, const char* name) {
    static_assert(kMinSize<Struct> > 0);
    if (!given) return {PC_ERROR_ARGUMENT, concat(name, " is NULL")};
    const size_t size = given->struct_size;
    const std::string_view type =
        std::string_view(name).substr(0, std::string_view(name).find('.'));
    if (size < kMinSize<Struct>)
        return {PC_ERROR_VERSION, concat(name, ".struct_size is ", size, "; set it to sizeof(",
                                         type, "), which is ", sizeof(Struct), " in this library")};
    if (size > kMaxSize)
        return {PC_ERROR_VERSION, concat(name, ".struct_size is ", size, ", more than ", kMaxSize,
                                         "; zero the struct, and set it to sizeof(", type, ")")};
    const auto* bytes = reinterpret_cast<const unsigned char*>(given);
    for (size_t i = sizeof(Struct); i < size; ++i)
        if (bytes[i] != 0)
            return {PC_ERROR_VERSION,
                    concat(name, ".struct_size is ", size, ", this library's is ", sizeof(Struct),
                           ", and a member that this library does not know is not 0")};
    return {};
}

inline Failure check_version(uint32_t version) {
    if (version >> 16 == PC_API_VERSION >> 16) return {};
    return {PC_ERROR_VERSION, concat("api_version ", version >> 16, ".", version & 0xffff,
                                     ": this library has ", PC_API_VERSION >> 16)};
}

// `read` becomes `given`, or `copy` if the host's struct is smaller.
template <class Struct>
Failure read_struct(const Struct* given, const char* name, Struct& copy, const Struct*& read) {
    RETURN_IF_ERROR(check_size(given, name));
    read = given;
    if (given->struct_size >= sizeof(Struct)) return {};
    copy = {};
    std::memcpy(&copy, given, given->struct_size);
    read = &copy;
    return {};
}

// Calls work(Struct&) -> Failure on a whole struct, and writes the members that the host has.
template <class Struct, class Work>
Failure change_struct(Struct* given, const char* name, const Work& work) {
    RETURN_IF_ERROR(check_size(given, name));
    const uint32_t host_size = given->struct_size;
    const size_t size = std::min(size_t(host_size), sizeof(Struct));
    Struct whole = {};
    std::memcpy(&whole, given, size);
    if (Failure failure = work(whole); failure.result < 0) return failure;
    whole.struct_size = host_size;
    std::memcpy(given, &whole, size);
    return {};
}

// The callbacks load_program() and store_program(). `Info`: pc_create_info or pc_vk_create_info,
// which outlives the store.
template <class Info>
ProgramStore store_of(const Info& info) {
    ProgramStore made;
    if (info.load_program)
        made.load = [&info](const std::string& key) {
            std::vector<std::byte> bytes(info.load_program(info.user, key.c_str(), nullptr, 0));
            if (bytes.empty()) return bytes;
            const size_t size =
                info.load_program(info.user, key.c_str(), bytes.data(), bytes.size());
            if (size != bytes.size()) bytes.clear();  // another process wrote it meanwhile
            return bytes;
        };
    if (info.store_program)
        made.store = [&info](const std::string& key, std::span<const std::byte> bytes) {
            info.store_program(info.user, key.c_str(), bytes.data(), bytes.size());
        };
    return made;
}

// Copies times of a frame to a host that gives room for *count of them, and sets *count to their
// number. `newest`: null = none yet.
inline Failure copy_times(const Times* newest, pc_time* times, uint32_t* count,
                          uint64_t* frame_number) {
    if (!count || (!times && *count > 0)) return {PC_ERROR_ARGUMENT, "times or count is NULL"};
    if (!newest) return {PC_PENDING, ""};
    const uint32_t room = *count;
    *count = uint32_t(newest->intervals.size());
    if (frame_number) *frame_number = newest->frame;
    for (uint32_t i = 0; i < std::min(room, *count); ++i) {
        const auto& interval = newest->intervals[i];
        std::memset(times[i].name, 0, sizeof(times[i].name));
        std::strncpy(times[i].name, interval.name.c_str(), sizeof(times[i].name) - 1);
        times[i].milliseconds = float(interval.milliseconds);
    }
    return {};
}

// Copies a text to a host that gives room for *size bytes, and sets *size to those that it needs.
inline Failure copy_text(const std::string& from, char* text, size_t* size) {
    if (!size) return {PC_ERROR_ARGUMENT, "size is NULL"};
    const size_t room = *size;
    *size = from.size() + 1;
    if (!text || room < *size)
        return {PC_ERROR_ARGUMENT, concat("size: room for ", room, " bytes; the text has ", *size)};
    std::memcpy(text, from.c_str(), *size);
    return {};
}

}  // namespace postchain::guest
