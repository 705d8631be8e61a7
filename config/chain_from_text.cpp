#include "config/chain_from_text.h"

#include "chain/base/text.h"
#include "chain/guest/chain_handle.h"
#include "chain/guest/handles.h"
#include "config/chain_find.h"

namespace {

using postchain::concat;
using postchain::guest::create;
using postchain::guest::Failure;

Failure make_chain(std::string_view text, const std::string& name, pc_chain** chain) {
    postchain::ChainFile file = postchain::parse_chain(text, name, postchain::guest::passes());
    if (!file.status().ok()) return file.status();
    if (file.chain.camera.aperture_image)
        return {PC_ERROR_CHAIN, concat(name,
                                       ": camera.aperture_image: this library does not read files; "
                                       "set the image with pc_chain_set_aperture()")};
    for (const postchain::ChainLink& link : file.chain.links)
        if (!link.matte.empty() && link.matte != postchain::guest::kMask)
            return {PC_ERROR_CHAIN,
                    concat(name, ": ", link.type->name, ".matte: \"", link.matte,
                           "\": a host hands in one matte, pc_frame.mask; its name is \"",
                           postchain::guest::kMask, "\"")};
    *chain = postchain::guest::new_chain(std::move(file.chain));
    return {};
}

}  // namespace

extern "C" {

pc_result pc_chain_from_text(const char* text, const char* name, pc_chain** chain) {
    return create([&]() -> Failure {
        if (!chain) return {PC_ERROR_ARGUMENT, "chain is NULL"};
        *chain = nullptr;
        if (!text) return {PC_ERROR_ARGUMENT, "text is NULL"};
        return make_chain(text, name ? name : "chain", chain);
    });
}

pc_result pc_chain_shipped(const char* name, pc_chain** chain) {
    return create([&]() -> Failure {
        if (!chain) return {PC_ERROR_ARGUMENT, "chain is NULL"};
        *chain = nullptr;
        const std::string wanted = name ? name : "";
        if (const auto found = postchain::embedded_chain(wanted))
            return make_chain(found->text, wanted, chain);
        return {PC_ERROR_CHAIN, concat("unknown chain \"", wanted, "\"; shipped chains are ",
                                       postchain::joined(postchain::embedded_chains()))};
    });
}

}  // extern "C"
