// Access to the host: its suites, properties by type, parameters at a time, images.
#pragma once

#include <array>
#include <initializer_list>
#include <optional>
#include <string>

#include "chain/base/status.h"
#include "tools/openfx/standard.h"

namespace postchain::openfx {

struct Suites {
    PropertySet host = nullptr;
    const PropertySuite* properties = nullptr;
    const EffectSuite* effects = nullptr;
    const ParameterSuite* parameters = nullptr;
    const MessageSuite* messages = nullptr;  // null: the host has none
};
const Suites& suites();

void set_host(HostEntry* entry);
// Fetches the suites. False: one is missing that the plugin cannot do without.
bool load_suites();

// Reads and sets properties. One that the host does not have reads as the fallback.
class Properties {
  public:
    Properties(PropertySet set) : set_(set) {}
    std::string text(const char* name, int index = 0) const;
    int integer(const char* name, int index, int fallback) const;
    double number(const char* name, int index, double fallback) const;
    void* pointer(const char* name) const;

    void set(const std::string& name, const char* value, int index = 0) const;
    void set(const std::string& name, const std::string& value, int index = 0) const {
        set(name, value.c_str(), index);
    }
    void set(const std::string& name, int value, int index = 0) const;
    void set(const std::string& name, double value, int index = 0) const;
    void set_pointer(const char* name, void* value) const;
    template <class T>
    void set(const std::string& name, std::initializer_list<T> values) const {
        int index = 0;
        for (const T& value : values) set(name, value, index++);
    }

  private:
    PropertySet set_;
};

Properties properties_of(Effect effect);

// Values of an effect's parameters at a time.
class Values {
  public:
    Values(Effect effect, double time);
    double time() const { return time_; }
    Values at(double time) const { return {set_, time}; }
    bool has(const std::string& name) const;
    bool boolean(const std::string& name) const { return integer(name) != 0; }
    int integer(const std::string& name) const;
    // The index of a choice. Error (chain): not one of `count`, as in a document of a later
    // release.
    Result<size_t> choice(const std::string& name, size_t count) const;
    double number(const std::string& name) const;
    std::array<double, 2> point(const std::string& name) const;
    std::string text(const std::string& name) const;
    // Only in the action kActionInstanceChanged.
    void set_text(const std::string& name, const std::string& value) const;
    // Grays a parameter out, or not. Does nothing if it is so already.
    void enable(const std::string& name, bool enabled) const;

  private:
    Values(ParameterSet set, double time) : set_(set), time_(time) {}
    HostParameter handle(const std::string& name, PropertySet* properties = nullptr) const;
    ParameterSet set_ = nullptr;
    double time_;
};

// Pixels of a plane whose rows go up: x1 <= x < x2, y1 <= y < y2.
struct Bounds {
    int x1 = 0, y1 = 0, x2 = 0, y2 = 0;

    int width() const { return x2 - x1; }
    int height() const { return y2 - y1; }
    bool empty() const { return x1 >= x2 || y1 >= y2; }
    bool contains(const Bounds& other) const;
    Bounds united(const Bounds& other) const;
    Bounds intersected(const Bounds& other) const;
    std::string text() const;  // "(0, 0) to (1920, 1080)"
    bool operator==(const Bounds&) const = default;
};

// An image of a clip, given back to the host at its end.
class HostImage {
  public:
    enum class Sample { none, half, float32 };

    // Empty: the host has no image of this clip at this time.
    static std::optional<HostImage> fetch(ClipHandle clip, double time);
    HostImage(HostImage&& other) noexcept;
    HostImage& operator=(HostImage&&) = delete;
    ~HostImage();

    // Error (input) if its pixels are integers, or it has neither 4, 3 nor 1 components.
    Status check(const std::string& clip) const;
    const Bounds& bounds() const { return bounds_; }
    int channels() const { return channels_; }
    bool unpremultiplied() const { return unpremultiplied_; }
    // `count` pixels of a row from x on, all channels; inside bounds().
    void read(int x, int y, int count, float* to) const;
    void write(int x, int y, int count, const float* from);

  private:
    HostImage() = default;
    std::byte* at(int x, int y) const;
    PropertySet set_ = nullptr;
    std::byte* data_ = nullptr;
    std::ptrdiff_t row_bytes_ = 0;
    Bounds bounds_;
    int channels_ = 0;
    Sample sample_ = Sample::none;
    std::string depth_;
    bool unpremultiplied_ = false;
};

}  // namespace postchain::openfx
