#include "chain/guest/postchain.h"

#include <algorithm>
#include <cstring>

#include "chain/guest/chain_handle.h"
#include "chain/guest/handles.h"
#include "chain/guest/host_struct.h"
#include "chain/guest/instance.h"
#include "chain/guest/presets.h"
#include "chain/guest/validate.h"

using postchain::concat;
using postchain::ParameterValue;
using postchain::guest::ChainHandle;
using postchain::guest::ChainVersion;
using postchain::guest::change_struct;
using postchain::guest::copy_text;
using postchain::guest::create;
using postchain::guest::engines_text;
using postchain::guest::Failure;
using postchain::guest::guarded;
using postchain::guest::Instance;
using postchain::guest::keep_error;
using postchain::guest::last_error_text;
using postchain::guest::look;
using postchain::guest::make_tier;
using postchain::guest::new_chain;
using postchain::guest::read_struct;
using postchain::guest::tiers;
using postchain::guest::Use;
using postchain::guest::version_of;

namespace {

template <class Work>
pc_result call(pc_instance* instance, const Work& work) {
    return look(instance, "instance", [&] {
        Failure failure = guarded(work);
        instance->is->error = failure.text;
        if (failure.result < 0) instance->is->log(PC_LOG_ERROR, failure.text);
        return failure;
    });
}

template <class Work>
pc_result call(pc_chain* chain, const Work& work) {
    return look(chain, "chain", [&] {
        const std::lock_guard lock(chain->mutex);
        Failure failure = guarded(work);
        chain->is.error = failure.text;
        return failure;
    });
}

// A call with a chain and a struct of the host, such as a frame.
template <class Struct, class Work>
pc_result call(pc_instance* instance, pc_chain* chain, const Struct* given, const char* name,
               const Work& work) {
    return call(instance, [&]() -> Failure {
        const Use use(chain, "chain");
        RETURN_IF_ERROR(use.failure());
        Struct copy;
        const Struct* whole = nullptr;
        RETURN_IF_ERROR(read_struct(given, name, copy, whole));
        return work(*instance->is, version_of(chain), *whole);
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

pc_result pc_create(const pc_create_info* given, pc_instance** instance) {
    return create([&]() -> Failure {
        if (!instance) return {PC_ERROR_ARGUMENT, "instance is NULL"};
        *instance = nullptr;
        pc_create_info copy;
        const pc_create_info* info = nullptr;
        RETURN_IF_ERROR(read_struct(given, "pc_create_info", copy, info));
        if (info->api_version >> 16 != PC_API_VERSION >> 16)
            return {PC_ERROR_VERSION,
                    concat("api_version ", info->api_version >> 16, ".", info->api_version & 0xffff,
                           ": this library has ", PC_API_VERSION >> 16)};
        if (info->state > PC_STATE_LEAVE)
            return {PC_ERROR_ARGUMENT, concat("state: ", info->state, " is not a PC_STATE value")};
        if (info->flags > (2 * PC_OWN_CONTEXT - 1))
            return {PC_ERROR_VERSION, concat("pc_create_info.flags: ", info->flags,
                                             " has a bit that this library does not know")};
        if (info->reserved != 0) return {PC_ERROR_VERSION, "pc_create_info.reserved is not 0"};
        auto made = std::make_unique<pc_instance>();
        RETURN_IF_ERROR(Instance::create(*info, made->is));
        Use::begin_life(made.get(), "instance");
        *instance = made.release();
        return {};
    });
}

const char* pc_error(void) {
    return last_error_text().c_str();
}

const char* pc_create_error(void) {
    return last_error_text().c_str();
}

void pc_destroy(pc_instance* instance) {
    if (Use::end_life(instance, "instance")) delete instance;
}

void pc_abandon(pc_instance* instance) {
    if (!Use::end_life(instance, "instance")) return;
    instance->is->abandon();
    delete instance;
}

const char* pc_last_error(const pc_instance* instance) {
    return Use::is_alive(instance, "instance") ? instance->is->error.c_str() : "no such instance";
}

pc_result pc_query(const pc_instance* instance, pc_capabilities* out) {
    return look(instance, "instance", [&] {
        return change_struct(out, "pc_capabilities", [&](pc_capabilities& whole) {
            instance->is->capabilities(whole);
            return Failure();
        });
    });
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

pc_result pc_prepare(pc_instance* instance, pc_chain* chain, const pc_frame* frame, int wait) {
    return call(instance, chain, frame, "pc_frame",
                [&](Instance& is, const ChainVersion& of, const pc_frame& whole) {
                    return is.prepare(of, &whole, wait != 0);
                });
}

pc_result pc_query_frame(pc_instance* instance, pc_chain* chain, const pc_frame* frame,
                         pc_frame_needs* needs) {
    return call(instance, chain, frame, "pc_frame",
                [&](Instance& is, const ChainVersion& of, const pc_frame& whole) {
                    return change_struct(needs, "pc_frame_needs", [&](pc_frame_needs& out) {
                        return is.needs_of(of, &whole, out);
                    });
                });
}

pc_result pc_run(pc_instance* instance, pc_chain* chain, const pc_frame* frame,
                 pc_texture* result) {
    pc_frame copy;
    const pc_frame* whole = nullptr;
    const Failure read = guarded([&] { return read_struct(frame, "pc_frame", copy, whole); });
    const pc_texture color = whole ? whole->color : pc_texture();
    pc_texture picture = color;
    const pc_result code = call(instance, [&]() -> Failure {
        if (!read.ok()) return read;
        const Use use(chain, "chain");
        RETURN_IF_ERROR(use.failure());
        return instance->is->run(version_of(chain), whole, picture);
    });
    if (result) *result = code < 0 ? color : picture;
    return code;
}

pc_result pc_set_timing(pc_instance* instance, int level) {
    return call(instance, [&]() -> Failure {
        if (level < 0 || level > 2)
            return {PC_ERROR_ARGUMENT, concat("level: ", level, " is not 0, 1 or 2")};
        instance->is->set_timing(level);
        return {};
    });
}

pc_result pc_timings(pc_instance* instance, pc_time* times, uint32_t* count,
                     uint64_t* frame_number) {
    return call(instance, [&]() -> Failure {
        if (!count || (!times && *count > 0)) return {PC_ERROR_ARGUMENT, "times or count is NULL"};
        RETURN_IF_ERROR(instance->is->check_context());
        const postchain::gl::Times* newest = instance->is->newest_times();
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
    });
}

pc_result pc_set_budget(pc_instance* instance, pc_chain* chain, const pc_budget* budget) {
    return call(instance, chain, budget, "pc_budget",
                [&](Instance& is, const ChainVersion& of, const pc_budget& whole) {
                    return is.set_budget(of, whole);
                });
}

pc_result pc_query_budget(const pc_instance* instance, const pc_chain* chain,
                          pc_budget_state* state) {
    return look(instance, "instance", [&]() -> Failure {
        const Use use(chain, "chain");
        RETURN_IF_ERROR(use.failure());
        const ChainVersion version = version_of(chain);
        return change_struct(state, "pc_budget_state", [&](pc_budget_state& whole) {
            instance->is->budget(version, whole);
            return Failure();
        });
    });
}

pc_result pc_count(const pc_instance* instance, pc_counters* counters) {
    return look(instance, "instance", [&] {
        return change_struct(counters, "pc_counters", [&](pc_counters& whole) {
            instance->is->count(whole);
            return Failure();
        });
    });
}

pc_result pc_explain(const pc_instance* instance, char* text, size_t* size) {
    return look(instance, "instance",
                [&] { return copy_text(instance->is->explain(), text, size); });
}

pc_result pc_check_motion(pc_instance* instance, const pc_frame* frame,
                          const pc_texture* other_color, int signs[2], float* margin) {
    return call(instance, [&]() -> Failure {
        if (!other_color || !signs || !margin)
            return {PC_ERROR_ARGUMENT, "other_color, signs or margin is NULL"};
        RETURN_IF_ERROR(instance->is->check_context());
        pc_frame copy;
        const pc_frame* whole = nullptr;
        RETURN_IF_ERROR(read_struct(frame, "pc_frame", copy, whole));
        return postchain::guest::check_motion(whole, *other_color, signs, *margin);
    });
}

}  // extern "C"
