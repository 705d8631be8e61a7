#include "tools/sequence/exr/exr_attributes.h"

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

#include <charconv>
#include <optional>

#include "chain/status.h"
#include "tools/sequence/exr/exr_compression.h"

namespace postchain::io {

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
                    for (auto it = list.begin(); it != list.end(); ++it) {
                        text += concat(text.empty() ? "" : ", ", it.name());
                    }
                    return text;
                });
            });
    return t ? *t : concat("(", a.typeName(), ")");
}

}  // namespace postchain::io
