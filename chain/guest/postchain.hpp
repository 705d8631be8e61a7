// A thin C++ layer over postchain.h: handles that are destroyed with their scope, and structs with
// their size set. Throws no exceptions of its own.
#pragma once

#include <postchain/postchain.h>

#include <memory>
#include <string>
#include <vector>

namespace pc {

// A struct of postchain.h with its size set and every other member 0: pc::make<pc_frame>().
template <class Struct>
Struct make() {
    Struct value = {};
    value.struct_size = sizeof(Struct);
    return value;
}

struct DestroyInstance {
    void operator()(pc_instance* instance) const { pc_destroy(instance); }
};
struct DestroyChain {
    void operator()(pc_chain* chain) const { pc_chain_destroy(chain); }
};
// Must be destroyed while their context is current.
using Instance = std::unique_ptr<pc_instance, DestroyInstance>;
using Chain = std::unique_ptr<pc_chain, DestroyChain>;

inline pc_create_info create_info() {
    auto info = make<pc_create_info>();
    info.api_version = PC_API_VERSION;
    return info;
}

// Null on failure, with the text in pc_error().
inline Instance create(const pc_create_info& info = create_info()) {
    pc_instance* instance = nullptr;
    pc_create(&info, &instance);
    return Instance(instance);
}
inline Chain chain(const char* passes) {
    pc_chain* chain = nullptr;
    pc_chain_create(passes, &chain);
    return Chain(chain);
}

// Every row of pc_chain_parameter(). The strings stay valid until the chain is changed.
inline std::vector<pc_parameter> parameters(pc_chain* chain) {
    std::vector<pc_parameter> rows;
    for (auto row = make<pc_parameter>();
         pc_chain_parameter(chain, uint32_t(rows.size()), &row) == PC_OK;)
        rows.push_back(row);
    return rows;
}

// Times of the newest finished frame; empty if there is none.
inline std::vector<pc_time> timings(pc_instance* instance, uint64_t* frame_number = nullptr) {
    std::vector<pc_time> times(64);
    auto count = uint32_t(times.size());
    if (pc_timings(instance, times.data(), &count, frame_number) != PC_OK) return {};
    if (count > times.size()) {
        times.resize(count);
        if (pc_timings(instance, times.data(), &count, frame_number) != PC_OK) return {};
    }
    times.resize(count);
    return times;
}

inline std::string explain(const pc_instance* instance) {
    size_t size = 0;
    pc_explain(instance, nullptr, &size);
    std::string text(size, '\0');
    if (pc_explain(instance, text.data(), &size) != PC_OK) return {};
    text.resize(size - 1);
    return text;
}

}  // namespace pc
