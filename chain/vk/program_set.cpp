#include "chain/vk/program_set.h"

#include <algorithm>
#include <cstring>
#include <string_view>

namespace postchain::vk {
namespace {

constexpr std::string_view kSetMagic = "PCSPIRV1";
constexpr size_t kVersionBytes = 24, kHeaderBytes = 8 + kVersionBytes + 8, kEntryBytes = 24;

uint64_t number_at(std::span<const std::byte> bytes, size_t at) {
    uint64_t number = 0;
    std::memcpy(&number, bytes.data() + at, sizeof(number));
    return number;
}

}  // namespace

Result<ProgramSet> ProgramSet::read(std::span<const std::byte> bytes) {
    const auto fault = [](const std::string& what) {
        return Status(StatusCode::usage,
                      concat("programs: ", what, "; make them by postchain-programs"));
    };
    if (bytes.size() < kHeaderBytes ||
        std::memcmp(bytes.data(), kSetMagic.data(), kSetMagic.size()) != 0)
        return fault("not a set of programs");
    char version[kVersionBytes + 1] = {};
    std::memcpy(version, bytes.data() + kSetMagic.size(), kVersionBytes);
    if (std::string_view(version) != POSTCHAIN_VERSION)
        return fault(concat("of version ", version, ", this library is ", POSTCHAIN_VERSION));
    ProgramSet set;
    set.bytes_ = bytes;
    const uint64_t count = number_at(bytes, kHeaderBytes - 8);
    if (count > (bytes.size() - kHeaderBytes) / kEntryBytes) return fault("cut off");
    set.count_ = size_t(count);
    for (size_t i = 0; i < set.count_; ++i) {
        const size_t entry = kHeaderBytes + i * kEntryBytes;
        const uint64_t offset = number_at(bytes, entry + 8), size = number_at(bytes, entry + 16);
        if (offset > bytes.size() || size > bytes.size() - offset || size % 4 != 0)
            return fault("cut off");
    }
    return set;
}

std::vector<std::byte> ProgramSet::write(
    const std::map<uint64_t, std::vector<uint32_t>>& programs) {
    std::vector<std::byte> out;
    const auto append = [&](const void* from, size_t size) {
        const auto* bytes = static_cast<const std::byte*>(from);
        out.insert(out.end(), bytes, bytes + size);
    };
    append(kSetMagic.data(), kSetMagic.size());
    char version[kVersionBytes] = {};
    std::strncpy(version, POSTCHAIN_VERSION, kVersionBytes - 1);
    append(version, kVersionBytes);
    const uint64_t count = programs.size();
    append(&count, sizeof(count));
    uint64_t offset = kHeaderBytes + count * kEntryBytes;
    for (const auto& [key, words] : programs) {
        const uint64_t size = 4 * words.size();
        for (const uint64_t number : {key, offset, size}) append(&number, sizeof(number));
        offset += size;
    }
    for (const auto& [key, words] : programs) append(words.data(), 4 * words.size());
    return out;
}

std::optional<std::vector<uint32_t>> ProgramSet::find(uint64_t key) const {
    size_t first = 0, end = count_;
    while (first < end) {
        const size_t middle = (first + end) / 2;
        if (number_at(bytes_, kHeaderBytes + middle * kEntryBytes) < key)
            first = middle + 1;
        else
            end = middle;
    }
    const size_t entry = kHeaderBytes + first * kEntryBytes;
    if (first == count_ || number_at(bytes_, entry) != key) return std::nullopt;
    std::vector<uint32_t> words(number_at(bytes_, entry + 16) / 4);
    std::memcpy(words.data(), bytes_.data() + number_at(bytes_, entry + 8), 4 * words.size());
    return words;
}

}  // namespace postchain::vk
