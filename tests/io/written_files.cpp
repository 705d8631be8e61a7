#include "tests/io/written_files.h"

#include <ImfChromaticities.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <half.h>

#include <algorithm>
#include <cstring>
#include <filesystem>

#include "tests/support/status.h"

namespace postchain::io {

using test::FilePart;
using test::must;
using test::oiio_attributes;
using test::oiio_channels;
using test::OiioChannel;

namespace {

std::vector<std::string> open_files() {
    std::vector<std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
        std::error_code ignored;
        files.push_back(std::filesystem::read_symlink(entry, ignored).string());
    }
    return files;
}

// Every test closes the files that it opens, also those that it cannot read or write.
class ClosedFiles : public testing::EmptyTestEventListener {
    void OnTestStart(const testing::TestInfo&) override { before_ = open_files(); }
    void OnTestEnd(const testing::TestInfo&) override {
        EXPECT_THAT(open_files(), testing::UnorderedElementsAreArray(before_));
    }
    std::vector<std::string> before_;
};

const bool files_are_watched = [] {
    testing::UnitTest::GetInstance()->listeners().Append(new ClosedFiles);
    return true;
}();

}  // namespace

ReadFile read_file(const std::string& path, const FrameChannels& channels, RoleSet wanted,
                   const std::optional<PlanesArea>& area) {
    FrameFiles files = must(open_frame({{Role::color, path}}, 1));
    StoredFrame stored = must(read_frame(files, channels, wanted, Keep::all, area));
    return {std::move(stored), std::move(files), channels.at(Role::color)};
}

ReadFile read_ok(const std::string& path, int part, const std::vector<std::string>& color) {
    return read_file(path, {{Role::color, {part, color}}});
}

ImageF new_color(const StoredFrame& frame) {
    ImageF color(frame.window.width(), frame.window.height(), 4);
    for (size_t i = 0; i < color.data.size(); ++i) color.data[i] = 4 + float(i % 1021) / 256;
    return color;
}

Result<WriteReport> write_filtered(const std::string& path, const ReadFile& frame,
                                   const ImageF& color, const WriteOptions& options,
                                   const std::vector<FilteredLayer>& layers) {
    return write_filtered(path, frame.files.color_file(), frame,
                          {frame.color.part, frame.color.channels, &color}, options, layers);
}

WriteReport write_ok(const std::string& path, const ReadFile& frame, const ImageF& color,
                     WriteOptions options) {
    return must(write_filtered(path, frame, color, options));
}

WriteReport InOut::expect_new_color(const std::vector<FilePart>& parts, WriteOptions options,
                                    int part, const std::vector<std::string>& channels) {
    test::write_file(in, parts);
    ReadFile frame = read_ok(in, part, channels);
    const ImageF color = new_color(frame);
    options.on_existing = OnExisting::overwrite;
    const WriteReport report = write_ok(out, frame, color, options);
    expect_only_color_changed(in, out, part, channels, color);
    return report;
}

void expect_only_color_changed(const std::string& in, const std::string& out, int part,
                               const std::vector<std::string>& replaced, const ImageF& color) {
    const std::vector<OiioChannel> before = oiio_channels(in, part);
    const std::vector<OiioChannel> after = oiio_channels(out, part);
    ASSERT_EQ(before.size(), after.size());
    for (size_t c = 0; c < before.size(); ++c) {
        EXPECT_EQ(before[c].name, after[c].name);
        EXPECT_EQ(before[c].type, after[c].type);
        const auto it = std::find(replaced.begin(), replaced.end(), before[c].name);
        if (it == replaced.end()) {
            EXPECT_TRUE(before[c].bytes == after[c].bytes) << before[c].name;
            continue;
        }
        const size_t index = size_t(it - replaced.begin());
        std::vector<char> expected;
        for (size_t p = 0; p < color.pixels(); ++p) {
            const float value = color.data[p * 4 + index];
            const half h(value);
            const bool is_half = after[c].type == "half";
            const char* from =
                is_half ? reinterpret_cast<const char*>(&h) : reinterpret_cast<const char*>(&value);
            expected.insert(expected.end(), from, from + (is_half ? 2 : 4));
        }
        EXPECT_TRUE(expected == after[c].bytes) << after[c].name;
    }
}

std::vector<std::string> attribute_changes(const std::string& in, const std::string& out,
                                           int part) {
    const auto before = oiio_attributes(in, part);
    const auto after = oiio_attributes(out, part);
    std::vector<std::string> changes;
    for (const auto& line : before)
        if (std::find(after.begin(), after.end(), line) == after.end())
            changes.push_back("- " + line);
    for (const auto& line : after)
        if (std::find(before.begin(), before.end(), line) == before.end())
            changes.push_back("+ " + line);
    return changes;
}

void expect_channel(const PartPixels& pixels, const FilePart& made, size_t channel,
                    uint32_t outside) {
    const auto& [name, type, step_x, step_y] = made.channels[channel];
    const PartPixels::Plane* plane = pixels.find(name);
    ASSERT_NE(plane, nullptr) << name;
    const size_t size = size_t(bytes_of(plane->channel.type));
    const std::byte* at = plane->bytes.get();
    for (int row = 0; row < plane->height; ++row)
        for (int column = 0; column < plane->width; ++column, at += size) {
            const int x = pixels.window.min_x + column * step_x;
            const int y = pixels.window.min_y + row * step_y;
            uint32_t bits = 0;
            std::memcpy(&bits, at, size);
            ASSERT_EQ(bits, made.data.intersects(Imath::V2i(x, y))
                                ? test::sample_bits(made, channel, x, y)
                                : outside)
                << name << " at " << x << ", " << y;
        }
}

void expect_samples(const std::string& path, int part, const FilePart& made) {
    ExrFile file = must(ExrFile::open(path));
    const auto pixels = must(file.read_part(part));
    ASSERT_EQ(pixels.planes.size(), made.channels.size());
    for (size_t c = 0; c < made.channels.size(); ++c) expect_channel(pixels, made, c);
}

FilePart every_type(const std::string& name) {
    return {.name = name,
            .channels = {{"R"},
                         {"G"},
                         {"B"},
                         {"A"},
                         {"Z", Imf::FLOAT},
                         {"Vector.X", Imf::FLOAT},
                         {"diffuse.R"},
                         {"id", Imf::UINT}},
            .data = {{-7, -3}, {20, 35}},
            .display = {{0, 0}, {99, 49}},
            .special_values = true,
            .edit = [](Imf::Header& h) {
                h.pixelAspectRatio() = 1.5f;
                h.screenWindowWidth() = 2;
                h.insert("comment", Imf::StringAttribute("kept"));
                Imf::addOwner(h, "owner");
                Imf::addTimeCode(h, Imf::TimeCode(1, 2, 3, 4));
                Imf::addChromaticities(h, Imf::Chromaticities({0.7f, 0.3f}));
            }};
}

}  // namespace postchain::io
