#include "tools/sequence/image/image_writer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/sequence/image/image_file.h"

namespace postchain::io {
namespace {

// OpenImageIO's name.
std::string color_space_of(Curve curve) {
    switch (curve) {
        case Curve::linear:
            return "Linear";
        case Curve::srgb:
            return "sRGB";
        case Curve::rec709:
            return "Rec709";
        case Curve::gamma22:
            return "GammaCorrected2.2";
        case Curve::cineon:
            return "KodakLog";
    }
    return "";
}

struct Encoded {
    std::vector<uint16_t> codes;  // spread over 16 bits
    std::vector<float> values;
    uint64_t outside = 0;    // pixels that the format cannot hold, with non-finite ones
    uint64_t nonfinite = 0;  // non-finite pixels
    bool has_alpha = false;  // alpha differs from 1 in some pixel
};

// A code of `bits` bits in the upper bits of 16, repeated below; encoders shift it back down.
uint16_t spread(uint32_t code, int bits) {
    uint32_t wide = code << (16 - bits);
    for (int shift = bits; shift < 16; shift += bits) wide |= wide >> shift;
    return uint16_t(wide);
}

// Color converted by a configuration of OpenColorIO; empty for a curve.
Result<ImageF> converted(const ImageF& color, const Transfer& transfer) {
    if (std::holds_alternative<Curve>(transfer)) return ImageF();
    ASSIGN_OR_RETURN(const auto calls, image_module(StatusCode::output));
    constexpr float kMax = 65504;  // largest half; leaves headroom for transforms
    ImageF stored = color;
    for (float& v : stored.data)
        if (!std::isfinite(v)) v = std::isnan(v) ? 0 : std::copysign(kMax, v);
    const auto* space = std::get_if<OcioSpace>(&transfer);
    RETURN_IF_ERROR(space ? calls->to_space(stored, *space)
                          : calls->to_view(stored, std::get<DisplayView>(transfer)));
    return stored;
}

// `stored_color`: from converted(); not used with a curve.
Encoded encode_pixels(const ImageF& color, const ImageF& stored_color,
                      const ImageEncoding& encoding) {
    Encoded out;
    const auto* curve = std::get_if<Curve>(&encoding.transfer);
    const int channels = encoding.alpha ? 4 : 3;
    const bool is_float = ImageFormat::is_float(encoding.bits);
    const double largest =
        is_float ? double(std::numeric_limits<float>::max()) : double((1 << encoding.bits) - 1);
    // The largest value of Radiance's shared exponent is just below 2^127.
    const double high =
        std::string_view(encoding.format->name) == "hdr" ? std::ldexp(255.0 / 256, 127) : largest;
    const double low = !is_float || !encoding.format->has_sign() ? 0 : -largest;
    const size_t count = color.pixels() * size_t(channels);
    if (is_float)
        out.values.resize(count);
    else
        out.codes.resize(count);
    size_t at = 0;
    for (size_t pixel = 0; pixel < color.pixels(); ++pixel) {
        const float* rgba = color.data.data() + 4 * pixel;
        bool outside = false, nonfinite = false;
        out.has_alpha |= rgba[3] != 1;
        for (int c = 0; c < channels; ++c, ++at) {
            const double light = double(rgba[c]);
            double stored = c == 3  ? light
                            : curve ? encode(*curve, light)
                                    : double(stored_color.data[4 * pixel + size_t(c)]);
            if (!is_float) stored = std::round(stored * largest);
            nonfinite |= !std::isfinite(rgba[c]);
            if (std::isnan(stored)) {
                outside = true;
                stored = std::isnan(light) ? 0 : low;
            } else if (stored < low || stored > high) {
                outside = true;
                stored = std::clamp(stored, low, high);
            }
            if (is_float)
                out.values[at] = float(stored);
            else
                out.codes[at] = spread(uint32_t(stored), encoding.bits);
        }
        out.outside += outside;
        out.nonfinite += nonfinite;
    }
    return out;
}

std::string range_text(const ImageEncoding& encoding) {
    if (!ImageFormat::is_float(encoding.bits)) return concat(encoding.bits, " bits hold 0 to 1");
    return encoding.format->has_sign() ? "float holds finite values"
                                       : "it holds no negative values";
}

// Keeps the input's compression if it fits the output, and notes a lost color profile.
void keep_stated(const ImageFile& input, ImageEncoding& encoding) {
    static constexpr std::string_view kLossless[] = {"none", "lzw", "zip", "packbits"};
    const auto& stated = input.info().attributes;
    if (!encoding.same_transfer && stated.count("ICCProfile"))
        encoding.notes.push_back("the ICC profile is left out: it is of the input's transfer");
    const auto packed = stated.find("compression");
    if (&input.format() != encoding.format || std::string_view(encoding.format->name) != "tiff" ||
        packed == stated.end())
        return;
    if (std::find(std::begin(kLossless), std::end(kLossless), packed->second) !=
        std::end(kLossless))
        encoding.compression = packed->second;
    else
        encoding.notes.push_back(
            concat("packed with zip, not with ", packed->second, " as the input is"));
}

}  // namespace

Result<ImageEncoding> image_encoding(const std::string& path, const PixelFile& color_file,
                                     size_t color_channels, const ImageSettings& settings) {
    ImageEncoding encoding;
    encoding.format = image_format_of(path);
    if (!encoding.format)
        return Status(StatusCode::internal, path + ": not the name of an image file");
    const ImageFormat& format = *encoding.format;
    const ImageFile* input = picture_of(color_file);
    const bool same_format = input && &input->format() == &format;
    encoding.bits = settings.bits != 0 ? settings.bits
                    : input && (same_format || !ImageFormat::is_float(input->info().bits)) &&
                            format.can_have(input->info().bits)
                        ? input->info().bits
                        : format.bits[0];
    if (!format.can_have(encoding.bits)) {
        std::string known;
        for (const int bits : format.bits) known += concat(known.empty() ? "" : ", ", bits);
        return Status(StatusCode::usage,
                      concat(path, ": ", format.name, " has ", known, " bits, not ", encoding.bits,
                             "; change {bits}"_keyed));
    }
    const bool is_float = ImageFormat::is_float(encoding.bits);
    encoding.alpha = format.alpha && color_channels == 4;
    encoding.unassociated = encoding.alpha && (std::string_view(format.name) == "png" ||
                                               (same_format && input->info().unassociated));
    encoding.transfer = settings.transfer ? *settings.transfer
                        : input && input->info().is_float == is_float
                            ? input->transfer()
                            : (is_float ? Curve::linear : Curve::srgb);
    encoding.same_transfer = !input || input->transfer() == encoding.transfer;
    if (const auto* curve = std::get_if<Curve>(&encoding.transfer)) {
        encoding.color_space = color_space_of(*curve);
        if (!format.tells(*curve, encoding.bits))
            encoding.notes.push_back(concat("a ", format.name, " does not say that its values are ",
                                            name_of(*curve), "; read it with ",
                                            setting("input_transfer", name_of(*curve))));
    } else if (input && encoding.same_transfer) {
        encoding.color_space = input->info().color_space;
    }
    if (input) keep_stated(*input, encoding);
    return encoding;
}

Result<WriteReport> write_picture(const std::string& path, const ImageF& color,
                                  const ImageEncoding& encoding, const std::string& metadata_of,
                                  int metadata_part, const WriteOptions& options) try {
    ASSIGN_OR_RETURN(const auto calls, image_module(StatusCode::output));
    ASSIGN_OR_RETURN(const auto stored, converted(color, encoding.transfer));
    const Encoded encoded = encode_pixels(color, stored, encoding);
    if (encoded.outside > 0 && options.overflow == HalfOverflow::refuse)
        return Status(
            StatusCode::output,
            concat(path, ": ", encoded.outside, " pixels do not fit (", range_text(encoding), "), ",
                   encoded.nonfinite,
                   " of them not finite; clamp them ({overflow=clamp}), or write a format "
                   "that holds them (.exr, .tif of 32 bits)"_keyed));
    WriteReport report;
    report.notes = encoding.notes;
    report.overflow_pixels = encoded.outside - encoded.nonfinite;
    report.nonfinite_pixels = encoded.nonfinite;
    if (encoded.has_alpha && !encoding.alpha && !encoding.format->alpha)
        report.notes.push_back(concat("alpha left out: ", encoding.format->name, " has none"));
    ImageToWrite picture;
    picture.info.format = encoding.format->name;
    picture.info.width = picture.info.display_width = color.width;
    picture.info.height = picture.info.display_height = color.height;
    picture.info.pixel_aspect = encoding.pixel_aspect;
    picture.info.channels = encoding.alpha ? 4 : 3;
    picture.info.bits = encoding.bits;
    picture.info.is_float = ImageFormat::is_float(encoding.bits);
    picture.info.unassociated = encoding.unassociated;
    picture.info.color_space = encoding.color_space;
    picture.values = picture.info.is_float ? static_cast<const void*>(encoded.values.data())
                                           : static_cast<const void*>(encoded.codes.data());
    picture.metadata_of = metadata_of;
    picture.metadata_part = metadata_part;
    picture.same_transfer = encoding.same_transfer;
    picture.compression = encoding.compression;
    picture.attributes = options.attributes;
    ASSIGN_OR_RETURN(const auto bytes, calls->encode(picture).at(path));
    ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::create(path));
    RETURN_IF_ERROR(file.write(bytes.data(), bytes.size()));
    report.bytes = bytes.size();
    if (options.before_commit) RETURN_IF_ERROR(options.before_commit());
    RETURN_IF_ERROR(file.commit(options.on_existing).status());
    return report;
} catch (...) {
    return status_of_exception(path);
}

}  // namespace postchain::io
