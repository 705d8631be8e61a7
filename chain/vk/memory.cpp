#include "chain/vk/memory.h"

#include <algorithm>

#include "chain/vk/device.h"

namespace postchain::vk {
namespace {

constexpr VkDeviceSize kSmallestBlock = 1 << 20, kLargestBlock = 256 << 20;

}  // namespace

bool Memory::take(Block& block, const VkMemoryRequirements& needs, MemoryPart& part) {
    for (auto span = block.unused.begin(); span != block.unused.end(); ++span) {
        const VkDeviceSize end = span->offset + span->bytes;
        const VkDeviceSize at =
            (span->offset + needs.alignment - 1) / needs.alignment * needs.alignment;
        if (at + needs.size > end) continue;
        if (at > span->offset) block.unused.insert(span, {span->offset, at - span->offset});
        *span = {at + needs.size, end - at - needs.size};
        if (span->bytes == 0) block.unused.erase(span);
        part = {block.whole.memory, at, needs.size,
                block.whole.mapped ? block.whole.mapped + at : nullptr, &block};
        return true;
    }
    return false;
}

Result<MemoryPart> Memory::allocate(const VkMemoryRequirements& needs,
                                    VkMemoryPropertyFlags properties, Contents contents) {
    MemoryPart part;
    if (host_.allocate) {
        part.bytes = needs.size;
        RETURN_IF_ERROR(status_of(host_.allocate(needs, properties, part),
                                  "pc_vk_create_info.allocate_memory"));
        return part;
    }
    for (Block& block : blocks_)
        if (block.contents == contents && block.properties == properties &&
            (needs.memoryTypeBits >> block.type & 1) && take(block, needs, part))
            return part;
    Block made = {{}, 0, properties, contents, {}};
    VkMemoryRequirements whole = needs;
    whole.size = std::max(needs.size, std::clamp(expected_, kSmallestBlock, kLargestBlock));
    expected_ -= std::min(expected_, whole.size);
    Status status = functions_.make(whole, properties, made.whole, made.type);
    if (status.code() == StatusCode::memory && whole.size > needs.size) {
        whole.size = needs.size;
        status = functions_.make(whole, properties, made.whole, made.type);
    }
    if (!status.ok()) return status;
    made.unused.push_back({0, whole.size});
    blocks_.push_back(std::move(made));
    take(blocks_.back(), needs, part);
    return part;
}

void Memory::free(const MemoryPart& part) {
    if (!part.memory) return;
    if (host_.free) return host_.free(part);
    auto& block = *static_cast<Block*>(part.owner);
    auto next = std::find_if(block.unused.begin(), block.unused.end(),
                             [&](const Span& span) { return span.offset > part.offset; });
    auto span = block.unused.insert(next, {part.offset, part.bytes});
    if (next != block.unused.end() && span->offset + span->bytes == next->offset) {
        span->bytes += next->bytes;
        block.unused.erase(next);
    }
    if (span != block.unused.begin()) {
        const auto before = std::prev(span);
        if (before->offset + before->bytes == span->offset) {
            before->bytes += span->bytes;
            block.unused.erase(span);
        }
    }
    if (block.unused.size() != 1 || block.unused.front().bytes != block.whole.bytes) return;
    functions_.destroy(block.whole.memory);
    std::erase_if(blocks_, [&](const Block& one) { return &one == &block; });
}

}  // namespace postchain::vk
