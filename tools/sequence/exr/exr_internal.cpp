#include "tools/sequence/exr/exr_internal.h"

#include <ImfBoxAttribute.h>
#include <ImfChannelList.h>
#include <ImfChannelListAttribute.h>
#include <ImfChromaticitiesAttribute.h>
#include <ImfCompressionAttribute.h>
#include <ImfDoubleAttribute.h>
#include <ImfFloatAttribute.h>
#include <ImfIntAttribute.h>
#include <ImfLineOrderAttribute.h>
#include <ImfMatrixAttribute.h>
#include <ImfPreviewImageAttribute.h>
#include <ImfRationalAttribute.h>
#include <ImfStringAttribute.h>
#include <ImfStringVectorAttribute.h>
#include <ImfTileDescriptionAttribute.h>
#include <ImfTimeCodeAttribute.h>
#include <ImfVecAttribute.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <new>
#include <stdexcept>

#include "chain/base/status.h"
#include "chain/base/text.h"
#include "tools/sequence/exr/exr_settings.h"

namespace postchain::io {
namespace {

PixelType pixel_type(Imf::PixelType type) {
    return type == Imf::HALF    ? PixelType::half
           : type == Imf::FLOAT ? PixelType::float32
                                : PixelType::uint32;
}

}  // namespace

Imf::PixelType imf_type(PixelType type) {
    return type == PixelType::half      ? Imf::HALF
           : type == PixelType::float32 ? Imf::FLOAT
                                        : Imf::UINT;
}

std::vector<ExrChannel> channels_in(const Imf::Header& header) {
    std::vector<ExrChannel> list;
    const Imf::ChannelList& channels = header.channels();
    for (auto it = channels.begin(); it != channels.end(); ++it) {
        const Imf::Channel& c = it.channel();
        list.push_back({it.name(), pixel_type(c.type), c.xSampling, c.ySampling});
    }
    return list;
}

PartPlanes planes_of(const PartPixels& pixels) {
    PartPlanes part{pixels.window, {}};
    for (const PartPixels::Plane& plane : pixels.planes) part.planes.push_back(&plane);
    return part;
}

Imf::FrameBuffer frame_buffer_of(const PartPlanes& part) {
    Imf::FrameBuffer buffer;
    for (const PartPixels::Plane* plane : part.planes) {
        const ExrChannel& c = plane->channel;
        buffer.insert(c.name, Imf::Slice::Make(imf_type(c.type), plane->bytes.get(),
                                               box_of(part.window), size_t(bytes_of(c.type)),
                                               plane->row_bytes(), c.x_sampling, c.y_sampling));
    }
    return buffer;
}

Status status_of_exr_exception(StatusCode code, const std::string& place,
                               const std::string& fault) try {
    const char* remedy = code == StatusCode::input ? "; copy or render it again" : "";
    try {
        throw;
    } catch (const std::bad_alloc&) {
        return out_of_memory(place);
    } catch (const std::exception& e) {
        std::string what = e.what();
        // OpenEXR's threads pass on only the message of an exception.
        for (const char* said :
             {"bad_alloc", "Failed to allocate memory", "Cannot allocate memory"})
            if (what.find(said) != std::string::npos) return out_of_memory(place);
        std::replace(what.begin(), what.end(), '\n', ' ');
        return Status(code, concat(place, ": ", fault, what, remedy));
    } catch (...) {
        return Status(code, concat(place, ": ", fault, "unknown failure inside OpenEXR", remedy));
    }
} catch (...) {
    return out_of_memory(place);
}

namespace {

constexpr size_t kStreamBuffer = size_t(256) << 10;

}  // namespace

void FdIStream::take(int fd, uint64_t size) {
    fd_ = fd;
    size_ = size;
}

FdIStream::~FdIStream() {
    if (fd_ >= 0) ::close(fd_);
}

bool FdIStream::read(char* to, int count) {
    // OpenEXR 3.1 passes on the stored size of a copied tile without checking its sign.
    if (count < 0) throw std::runtime_error("a chunk of negative size");
    size_t left = size_t(count);
    while (left > 0) {
        if (position_ >= start_ && position_ < start_ + buffer_.size()) {
            const size_t offset = size_t(position_ - start_);
            const size_t n = std::min(left, buffer_.size() - offset);
            std::memcpy(to, buffer_.data() + offset, n);
            to += n;
            left -= n;
            position_ += n;
            continue;
        }
        const bool direct = left >= kStreamBuffer;
        if (!direct) buffer_.resize(kStreamBuffer);
        ssize_t n;
        do {
            n = ::pread(fd_, direct ? to : buffer_.data(), direct ? left : buffer_.size(),
                        off_t(position_));
        } while (n < 0 && errno == EINTR);
        if (n <= 0) {
            buffer_.clear();
            throw std::runtime_error(n < 0 ? std::strerror(errno) : "the file ends too early");
        }
        if (direct) {
            to += n;
            left -= size_t(n);
            position_ += uint64_t(n);
        } else {
            buffer_.resize(size_t(n));
            start_ = position_;
        }
    }
    return position_ < size_;
}

void AtomicOStream::write(const char* from, int count) {
    if (Status s = file_.write(from, size_t(count)); !s.ok()) {
        status = s;
        throw std::runtime_error(s.message());
    }
}

void AtomicOStream::seekp(uint64_t position) {
    if (Status s = file_.seek(position); !s.ok()) {
        status = s;
        throw std::runtime_error(s.message());
    }
}

namespace {

// Null if the attribute has another type.
template <class Value>
const Value* value_as(const Imf::Attribute& attribute) {
    const auto* typed = dynamic_cast<const Imf::TypedAttribute<Value>*>(&attribute);
    return typed == nullptr ? nullptr : &typed->value();
}

std::string two_digits(int n) {
    return concat(n < 10 ? "0" : "", n);
}

}  // namespace

const char* compression_name(Imf::Compression compression) {
    const bool known = compression >= Imf::NO_COMPRESSION && compression <= Imf::DWAB_COMPRESSION;
    return known ? name_of(ExrMethod(compression)) : "unknown";
}

std::string attribute_text(const Imf::Attribute& a) {
    // The shortest text that reads back as the same number.
    const auto number = [](auto v) {
        char text[64];
        return std::string(text, std::to_chars(text, text + sizeof text, v).ptr);
    };
    const auto vec2 = [&](const auto& v) { return number(v.x) + " " + number(v.y); };
    const auto vec3 = [](const auto& v) { return concat(v.x, " ", v.y, " ", v.z); };
    const auto box = [](const auto& b) {
        return concat("(", b.min.x, ", ", b.min.y, ")-(", b.max.x, ", ", b.max.y, ")");
    };
    const auto matrix = [&](const auto& m) {
        std::string text;
        constexpr int n = int(sizeof(m.x) / sizeof(m.x[0]));
        for (int i = 0; i < n; ++i) {
            for (int j = 0; j < n; ++j) text += (text.empty() ? "" : " ") + number(m.x[i][j]);
        }
        return text;
    };
    if (const auto* text = value_as<std::string>(a)) return *text;
    if (const auto* v = value_as<float>(a)) return number(*v);
    if (const auto* v = value_as<int>(a)) return number(*v);
    if (const auto* v = value_as<double>(a)) return number(*v);
    if (const auto* v = value_as<IMATH_NAMESPACE::V2i>(a)) return vec2(*v);
    if (const auto* v = value_as<IMATH_NAMESPACE::V2f>(a)) return vec2(*v);
    if (const auto* v = value_as<IMATH_NAMESPACE::V2d>(a)) return vec2(*v);
    if (const auto* v = value_as<IMATH_NAMESPACE::V3i>(a)) return vec3(*v);
    if (const auto* v = value_as<IMATH_NAMESPACE::V3f>(a)) return vec3(*v);
    if (const auto* v = value_as<IMATH_NAMESPACE::V3d>(a)) return vec3(*v);
    if (const auto* b = value_as<IMATH_NAMESPACE::Box2i>(a)) return box(*b);
    if (const auto* b = value_as<IMATH_NAMESPACE::Box2f>(a)) return box(*b);
    if (const auto* m = value_as<IMATH_NAMESPACE::M33f>(a)) return matrix(*m);
    if (const auto* m = value_as<IMATH_NAMESPACE::M44f>(a)) return matrix(*m);
    if (const auto* r = value_as<Imf::Rational>(a)) return concat(r->n, "/", r->d);
    if (const auto* c = value_as<Imf::TimeCode>(a))
        return concat(two_digits(c->hours()), ":", two_digits(c->minutes()), ":",
                      two_digits(c->seconds()), c->dropFrame() ? ";" : ":", two_digits(c->frame()));
    if (const auto* c = value_as<Imf::Chromaticities>(a))
        return concat("red ", c->red.x, " ", c->red.y, ", green ", c->green.x, " ", c->green.y,
                      ", blue ", c->blue.x, " ", c->blue.y, ", white ", c->white.x, " ",
                      c->white.y);
    if (const auto* c = value_as<Imf::Compression>(a)) return compression_name(*c);
    if (const auto* order = value_as<Imf::LineOrder>(a))
        return *order == Imf::INCREASING_Y   ? "increasing y"
               : *order == Imf::DECREASING_Y ? "decreasing y"
                                             : "random y";
    if (const auto* d = value_as<Imf::TileDescription>(a))
        return concat(d->xSize, "x", d->ySize,
                      d->mode == Imf::ONE_LEVEL       ? " one level"
                      : d->mode == Imf::MIPMAP_LEVELS ? " mip-map"
                                                      : " rip-map");
    if (const auto* p = value_as<Imf::PreviewImage>(a))
        return concat("(", p->width(), "x", p->height(), " preview)");
    if (const auto* words = value_as<Imf::StringVector>(a)) return joined(*words);
    if (const auto* list = value_as<Imf::ChannelList>(a)) {
        std::vector<std::string> names;
        for (auto it = list->begin(); it != list->end(); ++it) names.emplace_back(it.name());
        return joined(names);
    }
    return concat("(", a.typeName(), ")");
}

}  // namespace postchain::io
