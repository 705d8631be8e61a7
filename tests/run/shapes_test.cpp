// Files in shapes that other programs write, in combinations chosen by a seed: every compression,
// tiles and levels, any windows, parts and views beside color, some of them deep. Non-color data is
// preserved bit for bit, and empty outside the data window.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfMultiPartInputFile.h>
#include <ImfMultiView.h>
#include <ImfStandardAttributes.h>
#include <ImfTiledInputPart.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/io/exr_files.h"
#include "tools/sequence/planes/frame_writer.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain::sequence {
namespace {

using test::FilePart;

class Shape {
  public:
    explicit Shape(unsigned seed) : random_(seed) {
        FilePart main = flat_part(true);
        static const char* kLayers[] = {"", "ViewLayer.Combined.", "beauty."};
        const bool alone = below(2) == 0;
        layer_ = alone ? kLayers[below(3)] : "";  // parts are layers themselves
        main.channels = {{layer_ + "R", half_or_float()},
                         {layer_ + "G", half_or_float()},
                         {layer_ + "B", half_or_float()}};
        if (below(3)) main.channels.push_back({layer_ + "A", half_or_float()});
        if (below(2)) main.channels.push_back({"Z", Imf::FLOAT});
        if (below(2)) main.channels.push_back({"crypto00.R", Imf::FLOAT});
        if (below(2)) main.channels.push_back({"id", Imf::UINT});
        if (below(2)) main.channels.push_back({"mask", Imf::HALF});
        if (main.tile == 0 && below(4) == 0) {  // tiled parts have no subsampled channels
            main.channels.push_back({"small", Imf::HALF, 2});
            align(main.data);
        }
        if (layer_.empty() && below(4) == 0) {
            for (const char* name : {"right.R", "right.G", "right.B"})
                main.channels.push_back({name, Imf::HALF});
            main.edit = [](Imf::Header& h) { Imf::addMultiView(h, {"left", "right"}); };
            view = "left";
        }
        std::sort(main.channels.begin(), main.channels.end(),
                  [](const auto& a, const auto& b) { return a.name < b.name; });
        parts = {main};
        if (!alone) add_parts();
    }

    std::vector<FilePart> parts;
    size_t color = 0;
    std::string view;  // that of color, if there are several
    int below(int count) { return int(random_() % unsigned(count)); }

  private:
    Imf::PixelType half_or_float() { return below(2) ? Imf::HALF : Imf::FLOAT; }

    static void align(Imath::Box2i& box) {
        for (int i = 0; i < 2; ++i) {
            box.min[i] -= box.min[i] & 1;
            box.max[i] |= 1;
        }
    }

    FilePart flat_part(bool levels) {
        FilePart part;
        part.data.min = {below(40) - 20, below(40) - 20};
        part.data.max = {part.data.min.x + below(37), part.data.min.y + below(29)};
        part.display.min = {below(20) - 10, below(20) - 10};
        part.display.max = {part.display.min.x + below(50), part.display.min.y + below(50)};
        if (below(4) == 0) part.display = part.data;
        part.compression = Imf::Compression(below(int(Imf::NUM_COMPRESSION_METHODS)));
        part.line_order = below(2) ? Imf::INCREASING_Y : Imf::DECREASING_Y;
        if (below(2)) {
            static const int kTiles[] = {1, 5, 8, 16, 64};
            part.tile = kTiles[below(5)];
            part.line_order = Imf::INCREASING_Y;
            if (levels) part.levels = Imf::LevelMode(below(3));
        }
        return part;
    }

    void add_parts() {
        parts[0].name = "color";
        const int count = 1 + below(3);
        for (int i = 0; i < count; ++i) {
            FilePart part = flat_part(true);
            part.channels = {{"a", half_or_float()}, {"b", Imf::FLOAT}};
            if (below(3) == 0) {
                part.deep = true;
                part.channels = {{"A", Imf::FLOAT}, {"Z", Imf::FLOAT}};
                part.compression = below(2) ? Imf::ZIPS_COMPRESSION : Imf::NO_COMPRESSION;
                part.levels = Imf::ONE_LEVEL;
                part.line_order = Imf::INCREASING_Y;
            }
            part.name = concat("other", i, std::string(size_t(i), 'x'));
            part.display = parts[0].display;  // shared by all parts
            parts.push_back(part);
        }
        color = size_t(below(count + 1));
        std::swap(parts[0], parts[color]);
    }

