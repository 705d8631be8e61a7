#include "chain/vk/focus.h"

#include <cstring>

namespace postchain::vk {

using guest::Depths;
using guest::Followed;
using guest::FoundDepths;

Status Focus::make_buffer() {
    if (found_.list.handle()) return Status();
    ASSIGN_OR_RETURN(found_.list, Buffer::make(device_, runs_.size() * sizeof(FoundDepths),
                                               VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                                               VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT |
                                                   VK_MEMORY_PROPERTY_HOST_COHERENT_BIT,
                                               "postchain depths in focus"));
    found_.storage.format = Format::work_list;
    return Status();
}

void Focus::take_place(uint64_t run) {
    const size_t place = run % runs_.size();
    Run& over = runs_[place];
    if (over.run != 0) {
        Found& found = newest_[over.number];
        found.run = over.run;
        std::memcpy(&found.depths, found_.list.mapped() + place * sizeof(FoundDepths),
                    sizeof(FoundDepths));
    }
    over = {};
}

const Depths& Focus::follow(uint64_t chain, const Depths& places, const pc_frame& given,
                            double distance, uint64_t run) {
    Followed& followed = chains_.find(chain, places, run);
    now_ = followed.number;
    if ((given.flags & PC_CAMERA_CUT) != 0) {
        followed.known = false;
        followed.since = run;
    }
    if (newest_[now_].run >= followed.since)
        followed.approach(newest_[now_].depths, given);
    else if (!followed.known && distance > 0)
        for (auto& entry : followed.depths) entry.second = 1 / distance;
    return followed.depths;
}

}  // namespace postchain::vk
