#include "config/chain_from_text.h"

#include <exception>

#include "chain/guest/handles.h"
#include "chain/guest/registry.h"
#include "config/chain_file.h"
#include "config/embedded.h"

namespace {

using postchain::concat;
using postchain::guest::Failure;

Failure make_chain(std::string_view text, const std::string& name, pc_chain** chain) {
    postchain::ChainFile file = postchain::parse_chain(text, name, postchain::guest::passes());
    if (!file.status().ok()) return file.status();
    const auto& image = file.chain.camera.aperture_image;
    if (image && !image.is_read())
        return {PC_ERROR_CHAIN, concat(name,
                                       ": camera.aperture_image: files are read by the tools; "
                                       "give the picture by pc_chain_set_aperture()")};
    *chain = new pc_chain{postchain::guest::ChainHandle(std::move(file.chain))};
    return {};
}

// No exception crosses the border.
template <class Work>
pc_result create(pc_chain** chain, const Work& work) {
    Failure failure;
    try {
        if (chain) {
            *chain = nullptr;
            failure = work();
        } else {
            failure = {PC_ERROR_ARGUMENT, "chain is NULL"};
        }
    } catch (const std::bad_alloc&) {
        failure = {PC_ERROR_MEMORY, "out of memory"};
    } catch (const std::exception& e) {
        failure = {PC_ERROR_INTERNAL, e.what()};
    }
    postchain::guest::create_error().swap(failure.text);
    return failure.result;
}

}  // namespace

extern "C" {

pc_result pc_chain_from_text(const char* text, const char* name, pc_chain** chain) {
    return create(chain, [&]() -> Failure {
        if (!text) return {PC_ERROR_ARGUMENT, "text is NULL"};
        return make_chain(text, name ? name : "chain", chain);
    });
}

pc_result pc_chain_shipped(const char* name, pc_chain** chain) {
    return create(chain, [&]() -> Failure {
        std::string known;
        for (const auto& file : postchain::embedded_config()) {
            std::string_view path = file.path;
            if (!path.starts_with("chains/")) continue;
            path.remove_prefix(7);
            path.remove_suffix(5);  // ".yaml"
            if (name && path == name) return make_chain(file.text, std::string(path), chain);
            known += concat(known.empty() ? "" : ", ", path);
        }
        return {PC_ERROR_CHAIN,
                concat("there is no chain \"", name ? name : "", "\"; there are ", known)};
    });
}

}  // extern "C"