    std::mt19937 random_;
    std::string layer_;
};

// Stored bytes of one channel, in rows of `window`; 0 where the file has no pixels.
std::vector<std::byte> samples_in(const std::string& path, int part, const std::string& channel,
                                  const io::Window& window) {
    auto file = io::ExrFile::open(path);
    EXPECT_TRUE(file.ok()) << file.status().message();
    auto pixels = file->read_part(part, {channel});
    EXPECT_TRUE(pixels.ok()) << pixels.status().message();
    const io::PartPixels placed = pixels->placed(window, {});
    const auto& plane = placed.planes[0];
    return {plane.bytes.get(), plane.bytes.get() + plane.total_bytes()};
}

// Every sample of every level of a tiled part, read by OpenEXR (OpenImageIO cannot read levels of
// windows with odd origins).
std::vector<char> all_levels(const std::string& path, int part) {
    Imf::MultiPartInputFile file(path.c_str());
    Imf::TiledInputPart in(file, part);
    std::vector<char> all;
    for (int ly = 0; ly < in.numYLevels(); ++ly) {
        for (int lx = 0; lx < in.numXLevels(); ++lx) {
            if (!in.isValidLevel(lx, ly)) continue;
            const Imath::Box2i window = in.dataWindowForLevel(lx, ly);
            const auto width = size_t(window.max.x - window.min.x + 1);
            const auto height = size_t(window.max.y - window.min.y + 1);
            const Imf::ChannelList& channels = in.header().channels();
            for (auto c = channels.begin(); c != channels.end(); ++c) {
                const size_t size = c.channel().type == Imf::HALF ? 2 : 4;
                std::vector<char> bytes(width * height * size);
                Imf::FrameBuffer buffer;
                buffer.insert(c.name(), Imf::Slice::Make(c.channel().type, bytes.data(), window,
                                                         size, size * width));
                in.setFrameBuffer(buffer);
                in.readTiles(0, in.numXTiles(lx) - 1, 0, in.numYTiles(ly) - 1, lx, ly);
                all.insert(all.end(), bytes.begin(), bytes.end());
            }
        }
    }
    return all;
}

class Shapes : public testing::TestWithParam<unsigned> {};

TEST_P(Shapes, AllThatIsNotColorStays) {
    Shape shape(GetParam());
    const test::TempFolder folder;
    const std::string in = folder.path("in.exr"), out = folder.path("out.exr");
    test::write_file(in, shape.parts);
    SourceSettings settings;
    settings.view = shape.view;
    settings.data_window = shape.below(4) ? DataWindow::grow : DataWindow::keep;
    auto header = open_source_frame(settings, {{Role::color, in}}, 1);
    ASSERT_TRUE(header.ok()) << header.status().message();
    const RoleChannels where = color_channels(*header);
    ASSERT_EQ(where.part, int(shape.color));
    auto frame = read_source_frame(settings, *header, {}, io::Keep::all);
    ASSERT_TRUE(frame.ok()) << frame.status().message();
    const io::Window &window = header->window, &data_window = color_part(*header).data_window;
    EXPECT_EQ(frame->description.width, window.width());
    ImageF filtered(frame->description.width, frame->description.height, 4);
    for (size_t i = 0; i < filtered.data.size(); ++i) filtered.data[i] = float(i % 509) / 256;
    io::WriteOptions options;
    options.window = data_window.grown(shape.below(9)).intersected(window);
    auto written = io::write_filtered(out, header->files.color_file(), frame->stored,
                                      {where.part, where.channels, &filtered}, options);
    ASSERT_TRUE(written.ok()) << written.status().message();

    auto after = io::ExrFile::open(out);
    ASSERT_TRUE(after.ok()) << after.status().message();
    ASSERT_EQ(after->parts().size(), shape.parts.size());
    const io::ExrPart& part = after->parts()[shape.color];
    EXPECT_TRUE(part.data_window.contains(*options.window)) << part.data_window.text();
    EXPECT_EQ(part.display_window, color_part(*header).display_window);
    for (const io::ExrChannel& channel : part.channels) {
        if (std::count(where.channels.begin(), where.channels.end(), channel.name)) continue;
        // A depth role is infinitely far outside the data.
        const bool depth = channel.name == "Z";
        const io::Window area = depth ? data_window : part.data_window;
        EXPECT_EQ(samples_in(in, int(shape.color), channel.name, area),
                  samples_in(out, int(shape.color), channel.name, area))
            << channel.name;
    }
    // Color is the filtered result if the part's compression is lossless.
    const auto& kept = part.compression;
    if (kept == "none" || kept == "rle" || kept == "zip" || kept == "zips" || kept == "piz") {
        const auto color = after->read_channels(int(shape.color), where.channels);
        ASSERT_TRUE(color.ok());
        const ImageF expected = io::placed(filtered, window, part.data_window);
        for (size_t i = 0; i < color->pixels(); ++i)
            for (int c = 0; c < color->channels; ++c)
                ASSERT_EQ(color->data[i * size_t(color->channels) + size_t(c)],
                          expected.data[4 * i + size_t(c)]);
    }
    for (size_t i = 0; i < shape.parts.size(); ++i) {
        if (i == shape.color) continue;
        const bool sampled = std::any_of(shape.parts[shape.color].channels.begin(),
                                         shape.parts[shape.color].channels.end(),
                                         [](const auto& c) { return c.x_sampling > 1; });
        if (sampled) continue;  // OpenImageIO cannot read such files
        if (shape.parts[i].deep) {
            EXPECT_EQ(test::oiio_deep(in, int(i)), test::oiio_deep(out, int(i)));
            continue;
        }
        if (shape.parts[i].tile > 0)
            EXPECT_TRUE(all_levels(in, int(i)) == all_levels(out, int(i))) << "part " << i;
        else
            EXPECT_TRUE(test::oiio_channels(in, int(i)) == test::oiio_channels(out, int(i)))
                << "part " << i;
    }
}

INSTANTIATE_TEST_SUITE_P(Seeds, Shapes, testing::Range(0u, 150u));

// tests/io has the files of one part that cannot be filtered.
TEST(RefusedShapes, SayWhy) {
    const test::TempFolder folder;
    const std::string path = folder.path("f.exr");
    FilePart deep{.name = "deep",
                  .channels = {{"A", Imf::FLOAT}, {"R", Imf::FLOAT}},
                  .compression = Imf::ZIPS_COMPRESSION,
                  .deep = true};
    FilePart deep_tiles = deep;
    deep_tiles.channels = {
        {"A", Imf::FLOAT}, {"B", Imf::FLOAT}, {"G", Imf::FLOAT}, {"R", Imf::FLOAT}};
    deep_tiles.tile = 8;
    const FilePart data{.name = "data", .channels = {{"Z", Imf::FLOAT}}};
    const FilePart layers{.name = "flat",
                          .channels = {{"x.B"}, {"x.G"}, {"x.R"}, {"y.B"}, {"y.G"}, {"y.R"}}};
    for (const auto& [parts, words] : std::vector<std::pair<std::vector<FilePart>, const char*>>{
             {{layers, deep}, "several view layers"},  // being deep is not the fault
             {{deep_tiles}, "flatten the file"},
             {{deep, data}, "R, G, B"}}) {
        test::write_file(path, parts);
        auto header = open_source_frame({}, {{Role::color, path}}, 1);
        const Status status =
            header.ok() ? read_source_frame({}, std::move(*header), {}, io::Keep::all).status()
                        : header.status();
        EXPECT_EQ(status.code(), StatusCode::input) << words;
        EXPECT_THAT(status.message(),
                    testing::AllOf(testing::HasSubstr(path), testing::HasSubstr(words)));
    }
}

}  // namespace
}  // namespace postchain::sequence
