#include "tools/sequence/source/memory.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <map>

#include "chain/base/text.h"
#include "tools/sequence/exr/worker_pool.h"

namespace postchain::sequence {
Result<uint64_t> parse_bytes(std::string_view text) {
    double value = 0;
    const char* end = text.data() + text.size();
    const auto read = std::from_chars(text.data(), end, value);
    std::string unit;
    std::copy_if(read.ptr, end, std::back_inserter(unit), [](char c) { return c != ' '; });
    static const std::map<std::string, int> kPowers = {
        {"", 0},     {"b", 0},  {"k", 10},  {"kb", 10},  {"kib", 10}, {"m", 20},  {"mb", 20},
        {"mib", 20}, {"g", 30}, {"gb", 30}, {"gib", 30}, {"t", 40},   {"tb", 40}, {"tib", 40}};
    const auto power = kPowers.find(lower_case(unit));
    const double bytes = power == kPowers.end() ? -1 : std::ldexp(value, power->second);
    if (read.ec != std::errc() || !(bytes >= 1) || !(bytes < 9e18))
        return Status(StatusCode::usage,
                      concat("'", text, "' is not a valid size; use a form like 8G or 500M"));
    return uint64_t(bytes);
}

uint64_t frame_bytes(const FrameHeader& header, RoleSet present, io::Keep keep, int rows) {
    const uint64_t width = uint64_t(header.window.width());
    const uint64_t pixels = width * uint64_t(rows);
    uint64_t planes = 0, stored = 0;
    for (const auto& [role, where] : header.match.roles) {
        if (!present.has(role)) continue;
        planes += pixels * uint64_t(channels_of(role)) * sizeof(float);
        const io::ExrPart& part = header.files.file_of(role).parts()[size_t(where.part)];
        const uint64_t part_rows = uint64_t(std::min(rows, part.data_window.height()));
        for (const std::string& name : where.channels)
            if (const io::ExrChannel* channel = part.find(name))
                stored += uint64_t(part.data_window.width()) * part_rows *
                          uint64_t(io::bytes_of(channel->type));
    }
    // Each thread holds a chunk of deep samples.
    uint64_t deep = 0;
    for (const auto& [role, where] : header.match.roles)
        if (present.has(role))
            deep = std::max(
                deep, header.files.file_of(role).parts()[size_t(where.part)].flattening_bytes);
    stored += deep * io::WorkerPool::shared().slots();
    const uint64_t layers =
        present.has(Role::layers) ? header.layers.filtered.size() * pixels * 4 * sizeof(float) : 0;
    planes += layers;
    if (present.has(Role::mattes)) planes += header.layers.mattes.size() * pixels * sizeof(float);
    // Ranks as read and as filtered, and the input and output layers of a chunk of ids.
    if (present.has(Role::layers) && header.layers.filtered_cryptomattes > 0) {
        for (size_t i = 0; i < header.layers.filtered_cryptomattes; ++i)
            planes += 2 * pixels * uint64_t(header.layers.cryptomattes[i].ranks()) *
                      (sizeof(io::CryptoId) + sizeof(float));
        planes += 2 * uint64_t(layers_at_once(pixels)) * pixels * 4 * sizeof(float);
    }
    if (keep == io::Keep::nothing) return planes + stored;
    uint64_t pixel = 0;  // bytes of a pixel of color's part, all channels
    for (const io::ExrChannel& channel : color_part(header).channels)
        pixel += uint64_t(io::bytes_of(channel.type));
    const io::Window& own = color_part(header).data_window;
    const uint64_t color = pixels * 4 * sizeof(float);
    // The filtered color and its channels; if the data window grows, all channels again.
    const uint64_t grown =
        own == header.window ? pixels * 4 * sizeof(float) : pixels * pixel + color;
    // The fill mask as read and as filtered, and the layers beside it.
    if (!header.layers.fill_mask.empty()) planes += 2 * pixels * 4 * sizeof(float) + layers;
    // The filtered layers, first together and then separately.
    return planes + stored + own.pixels() * pixel + color + grown + 2 * layers;
}

Status check_memory(const std::string& path, uint64_t bytes, uint64_t limit) {
    if (limit == 0 || bytes <= limit) return Status();
    return Status(StatusCode::memory,
                  concat(path, ": this frame needs ", bytes_text(bytes),
                         " of memory, but {max_memory} allows "_keyed, bytes_text(limit),
                         "; raise the limit, or render smaller or with fewer channels"));
}

void MemoryGate::enter(uint64_t bytes) {
    std::unique_lock lock(mutex_);
    left_.wait(lock, [&] { return limit_ == 0 || taken_ == 0 || taken_ + bytes <= limit_; });
    taken_ += bytes;
}

void MemoryGate::leave(uint64_t bytes) {
    {
        const std::lock_guard lock(mutex_);
        taken_ -= bytes;
    }
    left_.notify_all();
}

int layers_at_once(uint64_t pixels) {
    const uint64_t layer = pixels * 4 * sizeof(float);
    return int(std::clamp<uint64_t>((uint64_t(3) << 27) / layer, 1, 32));
}

}  // namespace postchain::sequence
