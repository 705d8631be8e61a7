// The host's callbacks load_program() and store_program() as a ProgramStore.
#pragma once

#include "chain/program_store.h"

namespace postchain::guest {

// `Info`: pc_create_info or pc_vk_create_info, which outlives the store.
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

}  // namespace postchain::guest
