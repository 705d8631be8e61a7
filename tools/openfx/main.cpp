// The two functions that a host looks for in the library, and the entry of every effect. No
// exception leaves it.
#include <cstring>
#include <new>
#include <utility>

#include "tools/openfx/device.h"
#include "tools/openfx/instance.h"

namespace postchain::openfx {
namespace {

constexpr size_t kEffects = 5;
int loaded = 0;  // effects; the last one that is unloaded ends the device

HostStatus load() {
    if (!load_suites()) return kMissingHostFeature;
    ++loaded;
    return kOk;
}

HostStatus unload() {
    if (loaded > 0 && --loaded == 0) close_device();
    return kOk;
}

HostStatus act(const EffectType& type, const char* action, Effect effect, Properties in,
               Properties out) {
    const auto is = [&](const char* name) { return std::strcmp(action, name) == 0; };
    if (is(kActionLoad)) return load();
    if (is(kActionUnload)) return unload();
    if (!suites().properties || !effect) return kFailed;
    if (is(kActionDescribe)) {
        describe(type, effect);
        return kOk;
    }
    if (is(kActionDescribeInContext)) {
        describe_in_context(type, effect, in.text(kPropContext) == kContextFilter);
        return kOk;
    }
    const Properties own = properties_of(effect);
    if (is(kActionCreateInstance)) {
        auto instance = std::make_unique<Instance>(type, effect);
        instance->created();
        own.set_pointer(kPropInstanceData, instance.release());
        return kOk;
    }
    auto* instance = static_cast<Instance*>(own.pointer(kPropInstanceData));
    if (!instance) return kFailed;
    if (is(kActionDestroyInstance)) {
        delete instance;
        own.set_pointer(kPropInstanceData, nullptr);
        return kOk;
    }
    if (is(kActionInstanceChanged)) {
        instance->changed(in);
        return kOk;
    }
    if (is(kActionPurgeCaches)) {
        purge_device();
        return kOk;
    }
    if (is(kActionGetClipPreferences)) return instance->clip_preferences(out);
    if (is(kActionGetRegionOfDefinition)) return instance->region_of_definition(in, out);
    if (is(kActionGetRegionsOfInterest)) return instance->regions_of_interest(in, out);
    if (is(kActionGetFramesNeeded)) return instance->frames_needed(in, out);
    if (is(kActionIsIdentity)) return instance->is_identity(in, out);
    if (is(kActionRender)) return instance->render(in);
    return kReplyDefault;
}

HostStatus enter(size_t index, const char* action, const void* handle, PropertySet in,
                 PropertySet out) noexcept {
    try {
        return act(effect_types()[index], action, static_cast<Effect>(const_cast<void*>(handle)),
                   in, out);
    } catch (const std::bad_alloc&) {
        return kOutOfMemory;
    } catch (...) {
        return kFailed;
    }
}

template <size_t kIndex>
HostStatus main_entry(const char* action, const void* handle, PropertySet in, PropertySet out) {
    return enter(kIndex, action, handle, in, out);
}

template <size_t... kIndices>
PluginEntry* entry_of(size_t index, std::index_sequence<kIndices...>) {
    static PluginEntry entries[] = {PluginEntry{kEffectApi, kEffectApiVersion,
                                                effect_types()[kIndices].identifier, 1, 0, set_host,
                                                main_entry<kIndices>}...};
    return &entries[index];
}

}  // namespace
}  // namespace postchain::openfx

#define POSTCHAIN_EXPORT extern "C" __attribute__((visibility("default")))

POSTCHAIN_EXPORT int OfxGetNumberOfPlugins() {
    return int(postchain::openfx::kEffects);
}

POSTCHAIN_EXPORT postchain::openfx::PluginEntry* OfxGetPlugin(int index) {
    using namespace postchain::openfx;
    if (index < 0 || index >= int(kEffects)) return nullptr;
    try {
        return entry_of(size_t(index), std::make_index_sequence<kEffects>());
    } catch (...) {
        return nullptr;
    }
}

// Hosts of version 1.4 and later call it first.
POSTCHAIN_EXPORT int OfxSetHost(postchain::openfx::HostEntry* host) {
    postchain::openfx::set_host(host);
    return postchain::openfx::kOk;
}
