// Writes the EXR files of corpus/exr: make_exr_seeds FOLDER. Every compression, tiles and levels,
// several parts, views, deep and subsampled channels, a few pixels each.
#include <ImfMultiView.h>
#include <ImfStandardAttributes.h>

#include <cstdio>

#include "../io/exr_files.h"

namespace postchain::test {
namespace {

const std::vector<FileChannel> kColor = {{"R"}, {"G"}, {"B"}, {"A"}};

void write_seeds(const std::string& folder) {
    const auto write = [&folder](const std::string& name, const std::vector<FilePart>& parts) {
        write_file(folder + "/valid_" + name + ".exr", parts);
    };
    constexpr const char* kCompressions[] = {"none",  "rle", "zips", "zip",  "piz",
                                             "pxr24", "b44", "b44a", "dwaa", "dwab"};
    for (int i = 0; i < Imf::NUM_COMPRESSION_METHODS; ++i) {
        const auto compression = Imf::Compression(i);
        write(kCompressions[i], {{.channels = kColor, .compression = compression}});
        write(std::string(kCompressions[i]) + "_tiled",
              {{.channels = {{"R"}, {"Z", Imf::FLOAT}, {"id", Imf::UINT}},
                .compression = compression,
                .tile = 8}});
    }
    write("mipmap", {{.channels = kColor, .tile = 4, .levels = Imf::MIPMAP_LEVELS}});
    write("ripmap", {{.channels = kColor, .tile = 4, .levels = Imf::RIPMAP_LEVELS}});
    write("subsampled", {{.channels = {{"Y"}, {"RY", Imf::HALF, 2}, {"BY", Imf::HALF, 2}},
                          .data = {{0, 0}, {11, 7}}}});
    write("bottom_up", {{.channels = kColor, .line_order = Imf::DECREASING_Y}});
    write("crop", {{.channels = {{"Z", Imf::FLOAT}, {"R"}, {"G"}, {"B"}},
                    .data = {{-3, 5}, {6, 9}},
                    .special_values = true}});
    write("parts", {{.name = "color", .channels = kColor},
                    {.name = "depth", .channels = {{"Z", Imf::FLOAT}}, .tile = 8},
                    {.name = "deep",
                     .channels = {{"Z", Imf::FLOAT}},
                     .compression = Imf::ZIPS_COMPRESSION,
                     .deep = true}});
    for (int i = 0; i < 3; ++i)
        for (const int tile : {0, 4})
            write(std::string("deep_") + kCompressions[i] + (tile ? "_tiled" : ""),
                  {{.channels = {{"R"},
                                 {"G"},
                                 {"B"},
                                 {"A"},
                                 {"Z", Imf::FLOAT},
                                 {"ZBack", Imf::FLOAT},
                                 {"id", Imf::UINT}},
                    .compression = Imf::Compression(i),
                    .tile = tile,
                    .deep = true,
                    .samples = [](int x, int y, size_t channel) {
                        std::vector<float> values;
                        for (int s = 0; s < (x + y) % 4; ++s)
                            values.push_back(channel > 3 ? float(2 + s + (channel == 5)) : 0.5F);
                        return values;
                    }}});
    write("cycles", {{.channels = {{"ViewLayer.Combined.R"},
                                   {"ViewLayer.Combined.G"},
                                   {"ViewLayer.Combined.B"},
                                   {"ViewLayer.Depth.Z", Imf::FLOAT},
                                   {"ViewLayer.Vector.X", Imf::FLOAT},
                                   {"ViewLayer.Vector.Y", Imf::FLOAT},
                                   {"ViewLayer.Vector.Z", Imf::FLOAT},
                                   {"ViewLayer.Vector.W", Imf::FLOAT}}}});
    write("views", {{.channels = {{"R"}, {"G"}, {"B"}, {"left.R"}, {"left.G"}, {"left.B"}},
                     .edit = [](Imf::Header& header) {
                         Imf::addMultiView(header, {"right", "left"});
                         Imf::addChromaticities(header, Imf::Chromaticities());
                         Imf::addAperture(header, 2.8F);
                         Imf::addFocus(header, 3);
                         Imf::addTimeCode(header, Imf::TimeCode(1, 2, 3, 4));
                     }}});
}

}  // namespace
}  // namespace postchain::test

int main(int count, char** arguments) {
    if (count != 2) {
        std::fprintf(stderr, "usage: make_exr_seeds FOLDER\n");
        return 2;
    }
    postchain::test::write_seeds(arguments[1]);
    return 0;
}
