#include "tools/sequence/image/image_file.h"

#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "chain/base/readable_file.h"
#include "chain/base/text.h"

namespace postchain::io {

bool ImageFormat::has_sign() const {
    return std::string_view(name) != "hdr";
}

bool ImageFormat::can_have(int bits_of_value) const {
    return std::find(bits.begin(), bits.end(), bits_of_value) != bits.end();
}

bool ImageFormat::tells(Curve curve, int bits_of_value) const {
    return curve == (is_float(bits_of_value) ? Curve::linear : Curve::srgb) ||
           std::find(stated.begin(), stated.end(), curve) != stated.end();
}

const std::vector<ImageFormat>& image_formats() {
    static const std::vector<ImageFormat> formats = {
        {"png",
         {".png"},
         {16, 8},
         true,
         false,
         {Curve::linear, Curve::rec709, Curve::gamma22, Curve::cineon}},
        {"tiff", {".tif", ".tiff"}, {32, 16, 8}, true, false, {}},
        {"dpx",
         {".dpx"},
         {10, 8, 12, 16},
         true,
         false,
         {Curve::linear, Curve::rec709, Curve::cineon}},
        {"jpeg", {".jpg", ".jpeg"}, {8}, false, true, {}},
        {"hdr", {".hdr"}, {32}, false, true, {}},
    };
    return formats;
}

const ImageFormat* image_format_of(std::string_view path) {
    const std::string extension = lower_case(std::filesystem::path(path).extension().string());
    for (const ImageFormat& format : image_formats())
        for (const char* known : format.extensions)
            if (extension == known) return &format;
    return nullptr;
}

std::string image_extensions() {
    std::string text;
    for (const ImageFormat& format : image_formats())
        for (const char* extension : format.extensions)
            text += (text.empty() ? "" : ", ") + std::string(extension);
    return text;
}

namespace {

constexpr const char* kFile = "libpostchain_images.so";

// The module, or why it could not be loaded.
struct Module {
    const ImageCalls* calls;
    std::string fault;
};

Module load() {
    // Lazy binding: most of OpenImageIO's functions are never called.
    void* module = dlopen(kFile, RTLD_LAZY | RTLD_LOCAL);
    if (!module) return {nullptr, dlerror()};
    const auto calls =
        reinterpret_cast<decltype(&postchain_image_calls)>(dlsym(module, "postchain_image_calls"));
    if (!calls) return {nullptr, dlerror()};
    if (std::strcmp(calls()->version, POSTCHAIN_VERSION) != 0)
        return {nullptr, concat(kFile, " is of version ", calls()->version, ", this program of ",
                                POSTCHAIN_VERSION)};
    return {calls(), ""};
}

// The curve that the file states, by OpenImageIO's names; `lin_` since its version 2.5.
Result<Curve> stated_curve(const ImageInfo& info) {
    const std::string said = lower_case(info.color_space);
    for (const char* linear : {"linear", "scene_linear", "lin_srgb", "lin_rec709"})
        if (said == linear) return Curve::linear;
    if (said == "srgb") return Curve::srgb;
    if (said == "rec709") return Curve::rec709;
    if (said == "kodaklog") return Curve::cineon;
    if (said == "gamma2.2" || said == "gammacorrected2.2") return Curve::gamma22;
    if (said.empty()) return info.is_float ? Curve::linear : Curve::srgb;
    return Status(StatusCode::input, concat("says that its values are ", info.color_space,
                                            "; state the transfer with {input_transfer}"_keyed));
}

// The light for each stored integer.
std::vector<float> decoded_codes(Curve curve, int bits) {
    const int largest = (1 << bits) - 1;
    std::vector<float> light(size_t(largest) + 1);
    for (int code = 0; code <= largest; ++code)
        light[size_t(code)] = float(decode(curve, double(code) / largest));
    return light;
}

// Converts from a color space to the frames' space. Non-finite values stay unchanged.
Status decode_space(const ImageCalls& calls, const OcioSpace& space, ImageF& stored) {
    std::vector<std::pair<size_t, float>> nonfinite;
    for (size_t i = 0; i < stored.data.size(); ++i)
        if (float& value = stored.data[i]; !std::isfinite(value)) {
            nonfinite.emplace_back(i, value);
            value = 0;
        }
    Status status = calls.from_space(stored, space);
    for (const auto& [i, value] : nonfinite) stored.data[i] = value;
    return status;
}

}  // namespace

Result<const ImageCalls*> image_module(StatusCode code) {
    static const Module module = load();
    if (module.calls) return module.calls;
    return Status(code, concat("formats other than EXR need the module ", kFile,
                               " of postchain, which cannot be loaded: ", module.fault,
                               "; install postchain as a whole, and OpenImageIO"));
}

Result<ImageFile> ImageFile::open(const std::string& path, const ReadLimits& limits,
                                  std::optional<Transfer> transfer) try {
    const ReadableFile opened(path);
    if (!opened.ok())
        return Status(StatusCode::input, path + ": " +
                                             (opened.error() == ENOENT ? std::string("no such file")
                                                                       : opened.fault()));
    ASSIGN_OR_RETURN(const auto calls, image_module(StatusCode::input).at(path));
    ImageFile file;
    file.path_ = path;
    file.bytes_ = opened.bytes();
    file.format_ = image_format_of(path);
    ASSIGN_OR_RETURN(file.info_, calls->describe(opened.path(), file.format_->name).at(path));
    const ImageInfo& i = file.info_;
    for (const int side : {i.width, i.height, i.display_width, i.display_height})
        if (side < 1 || side > limits.max_side)
            return Status(StatusCode::input,
                          concat(path, ": ", i.width, "x", i.height, " pixels; at most ",
                                 limits.max_side, " a side are read"));
    if (uint64_t(i.width) * uint64_t(i.height) * uint64_t(i.channels) * sizeof(float) >
        limits.max_bytes)
        return Status(StatusCode::input,
                      concat(path, ": ", i.width, "x", i.height,
                             " pixels are more than are read; write it smaller"));
    if (transfer) {
        file.transfer_ = *transfer;
    } else {
        ASSIGN_OR_RETURN(file.transfer_, stated_curve(i).at(path));
    }
    // Reports an unusable configuration before pixels are decoded.
    if (const auto* space = std::get_if<OcioSpace>(&file.transfer_)) {
        ImageF pixel(1, 1, 3);
        RETURN_IF_ERROR(calls->from_space(pixel, *space));
    }
    file.parts_ = {file.part()};
    return file;
} catch (...) {
    return status_of_exception(path);
}

ExrPart ImageFile::part() const {
    ExrPart part;
    part.type = format_->name;
    part.compression = format_->name;
    for (int c = 0; c < info_.channels; ++c)
        part.channels.push_back({std::string(1, "RGBA"[c]), PixelType::float32});
    part.data_window = {info_.x, info_.y, info_.x + info_.width - 1, info_.y + info_.height - 1};
    part.display_window = {info_.display_x, info_.display_y,
                           info_.display_x + info_.display_width - 1,
                           info_.display_y + info_.display_height - 1};
    part.pixel_aspect = info_.pixel_aspect;
    part.attributes = info_.attributes;
    return part;
}

Status ImageFile::read_planes(PartPixels& pixels) {
    const auto* space = std::get_if<OcioSpace>(&transfer_);
    const Curve curve = space ? Curve::linear : std::get<Curve>(transfer_);
    if (!stored_) {
        ASSIGN_OR_RETURN(const auto calls, image_module(StatusCode::input).at(path_));
        const ReadableFile opened(path_);
        if (!opened.ok()) return Status(StatusCode::input, path_ + ": " + opened.fault());
        ASSIGN_OR_RETURN(auto stored, calls->read_stored(opened.path(), info_).at(path_));
        if (space) RETURN_IF_ERROR(decode_space(*calls, *space, stored));
        stored_ = std::make_shared<const ImageF>(std::move(stored));
    }
    const ImageF& stored = *stored_;
    const Window whole = parts()[0].data_window;
    const int largest = (1 << std::min(info_.bits, 16)) - 1;
    std::vector<float> codes;
    if (!info_.is_float && !space) codes = decoded_codes(curve, info_.bits);
    for (PartPixels::Plane& plane : pixels.planes) {
        const int channel = int(std::string_view("RGBA").find(plane.channel.name));
        auto* values = reinterpret_cast<float*>(plane.bytes.get());
        for (int y = pixels.window.min_y; y <= pixels.window.max_y; ++y) {
            const float* row = stored.pixel(0, y - whole.min_y) + channel;
            for (int x = 0; x < stored.width; ++x, ++values) {
                const float value = row[size_t(x) * size_t(stored.channels)];
                if (channel == 3 || space || (info_.is_float && curve == Curve::linear))
                    *values = value;
                else if (info_.is_float)
                    *values = float(decode(curve, double(value)));
                else
                    *values = codes[size_t(std::lround(value * float(largest)))];
            }
        }
    }
    // Consecutive rows are read from one decoded image; it is freed after a read of the whole
    // image.
    if (pixels.window == whole) stored_.reset();
    return {};
}

}  // namespace postchain::io
