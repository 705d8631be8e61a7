// A small OpenFX host: loads the bundle, records what it describes, and runs its actions. Every
// call of the plugin is checked: properties by type, dimension and owner, handles, and the actions
// in which a call is allowed.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "chain/base/image.h"
#include "tests/openfx/standard_table.h"

namespace postchain::openfx::test {

// Status codes: Reference, "Status Codes".
inline constexpr int kStatOK = 0;
inline constexpr int kStatFailed = 1;
inline constexpr int kStatErrUnknown = 3;
inline constexpr int kStatErrMissingHostFeature = 4;
inline constexpr int kStatErrMemory = 8;
inline constexpr int kStatErrBadHandle = 9;
inline constexpr int kStatErrBadIndex = 10;
inline constexpr int kStatReplyDefault = 14;

using Value = std::variant<std::string, double, int, void*>;

struct PropertyObject {
    Owner owner = kIn;
    const ParameterKind* parameter = nullptr;
    std::map<std::string, std::vector<Value>, std::less<>> values;

    void set(const std::string& name, std::vector<Value> value) { values[name] = std::move(value); }
    std::string text(const std::string& name, size_t index = 0) const;
    double number(const std::string& name, size_t index = 0) const;
    int integer(const std::string& name, size_t index = 0) const;
    std::vector<double> numbers(const std::string& name) const;
};

// An image that a clip has, rows from the top. The host hands it out as its members say.
struct Picture {
    ImageF pixels;
    int x = 0, y = 0;  // of the lower left corner, pixels
    std::string depth = "OfxBitDepthFloat";
    bool negative_rows = false;  // rows from the top in memory
    int padding = 0;             // bytes after each row
    std::string premultiplication = "OfxImageAlphaPremultiplied";
};
using Feed = std::function<std::optional<Picture>(double time)>;

struct ParameterObject {
    PropertyObject properties;
    // Values at a time: one or two numbers, or a text.
    std::function<std::array<double, 2>(double time)> numbers;
    std::string text;
};

struct EffectObject;
struct ClipObject {
    EffectObject* effect = nullptr;
    PropertyObject properties;
    Feed feed;
};

struct EffectObject {
    class Host* host = nullptr;
    PropertyObject properties;
    std::map<std::string, ParameterObject> parameters;
    std::vector<std::string> order;  // of the parameters
    std::map<std::string, ClipObject> clips;
    std::map<std::string, PropertyObject> described;  // clips of a descriptor
    std::string message_type, message;                // the persistent one
    int messages = 0;
    std::function<bool()> abort;
    Picture output;
    double scale_x = 1, scale_y = 1;
    std::string field = "OfxFieldNone";
    std::atomic<int> abort_asked = 0;
};

class Host {
  public:
    // Loads the library. `refused`: names of suites that the host does not have.
    explicit Host(std::set<std::string> refused = {});
    ~Host();
    Host(const Host&) = delete;

    int count() const { return count_; }
    OfxPlugin* plugin(int index) const { return get_(index); }
    OfxPlugin* plugin(const std::string& identifier) const;
    int act(OfxPlugin* plugin, const char* action, void* handle = nullptr,
            PropertyObject* in = nullptr, PropertyObject* out = nullptr);
    int load(OfxPlugin* plugin);
    // Load, describe, describe in context. Kept for later calls.
    const EffectObject& described(OfxPlugin* plugin,
                                  const std::string& context = "OfxImageEffectContextGeneral");

    void fault(const std::string& text);
    std::vector<std::string> faults() const;
    int images_out() const { return images_out_; }

    std::set<std::string> refused;
    PropertyObject properties;
    std::atomic<bool> may_set = false;  // values of parameters
    std::atomic<int> images_out_ = 0;

  private:
    void* library_ = nullptr;
    int count_ = 0;
    OfxPlugin* (*get_)(int) = nullptr;
    OfxHost entry_ = {};
    std::map<std::string, std::unique_ptr<EffectObject>> descriptions_;
    std::map<OfxPlugin*, int> loads_;
    mutable std::mutex mutex_;
    std::vector<std::string> faults_;
};

// An instance of an effect in a project of the size of its source.
class Node {
  public:
    Node(Host& host, const std::string& identifier, int width, int height,
         const std::string& context = "OfxImageEffectContextGeneral");
    ~Node();
    Node(const Node&) = delete;

    void set(const std::string& name, double value, double second = 0);
    void set(const std::string& name, const std::string& text);
    void animate(const std::string& name, std::function<double(double)> value);
    void choose(const std::string& name, const std::string& option);
    // An optional value: switches it on.
    void use(const std::string& name, double value, double second = 0);
    // The action of a change by the user.
    int changed(const std::string& name, double time = 1);
    void connect(const std::string& clip, Feed feed, double first = -1e9, double last = 1e9);
    void connect(const std::string& clip, Picture picture);

    int region_of_definition(double time, std::array<double, 4>& region);
    std::map<std::string, std::vector<double>> frames_needed(double time);
    std::map<std::string, std::vector<double>> regions_of_interest(double time);
    bool frame_varying();
    // The clip's name; empty: render.
    std::string identity(double time);
    // Renders `output`, a picture whose pixels are written, in the whole of it or in a window of
    // it.
    int render(double time);
    int render(double time, std::array<int, 4> window);
    ImageF rendered(double time);  // a failure fails the test

    EffectObject& object() { return *object_; }
    std::string status() const { return object_->parameters.at("status").text; }
    std::string message() const { return object_->message; }

  private:
    void in(PropertyObject& in, double time) const;
    Host& host_;
    OfxPlugin* plugin_;
    std::unique_ptr<EffectObject> object_;
};

// Pixels of a plane with `channels` channels, made from others: -1 is 0.
ImageF arranged(const ImageF& from, const std::vector<int>& channels);
// Planes joined into one image of four channels.
ImageF joined(const ImageF& first, const ImageF& second);

}  // namespace postchain::openfx::test
