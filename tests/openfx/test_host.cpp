#include "tests/openfx/test_host.h"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstring>

#include "chain/base/status.h"
#include "chain/gl/half.h"

namespace postchain::openfx::test {
namespace {

Host* current = nullptr;  // the host of the suites: one at a time

void fault(const std::string& text) {
    if (current) current->fault(text);
}

const Property* find_property(std::string_view name) {
    for (const Property& row : properties())
        if (row.name.ends_with('_') ? name.starts_with(row.name) : name == row.name) return &row;
    return nullptr;
}

Type type_of(const Property& row, const PropertyObject& object) {
    return row.type == kOfParameter ? object.parameter->type : row.type;
}

// Whether the call is right: a known property of such an object, of this type, and an index that it
// has. Sets and gets that are not are faults of the plugin.
bool is_right(const PropertyObject* object, const char* name, Type type, int index,
              const char* call) {
    const Property* row = find_property(name);
    const auto wrong = [&](const char* what) {
        fault(concat(call, " ", name, " [", index, "]: ", what));
        return false;
    };
    if (!object) return wrong("no handle");
    if (!row) return wrong("no such property");
    if (!(row->owners & object->owner)) return wrong("not a property of such an object");
    if (type_of(*row, *object) != type) return wrong("of another type");
    const int dimension = row->type == kOfParameter ? object->parameter->dimension : row->dimension;
    if (index < 0 || (dimension > 0 && index >= dimension)) return wrong("beyond its dimension");
    return true;
}

template <class T>
int set_value(void* handle, const char* name, int index, Type type, const T& value) {
    auto* object = static_cast<PropertyObject*>(handle);
    if (!is_right(object, name, type, index, "set")) return kStatErrUnknown;
    if constexpr (std::is_same_v<T, std::string>) {
        const auto& allowed = values_of(name);
        if (!allowed.empty() && std::ranges::find(allowed, value) == allowed.end())
            fault(concat("set ", name, ": the standard has no value ", value));
    }
    auto& values = object->values[name];
    if (index > int(values.size()))
        fault(concat("set ", name, " [", index, "]: an index is left out"));
    if (size_t(index) >= values.size()) values.resize(size_t(index) + 1);
    values[size_t(index)] = Value(value);
    return kStatOK;
}

template <class T>
int get_value(void* handle, const char* name, int index, Type type, T* value) {
    auto* object = static_cast<PropertyObject*>(handle);
    if (!is_right(object, name, type, index, "get")) return kStatErrUnknown;
    const auto found = object->values.find(std::string_view(name));
    if (found == object->values.end()) return kStatErrUnknown;
    if (size_t(index) >= found->second.size()) return kStatErrBadIndex;
    Value& held = found->second[size_t(index)];
    if constexpr (std::is_same_v<T, char*>)
        *value = std::get<std::string>(held).data();
    else
        *value = std::get<T>(held);
    return kStatOK;
}

// Functions that the plugin does not use, and a call that is not checked would be a fault.
template <class... Args>
int not_used(Args...) {
    fault("a function of a suite was called that the plugin does not use");
    return kStatFailed;
}
int not_used_with_values(void*, ...) {
    return not_used();
}
int not_used_at_time(void*, double, ...) {
    return not_used();
}
int not_used_between(void*, double, double, ...) {
    return not_used();
}

const OfxPropertySuiteV1 property_suite = {
    [](void* set, const char* name, int i, void* value) {
        return set_value(set, name, i, kPointer, value);
    },
    [](void* set, const char* name, int i, const char* value) {
        return set_value(set, name, i, kString, std::string(value));
    },
    [](void* set, const char* name, int i, double value) {
        return set_value(set, name, i, kDouble, value);
    },
    [](void* set, const char* name, int i, int value) {
        return set_value(set, name, i, kInt, value);
    },
    not_used,
    not_used,
    not_used,
    not_used,
    [](void* set, const char* name, int i, void** value) {
        return get_value(set, name, i, kPointer, value);
    },
    [](void* set, const char* name, int i, char** value) {
        return get_value(set, name, i, kString, value);
    },
    [](void* set, const char* name, int i, double* value) {
        return get_value(set, name, i, kDouble, value);
    },
    [](void* set, const char* name, int i, int* value) {
        return get_value(set, name, i, kInt, value);
    },
    not_used,
    not_used,
    not_used,
    not_used,
    not_used,
    not_used};

struct ImageObject : PropertyObject {
    std::vector<std::byte> data;
    Picture* target = nullptr;  // an output: written back when it is released
};

int bytes_of(const std::string& depth) {
    return depth == "OfxBitDepthFloat" ? 4 : depth == "OfxBitDepthHalf" ? 2 : 1;
}

std::string components_of(int channels) {
    return channels == 4   ? "OfxImageComponentRGBA"
           : channels == 3 ? "OfxImageComponentRGB"
           : channels == 1 ? "OfxImageComponentAlpha"
                           : "uk.co.thefoundry.OfxImageComponentMotionVectors";
}

// Where the row `y`, from the top, begins.
std::byte* row_of(ImageObject& image, const Picture& picture, int y, int row_bytes) {
    const int at = picture.negative_rows ? y : picture.pixels.height - 1 - y;
    return image.data.data() + std::ptrdiff_t(at) * row_bytes;
}

int row_bytes_of(const Picture& picture) {
    return picture.pixels.width * picture.pixels.channels * bytes_of(picture.depth) +
           picture.padding;
}

ImageObject* image_of(const Picture& picture, const EffectObject& effect) {
    auto* image = new ImageObject;
    const ImageF& pixels = picture.pixels;
    const int row_bytes = row_bytes_of(picture);
    image->data.resize(size_t(row_bytes) * size_t(pixels.height));
    const size_t values = size_t(pixels.width) * size_t(pixels.channels);
    for (int y = 0; y < pixels.height; ++y) {
        std::byte* to = row_of(*image, picture, y, row_bytes);
        if (bytes_of(picture.depth) == 4)
            std::memcpy(to, pixels.pixel(0, y), values * 4);
        else if (bytes_of(picture.depth) == 2)
            gl::to_halves(pixels.pixel(0, y), reinterpret_cast<uint16_t*>(to), values);
    }
    PropertyObject& properties = *image;
    properties.owner = kImage;
    std::byte* lowest = row_of(*image, picture, pixels.height - 1, row_bytes);
    properties.set("OfxImagePropData", {static_cast<void*>(lowest)});
    properties.set("OfxImagePropRowBytes", {picture.negative_rows ? -row_bytes : row_bytes});
    properties.set("OfxImagePropBounds",
                   {picture.x, picture.y, picture.x + pixels.width, picture.y + pixels.height});
    properties.set("OfxImageEffectPropPixelDepth", {picture.depth});
    properties.set("OfxImageEffectPropComponents", {components_of(pixels.channels)});
    properties.set("OfxImageEffectPropPreMultiplication", {picture.premultiplication});
    properties.set("OfxImageEffectPropRenderScale", {effect.scale_x, effect.scale_y});
    return image;
}

void write_back(ImageObject& image) {
    Picture& picture = *image.target;
    ImageF& pixels = picture.pixels;
    const size_t values = size_t(pixels.width) * size_t(pixels.channels);
    for (int y = 0; y < pixels.height; ++y) {
        const std::byte* from = row_of(image, picture, y, row_bytes_of(picture));
        if (bytes_of(picture.depth) == 4)
            std::memcpy(pixels.pixel(0, y), from, values * 4);
        else if (bytes_of(picture.depth) == 2)
            gl::from_halves(reinterpret_cast<const uint16_t*>(from), pixels.pixel(0, y), values);
    }
}

EffectObject* effect_of(void* handle) {
    return static_cast<EffectObject*>(handle);
}

const OfxImageEffectSuiteV1 effect_suite = {
    [](void* effect, void** set) {
        *set = &effect_of(effect)->properties;
        return kStatOK;
    },
    [](void* effect, void** set) {
        *set = effect;
        return kStatOK;
    },
    [](void* effect, const char* name, void** set) {
        PropertyObject& clip = effect_of(effect)->described[name];
        if (clip.owner == kClip) fault(concat("clip ", name, " is defined twice"));
        clip.owner = kClip;
        if (set) *set = &clip;
        return kStatOK;
    },
    [](void* effect, const char* name, void** clip, void** set) {
        auto& clips = effect_of(effect)->clips;
        const auto found = clips.find(name);
        if (found == clips.end()) return kStatErrUnknown;
        if (clip) *clip = &found->second;
        if (set) *set = &found->second.properties;
        return kStatOK;
    },
    not_used,
    [](void* handle, double time, const OfxRectD*, void** image) {
        auto& clip = *static_cast<ClipObject*>(handle);
        EffectObject& effect = *clip.effect;
        ImageObject* made = nullptr;
        if (clip.properties.text("OfxPropName") == "Output") {
            made = image_of(effect.output, effect);
            made->target = &effect.output;
        } else {
            const auto picture = clip.feed ? clip.feed(time) : std::nullopt;
            if (!picture) return kStatFailed;
            made = image_of(*picture, effect);
        }
        ++effect.host->images_out_;
        *image = static_cast<PropertyObject*>(made);
        return kStatOK;
    },
    [](void* handle) {
        auto* image = static_cast<ImageObject*>(static_cast<PropertyObject*>(handle));
        if (image->target) write_back(*image);
        if (current) --current->images_out_;
        delete image;
        return kStatOK;
    },
    [](void* handle, double time, OfxRectD* region) {
        auto& clip = *static_cast<ClipObject*>(handle);
        const auto picture = clip.feed ? clip.feed(time) : std::nullopt;
        if (!picture) return kStatFailed;
        const EffectObject& effect = *clip.effect;
        const double aspect = clip.properties.number("OfxImagePropPixelAspectRatio");
        const double x = aspect / effect.scale_x, y = 1 / effect.scale_y;
        *region = {picture->x * x, picture->y * y, (picture->x + picture->pixels.width) * x,
                   (picture->y + picture->pixels.height) * y};
        return kStatOK;
    },
    [](void* handle) {
        EffectObject& effect = *effect_of(handle);
        ++effect.abort_asked;
        return effect.abort && effect.abort() ? 1 : 0;
    },
    not_used,
    not_used,
    not_used,
    not_used};

int get_values(ParameterObject& parameter, double time, va_list values) {
    const ParameterKind& type = *parameter.properties.parameter;
    if (type.dimension == 0) {
        fault("a value was read of a parameter without one");
        return kStatErrBadHandle;
    }
    if (type.type == kString) {
        *va_arg(values, char**) = parameter.text.data();
        return kStatOK;
    }
    const auto numbers = parameter.numbers(time);
    for (int i = 0; i < type.dimension; ++i)
        if (type.type == kInt)
            *va_arg(values, int*) = int(std::lround(numbers[size_t(i)]));
        else
            *va_arg(values, double*) = numbers[size_t(i)];
    return kStatOK;
}

int get_value_at_time(void* handle, double time, ...) {
    va_list values;
    va_start(values, time);
    const int status = get_values(*static_cast<ParameterObject*>(handle), time, values);
    va_end(values);
    return status;
}

// Only texts.
int set_parameter(void* handle, ...) {
    auto& parameter = *static_cast<ParameterObject*>(handle);
    if (parameter.properties.owner != kText) return not_used();
    va_list values;
    va_start(values, handle);
    const std::string text = va_arg(values, const char*);
    va_end(values);
    if (parameter.text == text) fault("a parameter was set to the text that it has");
    parameter.text = text;
    if (!current->may_set) fault("a parameter was set in an action that may not");
    return kStatOK;
}

const OfxParameterSuiteV1 parameter_suite = {
    [](void* handle, const char* type, const char* name, void** set) {
        EffectObject& effect = *effect_of(handle);
        const auto& types = parameter_kinds();
        const auto found = std::ranges::find(types, type, &ParameterKind::name);
        if (found == types.end()) {
            fault(concat("parameter ", name, ": no type ", type));
            return kStatErrUnknown;
        }
        const std::string_view word = name;
        if (word.empty() ||
            word.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") != word.npos)
            fault(concat("parameter '", name, "': hosts make a word of a script of it"));
        if (effect.parameters.contains(name))
            fault(concat("parameter ", name, " is defined twice"));
        ParameterObject& parameter = effect.parameters[name];
        parameter.properties.owner = found->owner;
        parameter.properties.parameter = &*found;
        effect.order.push_back(name);
        if (set) *set = &parameter.properties;
        return kStatOK;
    },
    [](void* handle, const char* name, void** parameter, void** set) {
        auto& parameters = effect_of(handle)->parameters;
        const auto found = parameters.find(name);
        if (found == parameters.end()) return kStatErrUnknown;
        if (parameter) *parameter = &found->second;
        if (set) *set = &found->second.properties;
        return kStatOK;
    },
    not_used,
    not_used,
    not_used_with_values,
    get_value_at_time,
    not_used_at_time,
    not_used_between,
    set_parameter,
    not_used_at_time,
    not_used,
    not_used,
    not_used,
    not_used,
    not_used,
    not_used,
    not_used,
    not_used};

std::string printed(const char* format, va_list values) {
    char text[4096];
    std::vsnprintf(text, sizeof(text), format, values);
    return text;
}

int show_message(void*, const char*, const char*, const char*, ...) {
    return not_used();
}

int set_persistent_message(void* handle, const char* type, const char*, const char* format, ...) {
    EffectObject& effect = *effect_of(handle);
    va_list values;
    va_start(values, format);
    effect.message = printed(format, values);
    va_end(values);
    effect.message_type = type;
    ++effect.messages;
    return kStatOK;
}

const OfxMessageSuiteV2 message_suite = {show_message, set_persistent_message, [](void* handle) {
                                             effect_of(handle)->message.clear();
                                             effect_of(handle)->message_type.clear();
                                             return kStatOK;
                                         }};

const void* fetch_suite(void*, const char* name, int version) {
    const std::string_view suite = name;
    if (current->refused.contains(name)) return nullptr;
    if (suite == "OfxPropertySuite" && version == 1) return &property_suite;
    if (suite == "OfxImageEffectSuite" && version == 1) return &effect_suite;
    if (suite == "OfxParameterSuite" && version == 1) return &parameter_suite;
    if (suite == "OfxMessageSuite" && version == 2) return &message_suite;
    return nullptr;
}

}  // namespace

std::string PropertyObject::text(const std::string& name, size_t index) const {
    const auto found = values.find(name);
    if (found == values.end() || index >= found->second.size()) return "";
    return std::get<std::string>(found->second[index]);
}

double PropertyObject::number(const std::string& name, size_t index) const {
    return std::get<double>(values.at(name).at(index));
}

int PropertyObject::integer(const std::string& name, size_t index) const {
    return std::get<int>(values.at(name).at(index));
}

std::vector<double> PropertyObject::numbers(const std::string& name) const {
    std::vector<double> numbers;
    for (const Value& value : values.at(name)) numbers.push_back(std::get<double>(value));
    return numbers;
}

Host::Host(std::set<std::string> without) : refused(std::move(without)) {
    EXPECT_EQ(current, nullptr);
    current = this;
    properties.owner = kHostItself;
    properties.set("OfxPropName", {std::string("postchain.test_host")});
    properties.set("OfxPropAPIVersion", {1, 4});
    properties.set("OfxParamHostPropSupportsBooleanAnimation", {1});
    properties.set("OfxParamHostPropSupportsChoiceAnimation", {0});
    const std::string path =
        POSTCHAIN_BINARY_DIR "/openfx/postchain.ofx.bundle/Contents/Linux-x86-64/postchain.ofx";
    library_ = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    EXPECT_NE(library_, nullptr) << dlerror();
    const auto count = reinterpret_cast<int (*)()>(dlsym(library_, "OfxGetNumberOfPlugins"));
    get_ = reinterpret_cast<OfxPlugin* (*)(int)>(dlsym(library_, "OfxGetPlugin"));
    EXPECT_TRUE(count && get_);
    count_ = count();
    entry_ = {&properties, fetch_suite};
}

Host::~Host() {
    for (const auto& [plugin, loads] : loads_)
        for (int i = 0; i < loads; ++i) EXPECT_EQ(act(plugin, "OfxActionUnload"), kStatOK);
    EXPECT_EQ(images_out_, 0);
    for (const std::string& text : faults()) ADD_FAILURE() << text;
    current = nullptr;
    dlclose(library_);
}

OfxPlugin* Host::plugin(const std::string& identifier) const {
    for (int i = 0; i < count_; ++i)
        if (get_(i)->pluginIdentifier == identifier) return get_(i);
    ADD_FAILURE() << "no effect " << identifier;
    return nullptr;
}

int Host::act(OfxPlugin* plugin, const char* action, void* handle, PropertyObject* in,
              PropertyObject* out) {
    if (in) in->owner = kIn;
    if (out) out->owner = kOut;
    return plugin->mainEntry(action, handle, in, out);
}

int Host::load(OfxPlugin* plugin) {
    plugin->setHost(&entry_);
    const int status = act(plugin, "OfxActionLoad");
    if (status == kStatOK) ++loads_[plugin];
    return status;
}

const EffectObject& Host::described(OfxPlugin* plugin, const std::string& context) {
    auto& effect = descriptions_[plugin->pluginIdentifier + context];
    if (effect) return *effect;
    if (!loads_.contains(plugin)) {
        EXPECT_EQ(load(plugin), kStatOK);
    }
    EffectObject first;
    first.host = this;
    first.properties.owner = kEffect;
    EXPECT_EQ(act(plugin, "OfxActionDescribe", &first), kStatOK);
    effect = std::make_unique<EffectObject>();
    effect->host = this;
    effect->properties = first.properties;
    PropertyObject in;
    in.set("OfxImageEffectPropContext", {context});
    EXPECT_EQ(act(plugin, "OfxImageEffectActionDescribeInContext", effect.get(), &in), kStatOK);
    return *effect;
}

void Host::fault(const std::string& text) {
    const std::lock_guard lock(mutex_);
    faults_.push_back(text);
}

std::vector<std::string> Host::faults() const {
    const std::lock_guard lock(mutex_);
    return faults_;
}

Node::Node(Host& host, const std::string& identifier, int width, int height,
           const std::string& context)
    : host_(host), plugin_(host.plugin(identifier)), object_(std::make_unique<EffectObject>()) {
    const EffectObject& description = host.described(plugin_, context);
    object_->host = &host;
    object_->properties = description.properties;
    object_->properties.set("OfxImageEffectPropContext", {context});
    object_->properties.set("OfxImageEffectPropProjectSize", {double(width), double(height)});
    object_->properties.set("OfxImageEffectPropProjectOffset", {0.0, 0.0});
    object_->parameters = description.parameters;
    object_->order = description.order;
    for (auto& [name, parameter] : object_->parameters) {
        const ParameterKind& type = *parameter.properties.parameter;
        const auto found = parameter.properties.values.find("OfxParamPropDefault");
        if (type.dimension == 0 || found == parameter.properties.values.end()) continue;
        const auto& values = found->second;
        if (type.type == kString) {
            parameter.text = std::get<std::string>(values[0]);
            continue;
        }
        std::array<double, 2> numbers = {};
        for (size_t i = 0; i < values.size(); ++i)
            numbers[i] =
                type.type == kInt ? double(std::get<int>(values[i])) : std::get<double>(values[i]);
        const bool normalized = parameter.properties.text("OfxParamPropDefaultCoordinateSystem") ==
                                "OfxParamCoordinatesNormalised";
        if (normalized) numbers = {numbers[0] * width, numbers[1] * height};
        parameter.numbers = [numbers](double) { return numbers; };
    }
    for (const auto& [name, clip] : description.described) {
        ClipObject& own = object_->clips[name];
        own.effect = object_.get();
        own.properties = clip;
        own.properties.set("OfxPropName", {name});
        own.properties.set("OfxImageClipPropConnected", {0});
        own.properties.set("OfxImageEffectPropFrameRange", {-1e9, 1e9});
        own.properties.set("OfxImagePropPixelAspectRatio", {1.0});
    }
    object_->output.pixels = ImageF(width, height, 4);
    host.may_set = true;
    EXPECT_EQ(host.act(plugin_, "OfxActionCreateInstance", object_.get()), kStatOK);
    host.may_set = false;
}

Node::~Node() {
    EXPECT_EQ(host_.act(plugin_, "OfxActionDestroyInstance", object_.get()), kStatOK);
}

void Node::set(const std::string& name, double value, double second) {
    ParameterObject& parameter = object_->parameters.at(name);
    parameter.numbers = [=](double) { return std::array{value, second}; };
}

void Node::set(const std::string& name, const std::string& text) {
    object_->parameters.at(name).text = text;
}

void Node::animate(const std::string& name, std::function<double(double)> value) {
    object_->parameters.at(name).numbers = [value = std::move(value)](double time) {
        return std::array{value(time), 0.0};
    };
}

void Node::choose(const std::string& name, const std::string& option) {
    const auto& options =
        object_->parameters.at(name).properties.values.at("OfxParamPropChoiceOption");
    const auto found = std::ranges::find(options, Value(option));
    ASSERT_NE(found, options.end()) << name << ": " << option;
    set(name, double(found - options.begin()));
}

void Node::use(const std::string& name, double value, double second) {
    set("use_" + name, 1);
    set(name, value, second);
}

int Node::changed(const std::string& name, double time) {
    PropertyObject in;
    in.set("OfxPropType", {std::string("OfxTypeParameter")});
    in.set("OfxPropName", {name});
    in.set("OfxPropChangeReason", {std::string("OfxChangeUserEdited")});
    in.set("OfxPropTime", {time});
    in.set("OfxImageEffectPropRenderScale", {1.0, 1.0});
    host_.may_set = true;
    const int status = host_.act(plugin_, "OfxActionInstanceChanged", object_.get(), &in);
    host_.may_set = false;
    return status;
}

void Node::connect(const std::string& clip, Feed feed, double first, double last) {
    ClipObject& object = object_->clips.at(clip);
    object.feed = std::move(feed);
    object.properties.set("OfxImageClipPropConnected", {object.feed ? 1 : 0});
    object.properties.set("OfxImageEffectPropFrameRange", {first, last});
}

void Node::connect(const std::string& clip, Picture picture) {
    connect(clip, [picture = std::move(picture)](double) { return std::optional(picture); });
}

void Node::in(PropertyObject& in, double time) const {
    in.set("OfxPropTime", {time});
    in.set("OfxImageEffectPropRenderScale", {object_->scale_x, object_->scale_y});
    in.set("OfxImageEffectPropFieldToRender", {object_->field});
}

int Node::region_of_definition(double time, std::array<double, 4>& region) {
    PropertyObject arguments, out;
    in(arguments, time);
    out.set("OfxImageEffectPropRegionOfDefinition", {0.0, 0.0, 0.0, 0.0});
    const int status = host_.act(plugin_, "OfxImageEffectActionGetRegionOfDefinition",
                                 object_.get(), &arguments, &out);
    for (size_t i = 0; i < 4; ++i)
        region[i] = out.number("OfxImageEffectPropRegionOfDefinition", i);
    return status;
}

std::map<std::string, std::vector<double>> Node::frames_needed(double time) {
    PropertyObject arguments, out;
    in(arguments, time);
    EXPECT_EQ(
        host_.act(plugin_, "OfxImageEffectActionGetFramesNeeded", object_.get(), &arguments, &out),
        kStatOK);
    std::map<std::string, std::vector<double>> frames;
    for (const auto& [name, values] : out.values)
        frames[name.substr(name.find('_') + 1)] = out.numbers(name);
    return frames;
}

std::map<std::string, std::vector<double>> Node::regions_of_interest(double time) {
    PropertyObject arguments, out;
    in(arguments, time);
    arguments.set("OfxImageEffectPropRegionOfInterest", {0.0, 0.0, 4.0, 4.0});
    EXPECT_EQ(host_.act(plugin_, "OfxImageEffectActionGetRegionsOfInterest", object_.get(),
                        &arguments, &out),
              kStatOK);
    std::map<std::string, std::vector<double>> regions;
    for (const auto& [name, values] : out.values)
        regions[name.substr(name.find('_') + 1)] = out.numbers(name);
    return regions;
}

bool Node::frame_varying() {
    PropertyObject out;
    out.set("OfxImageEffectFrameVarying", {0});
    host_.act(plugin_, "OfxImageEffectActionGetClipPreferences", object_.get(), nullptr, &out);
    return out.integer("OfxImageEffectFrameVarying") != 0;
}

std::string Node::identity(double time) {
    PropertyObject arguments, out;
    in(arguments, time);
    arguments.set("OfxImageEffectPropRenderWindow",
                  {0, 0, object_->output.pixels.width, object_->output.pixels.height});
    out.set("OfxPropName", {std::string()});
    out.set("OfxPropTime", {-1.0});
    const int status =
        host_.act(plugin_, "OfxImageEffectActionIsIdentity", object_.get(), &arguments, &out);
    EXPECT_TRUE(status == kStatOK || status == kStatReplyDefault) << status;
    EXPECT_EQ(out.number("OfxPropTime"), status == kStatOK ? time : -1);
    return status == kStatOK ? out.text("OfxPropName") : "";
}

int Node::render(double time) {
    const Picture& output = object_->output;
    return render(time, {output.x, output.y, output.x + output.pixels.width,
                         output.y + output.pixels.height});
}

int Node::render(double time, std::array<int, 4> window) {
    PropertyObject arguments;
    in(arguments, time);
    arguments.set("OfxImageEffectPropRenderWindow", {window[0], window[1], window[2], window[3]});
    return host_.act(plugin_, "OfxImageEffectActionRender", object_.get(), &arguments);
}

ImageF Node::rendered(double time) {
    EXPECT_EQ(render(time), kStatOK) << message();
    return object_->output.pixels;
}

ImageF arranged(const ImageF& from, const std::vector<int>& channels) {
    ImageF image(from.width, from.height, int(channels.size()));
    for (size_t i = 0; i < image.pixels(); ++i)
        for (size_t c = 0; c < channels.size(); ++c)
            if (channels[c] >= 0)
                image.data[i * channels.size() + c] =
                    from.data[i * size_t(from.channels) + size_t(channels[c])];
    return image;
}

ImageF joined(const ImageF& first, const ImageF& second) {
    ImageF image(first.width, first.height, first.channels + second.channels);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            std::copy_n(first.pixel(x, y), first.channels, image.pixel(x, y));
            std::copy_n(second.pixel(x, y), second.channels, image.pixel(x, y) + first.channels);
        }
    return image;
}

}  // namespace postchain::openfx::test
