// The functions of postchain.h that need no instance: chains, and what the library is.
#include "chain/guest/postchain.h"

#include "chain/guest/chain_handle.h"
#include "chain/guest/handles.h"
#include "chain/guest/host_struct.h"
#include "chain/guest/presets.h"

using postchain::concat;
using postchain::ParameterValue;
using postchain::guest::ChainHandle;
using postchain::guest::change_struct;
using postchain::guest::create;
using postchain::guest::engines_text;
using postchain::guest::Failure;
using postchain::guest::guarded;
using postchain::guest::keep_error;
using postchain::guest::last_error_text;
using postchain::guest::look;
using postchain::guest::make_tier;
using postchain::guest::new_chain;
using postchain::guest::tiers;
using postchain::guest::Use;

namespace {

template <class Work>
pc_result call(pc_chain* chain, const Work& work) {
    return look(chain, "chain", [&] {
        const std::lock_guard lock(chain->mutex);
        Failure failure = guarded(work);
        chain->is.error = failure.text;
        return failure;
    });
}

}  // namespace

extern "C" {

const char* pc_version(void) {
    return POSTCHAIN_VERSION;
}

const char* pc_result_name(pc_result result) {
    switch (result) {
        case PC_OK:
            return "PC_OK";
        case PC_PENDING:
            return "PC_PENDING";
        case PC_ERROR_ARGUMENT:
            return "PC_ERROR_ARGUMENT";
        case PC_ERROR_CHAIN:
            return "PC_ERROR_CHAIN";
        case PC_ERROR_INPUT:
            return "PC_ERROR_INPUT";
        case PC_ERROR_CONTEXT:
            return "PC_ERROR_CONTEXT";
        case PC_ERROR_MEMORY:
            return "PC_ERROR_MEMORY";
        case PC_ERROR_VERSION:
            return "PC_ERROR_VERSION";
        case PC_ERROR_PREPARE:
            return "PC_ERROR_PREPARE";
        case PC_ERROR_GL:
            return "PC_ERROR_GL";
        case PC_ERROR_INTERNAL:
            return "PC_ERROR_INTERNAL";
    }
    return "unknown";
}

const char* pc_error(void) {
    return last_error_text().c_str();
}

const char* pc_create_error(void) {
    return last_error_text().c_str();
}

pc_result pc_chain_create(const char* names, pc_chain** chain) {
    return create([&]() -> Failure {
        if (!chain) return {PC_ERROR_ARGUMENT, "chain is NULL"};
        *chain = nullptr;
        if (!names) return {PC_ERROR_ARGUMENT, "passes is NULL"};
        const std::string_view text = names;
        constexpr std::string_view kTier = "tier:";
        ASSIGN_OR_RETURN(auto made, text.starts_with(kTier) ? make_tier(text.substr(kTier.size()),
                                                                        postchain::guest::passes())
                                                            : ChainHandle::parse(text));
        *chain = new_chain(std::move(made));
        return {};
    });
}

void pc_chain_destroy(pc_chain* chain) {
    if (Use::end_life(chain, "chain")) delete chain;
}

const char* pc_chain_error(const pc_chain* chain) {
    return Use::is_alive(chain, "chain") ? chain->is.error.c_str() : "no such chain";
}

pc_result pc_pass(uint32_t index, const char** name, const char** help) {
    const auto& types = postchain::guest::passes().types();
    if (index >= types.size()) {
        keep_error(concat("index ", index, ": there are ", types.size(), " passes"));
        return PC_ERROR_ARGUMENT;
    }
    keep_error("");
    if (name) *name = types[index].name.c_str();
    if (help) *help = types[index].help.c_str();
    return PC_OK;
}

pc_result pc_tier(uint32_t index, const char** name, const char** help) {
    const auto& all = tiers();
    if (index >= all.size()) {
        keep_error(concat("index ", index, ": there are ", all.size(), " tiers"));
        return PC_ERROR_ARGUMENT;
    }
    keep_error("");
    if (name) *name = all[index].name;
    if (help) *help = all[index].help;
    return PC_OK;
}

pc_result pc_chain_parameter(pc_chain* chain, uint32_t index, pc_parameter* row) {
    return call(chain, [&]() -> Failure {
        return change_struct(row, "pc_parameter",
                             [&](pc_parameter& whole) { return chain->is.describe(index, whole); });
    });
}

pc_result pc_chain_set_number(pc_chain* chain, uint32_t pass, const char* key, double value) {
    return call(chain, [&] { return chain->is.set_number(pass, key ? key : "", value); });
}

pc_result pc_chain_set_text(pc_chain* chain, uint32_t pass, const char* key, const char* value) {
    return call(chain, [&] {
        return chain->is.set(pass, key ? key : "", std::string(value ? value : ""));
    });
}

pc_result pc_chain_set_point(pc_chain* chain, uint32_t pass, const char* key, double x, double y) {
    return call(chain, [&] {
        return chain->is.set(pass, key ? key : "", std::array<double, 2>{x, y});
    });
}

pc_result pc_chain_set_aperture(pc_chain* chain, const float* values) {
    return call(chain, [&]() -> Failure {
        if (!values) return {PC_ERROR_ARGUMENT, "values is NULL"};
        return chain->is.set_aperture(values);
    });
}

pc_result pc_chain_set_mask(pc_chain* chain, uint32_t pass, pc_mask_effect effect) {
    return call(chain, [&] { return chain->is.set_mask(pass, effect); });
}

pc_result pc_chain_unset(pc_chain* chain, uint32_t pass, const char* key) {
    return call(chain, [&] { return chain->is.set(pass, key ? key : "", ParameterValue()); });
}

pc_result pc_use_conventions(const char* engine, pc_frame* frame) {
    return create([&]() -> Failure {
        if (!engine) return {PC_ERROR_ARGUMENT, "engine is NULL"};
        return change_struct(frame, "pc_frame", [&](pc_frame& whole) -> Failure {
            if (postchain::guest::use_conventions(engine, whole)) return {};
            return {PC_ERROR_ARGUMENT,
                    concat("engine: unknown \"", engine, "\"; known are ", engines_text())};
        });
    });
}

}  // extern "C"
