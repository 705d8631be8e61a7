#include "tools/openfx/host.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "chain/gl/half.h"

namespace postchain::openfx {
namespace {

HostEntry* entry = nullptr;
Suites found;

template <class Suite>
const Suite* fetch(const char* name, int version) {
    return static_cast<const Suite*>(entry->fetch_suite(entry->properties, name, version));
}

}  // namespace

const Suites& suites() {
    return found;
}

void set_host(HostEntry* given) {
    entry = given;
}

bool load_suites() {
    if (!entry || !entry->fetch_suite) return false;
    found.host = entry->properties;
    found.properties = fetch<PropertySuite>(kPropertySuite, 1);
    found.effects = fetch<EffectSuite>(kEffectSuite, 1);
    found.parameters = fetch<ParameterSuite>(kParameterSuite, 1);
    found.messages = fetch<MessageSuite>(kMessageSuite, 2);
    return found.properties && found.effects && found.parameters;
}

std::string Properties::text(const char* name, int index) const {
    char* value = nullptr;
    const bool ok = set_ && suites().properties->get_string(set_, name, index, &value) == kOk;
    return ok && value ? value : "";
}

int Properties::integer(const char* name, int index, int fallback) const {
    int value = fallback;
    const bool ok = set_ && suites().properties->get_int(set_, name, index, &value) == kOk;
    return ok ? value : fallback;
}

double Properties::number(const char* name, int index, double fallback) const {
    double value = fallback;
    const bool ok = set_ && suites().properties->get_double(set_, name, index, &value) == kOk;
    return ok ? value : fallback;
}

void* Properties::pointer(const char* name) const {
    void* value = nullptr;
    const bool ok = set_ && suites().properties->get_pointer(set_, name, 0, &value) == kOk;
    return ok ? value : nullptr;
}

void Properties::set(const std::string& name, const char* value, int index) const {
    if (set_) suites().properties->set_string(set_, name.c_str(), index, value);
}

void Properties::set(const std::string& name, int value, int index) const {
    if (set_) suites().properties->set_int(set_, name.c_str(), index, value);
}

void Properties::set(const std::string& name, double value, int index) const {
    if (set_) suites().properties->set_double(set_, name.c_str(), index, value);
}

void Properties::set_pointer(const char* name, void* value) const {
    if (set_) suites().properties->set_pointer(set_, name, 0, value);
}

Properties properties_of(Effect effect) {
    PropertySet set = nullptr;
    suites().effects->get_property_set(effect, &set);
    return set;
}

Values::Values(Effect effect, double time) : time_(time) {
    suites().effects->get_parameter_set(effect, &set_);
}

HostParameter Values::handle(const std::string& name, PropertySet* properties) const {
    HostParameter parameter = nullptr;
    const bool ok =
        suites().parameters->get_handle(set_, name.c_str(), &parameter, properties) == kOk;
    return ok ? parameter : nullptr;
}

bool Values::has(const std::string& name) const {
    return handle(name) != nullptr;
}

int Values::integer(const std::string& name) const {
    int value = 0;
    if (const HostParameter parameter = handle(name))
        suites().parameters->get_value_at_time(parameter, time_, &value);
    return value;
}

Result<size_t> Values::choice(const std::string& name, size_t count) const {
    const int index = integer(name);
    if (index >= 0 && size_t(index) < count) return size_t(index);
    return Status(StatusCode::chain,
                  concat(name, ": has no option number ", index, "; choose one of the list"));
}

double Values::number(const std::string& name) const {
    double value = 0;
    if (const HostParameter parameter = handle(name))
        suites().parameters->get_value_at_time(parameter, time_, &value);
    return value;
}

std::array<double, 2> Values::point(const std::string& name) const {
    std::array<double, 2> value = {};
    if (const HostParameter parameter = handle(name))
        suites().parameters->get_value_at_time(parameter, time_, &value[0], &value[1]);
    return value;
}

std::string Values::text(const std::string& name) const {
    char* value = nullptr;
    if (const HostParameter parameter = handle(name))
        suites().parameters->get_value_at_time(parameter, time_, &value);
    return value ? value : "";
}

void Values::set_text(const std::string& name, const std::string& value) const {
    if (const HostParameter parameter = handle(name); parameter && text(name) != value)
        suites().parameters->set_value(parameter, value.c_str());
}

void Values::enable(const std::string& name, bool enabled) const {
    PropertySet set = nullptr;
    if (!handle(name, &set)) return;
    if (Properties(set).integer(kParamEnabled, 0, 1) != int(enabled))
        Properties(set).set(kParamEnabled, int(enabled));
}

bool Bounds::contains(const Bounds& other) const {
    return x1 <= other.x1 && y1 <= other.y1 && x2 >= other.x2 && y2 >= other.y2;
}

Bounds Bounds::united(const Bounds& other) const {
    return {std::min(x1, other.x1), std::min(y1, other.y1), std::max(x2, other.x2),
            std::max(y2, other.y2)};
}

Bounds Bounds::intersected(const Bounds& other) const {
    return {std::max(x1, other.x1), std::max(y1, other.y1), std::min(x2, other.x2),
            std::min(y2, other.y2)};
}

std::string Bounds::text() const {
    return concat("(", x1, ", ", y1, ") to (", x2, ", ", y2, ")");
}

std::optional<HostImage> HostImage::fetch(ClipHandle clip, double time) {
    HostImage image;
    if (suites().effects->get_image(clip, time, nullptr, &image.set_) != kOk || !image.set_) {
        image.set_ = nullptr;
        return std::nullopt;
    }
    const Properties properties(image.set_);
    image.data_ = static_cast<std::byte*>(properties.pointer(kPropData));
    image.row_bytes_ = properties.integer(kPropRowBytes, 0, 0);
    image.bounds_ = {properties.integer(kPropBounds, 0, 0), properties.integer(kPropBounds, 1, 0),
                     properties.integer(kPropBounds, 2, 0), properties.integer(kPropBounds, 3, 0)};
    image.depth_ = properties.text(kPropPixelDepth);
    image.sample_ = image.depth_ == kDepthFloat  ? Sample::float32
                    : image.depth_ == kDepthHalf ? Sample::half
                                                 : Sample::none;
    const std::string components = properties.text(kPropComponents);
    image.channels_ = components == kComponentsRgba    ? 4
                      : components == kComponentsRgb   ? 3
                      : components == kComponentsAlpha ? 1
                                                       : 0;
    image.unpremultiplied_ = properties.text(kPropPremultiplication) == kUnpremultiplied;
    if (!image.data_ || image.bounds_.empty()) return std::nullopt;
    return image;
}

HostImage::HostImage(HostImage&& other) noexcept
    : set_(std::exchange(other.set_, nullptr)),
      data_(other.data_),
      row_bytes_(other.row_bytes_),
      bounds_(other.bounds_),
      channels_(other.channels_),
      sample_(other.sample_),
      depth_(std::move(other.depth_)),
      unpremultiplied_(other.unpremultiplied_) {}

HostImage::~HostImage() {
    if (set_) suites().effects->release_image(set_);
}

Status HostImage::check(const std::string& clip) const {
    if (sample_ == Sample::none)
        return input_error(concat(clip, ": pixels are ", depth_, "; connect float or half images"));
    if (channels_ == 0)
        return input_error(concat(clip, ": components are neither RGBA, RGB nor alpha"));
    return Status();
}

std::byte* HostImage::at(int x, int y) const {
    const int bytes = channels_ * (sample_ == Sample::half ? 2 : 4);
    return data_ + (y - bounds_.y1) * row_bytes_ + std::ptrdiff_t(x - bounds_.x1) * bytes;
}

void HostImage::read(int x, int y, int count, float* to) const {
    const size_t values = size_t(count) * size_t(channels_);
    if (sample_ == Sample::half)
        gl::from_halves(reinterpret_cast<const uint16_t*>(at(x, y)), to, values);
    else
        std::memcpy(to, at(x, y), values * sizeof(float));
}

void HostImage::write(int x, int y, int count, const float* from) {
    const size_t values = size_t(count) * size_t(channels_);
    if (sample_ == Sample::half)
        gl::to_halves(from, reinterpret_cast<uint16_t*>(at(x, y)), values);
    else
        std::memcpy(at(x, y), from, values * sizeof(float));
}

}  // namespace postchain::openfx
