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
#include <optional>
#include <stdexcept>

#include "chain/base/status.h"
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
        return Status(code, concat(place, ": ", fault, what));
    } catch (...) {
        return Status(code, concat(place, ": ", fault, "unknown failure inside OpenEXR"));
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

template <class Value, class Text>
std::optional<std::string> text_as(const Imf::Attribute& attribute, Text text) {
    const auto* typed = dynamic_cast<const Imf::TypedAttribute<Value>*>(&attribute);
    if (typed == nullptr) return {};
    return text(typed->value());
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
    std::optional<std::string> t;
    const auto try_all = [&](auto... tries) { (... || (t = tries()).has_value()); };
    try_all([&] { return text_as<std::string>(a, [](const std::string& s) { return s; }); },
            [&] { return text_as<float>(a, number); }, [&] { return text_as<int>(a, number); },
            [&] { return text_as<double>(a, number); },
            [&] { return text_as<IMATH_NAMESPACE::V2i>(a, vec2); },
            [&] { return text_as<IMATH_NAMESPACE::V2f>(a, vec2); },
            [&] { return text_as<IMATH_NAMESPACE::V2d>(a, vec2); },
            [&] { return text_as<IMATH_NAMESPACE::V3i>(a, vec3); },
            [&] { return text_as<IMATH_NAMESPACE::V3f>(a, vec3); },
            [&] { return text_as<IMATH_NAMESPACE::V3d>(a, vec3); },
            [&] { return text_as<IMATH_NAMESPACE::Box2i>(a, box); },
            [&] { return text_as<IMATH_NAMESPACE::Box2f>(a, box); },
            [&] { return text_as<IMATH_NAMESPACE::M33f>(a, matrix); },
            [&] { return text_as<IMATH_NAMESPACE::M44f>(a, matrix); },
            [&] {
                return text_as<Imf::Rational>(
                    a, [](Imf::Rational r) { return concat(r.n, "/", r.d); });
            },
            [&] {
                return text_as<Imf::TimeCode>(a, [](const Imf::TimeCode& c) {
                    return concat(two_digits(c.hours()), ":", two_digits(c.minutes()), ":",
                                  two_digits(c.seconds()), c.dropFrame() ? ";" : ":",
                                  two_digits(c.frame()));
                });
            },
            [&] {
                return text_as<Imf::Chromaticities>(a, [](const Imf::Chromaticities& c) {
                    return concat("red ", c.red.x, " ", c.red.y, ", green ", c.green.x, " ",
                                  c.green.y, ", blue ", c.blue.x, " ", c.blue.y, ", white ",
                                  c.white.x, " ", c.white.y);
                });
            },
            [&] {
                return text_as<Imf::Compression>(
                    a, [](Imf::Compression c) { return std::string(compression_name(c)); });
            },
            [&] {
                return text_as<Imf::LineOrder>(a, [](Imf::LineOrder o) {
                    return std::string(o == Imf::INCREASING_Y   ? "increasing y"
                                       : o == Imf::DECREASING_Y ? "decreasing y"
                                                                : "random y");
                });
            },
            [&] {
                return text_as<Imf::TileDescription>(a, [](const Imf::TileDescription& d) {
                    return concat(d.xSize, "x", d.ySize,
                                  d.mode == Imf::ONE_LEVEL       ? " one level"
                                  : d.mode == Imf::MIPMAP_LEVELS ? " mip-map"
                                                                 : " rip-map");
                });
            },
            [&] {
                return text_as<Imf::PreviewImage>(a, [](const Imf::PreviewImage& p) {
                    return concat("(", p.width(), "x", p.height(), " preview)");
                });
            },
            [&] {
                return text_as<Imf::StringVector>(a, [](const Imf::StringVector& v) {
                    std::string text;
                    for (const std::string& s : v) text += (text.empty() ? "" : ", ") + s;
                    return text;
                });
            },
            [&] {
                return text_as<Imf::ChannelList>(a, [](const Imf::ChannelList& list) {
                    std::string text;
                    for (auto it = list.begin(); it != list.end(); ++it)
                        text += concat(text.empty() ? "" : ", ", it.name());
                    return text;
                });
            });
    return t ? *t : concat("(", a.typeName(), ")");
}

}  // namespace postchain::io
