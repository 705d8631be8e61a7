// Frames with a profile of one's own, in separate files, layers, views and parts.
#include <ImfStandardAttributes.h>

#include "tests/command/fixture.h"

namespace postchain::test::convention_test {
namespace {

class ConventionTest : public CommandTest {
  protected:
    Outcome run_on(const std::string& input, const std::string& output, const Arguments& more = {},
                   const std::string& chain = "fxaa") {
        return run(joined(
            {"run", at(chain + ".yaml"), "-i", input, "-o", output, "--on-existing", "overwrite"},
            more));
    }
    // The result of the chain of all passes over one frame.
    ImageF filtered(const std::string& input, const Arguments& more = {}) {
        const auto outcome = run_on(input, out(9), more, "all");
        EXPECT_EQ(outcome.code, 0) << outcome.text();
        return outcome.code == 0 ? read_color(out(9)) : ImageF();
    }
    static FilePart part_of_view(const std::string& name, const char* view) {
        FilePart part;
        part.name = name;
        part.channels = {{"A"}, {"B"}, {"G"}, {"R"}};
        part.data = part.display = {{0, 0}, {31, 23}};
        part.edit = [view](Imf::Header& header) { header.setView(view); };
        return part;
    }
};

TEST_F(ConventionTest, AProfileOfOnesOwn) {
    const Planes planes = make_planes(96, 64);
    write_frame(in(1), planes);
    const ImageF expected = filtered(in(1));
    // uv fractions around 0.5, y up; reverse-Z with a near plane of 0.5: z = 0.5/d.
    Planes engine = planes;
    for (size_t i = 0; i < engine.motion.pixels(); ++i) {
        engine.motion.data[2 * i] = 0.5f + planes.motion.data[2 * i] / 96;
        engine.motion.data[2 * i + 1] = 0.5f - planes.motion.data[2 * i + 1] / 64;
        engine.depth.data[i] = 0.5f / planes.depth.data[i];
    }
    FrameFile file;
    file.convention = "generic";
    write_frame(in(2), engine, file);
    write_text(at("engine.yaml"),
               "profile: 1\nname: engine\ncolor: [{channels: [[R, G, B, A]]}]\n"
               "depth: [{channels: [[Z]], encoding: reverse_infinite}]\n"
               "motion: [{channels: [[motion.x, motion.y]], unit: fraction, scale: [1, -1],"
               " bias: 0.5}]\n");
    write_text(at("near.json"), "{\"near_clip\": 0.5}");
    const Arguments profile = {"--profile", at("engine.yaml")};
    const ImageF got = filtered(in(2), joined(profile, {"--camera", at("near.json")}));
    EXPECT_EQ(sidecar(9)["profile"], "engine");
    EXPECT_LE(largest_difference(got, expected), 1e-4);
    expect_ends(run_on(in(2), out(9), profile, "all"), 3, {"near_clip"});
}

TEST_F(ConventionTest, PlanesInFilesOfTheirOwn) {
    const Planes planes = make_planes(96, 64);
    write_frame(in(1), planes);
    const ImageF expected = filtered(in(1));
    FrameFile file;
    file.convention = "nuke";
    write_frame(at("n.0001.exr"), planes, file);
    file.convention = "generic";
    file.depth = file.motion = false;
    write_frame(at("c.0001.exr"), planes, file);
    ASSERT_TRUE(io::write_planes_exr(at("z.0001.exr"), planes.depth, {"Y"}).ok());
    ASSERT_TRUE(
        io::write_planes_exr(at("m.0001.exr"), planes.motion, {"motion.x", "motion.y"}).ok());
    ASSERT_TRUE(
        io::write_planes_exr(at("nm.0001.exr"), planes.motion, {"forward.u", "forward.v"}).ok());
    const auto input = [&](const std::string& depth, const std::string& motion) {
        return "color=" + at("c.####.exr") + ",depth=" + at(depth + ".####.exr") +
               ",motion=" + at(motion + ".####.exr");
    };
    EXPECT_LE(largest_difference(filtered(input("z", "m")), expected), 1e-5);
    EXPECT_EQ(sidecar(9)["inputs"]["inverse_depth"], at("z.0001.exr"));
    EXPECT_EQ(sidecar(9)["inputs"]["motion"], at("m.0001.exr"));
    // The output is the filtered color file, without added channels.
    EXPECT_EQ(other_channels(out(9)).size(), 0u);
    // A file in another convention keeps it: Nuke's depth is 1/distance.
    EXPECT_LE(largest_difference(filtered(input("n", "n")), expected), 1e-5);
    // A depth channel without a clear convention beside Nuke vectors is not guessed.
    expect_ends(run_on(input("z", "nm"), out(9), {}, "all"), 4, {"--profile"});
}

TEST_F(ConventionTest, LayersAreChosenOrListed) {
    const Planes one = make_planes(48, 32, 1), two = make_planes(48, 32, 2);
    io::PlanesFile file;
    for (int c = 0; c < 4; ++c)
        for (const auto& [layer, planes] : {std::pair{"one", &one}, {"two", &two}})
            file.channels.push_back({concat(layer, ".Combined.", "RGBA"[c]), io::PixelType::float32,
                                     &planes->color, c});
    ASSERT_TRUE(io::write_planes_exr(in(1), file).ok());
    expect_ends(run_on(in(1), out(1)), 4, {"one", "two", "--view-layer"});
    expect_ends(run_on(in(1), out(1), {"--view-layer", "three"}), 2, {"one", "two"});
    expect_ends(run_on(in(1), out(1), {"--view-layer", "two"}), 0);
    const auto before = oiio_channels(in(1)), after = oiio_channels(out(1));
    EXPECT_EQ(named(before, "one.Combined.G"), named(after, "one.Combined.G"));
    EXPECT_NE(named(before, "two.Combined.G").bytes, named(after, "two.Combined.G").bytes);
}

// Two views in parts of their own; a part that is not filtered stays unchanged.
TEST_F(ConventionTest, PartsAndViews) {
    FilePart other;
    other.name = "matte";
    other.channels = {{"red", Imf::FLOAT}};
    other.data = other.display = {{0, 0}, {31, 23}};
    write_file(in(1),
               {part_of_view("rgba.left", "left"), part_of_view("rgba.right", "right"), other});
    expect_ends(run_on(in(1), out(1)), 2, {"several views: left, right; choose one with --view"});
    expect_ends(run_on(in(1), out(1), {"--view", "left"}), 0);
    expect_ends(run_on(in(1), out(2), {"--view", "right"}), 0);
    expect_ends(run_on(in(1), out(3), {"--view", "all"}), 0);
    const auto bytes = [](const std::string& path, int part) { return oiio_channels(path, part); };
    EXPECT_NE(bytes(out(1), 0), bytes(in(1), 0));
    EXPECT_EQ(bytes(out(1), 1), bytes(in(1), 1));
    EXPECT_EQ(bytes(out(2), 0), bytes(in(1), 0));
    EXPECT_NE(bytes(out(2), 1), bytes(in(1), 1));
    // Every view as it comes out alone.
    EXPECT_EQ(bytes(out(3), 0), bytes(out(1), 0));
    EXPECT_EQ(bytes(out(3), 1), bytes(out(2), 1));
    for (const int frame : {1, 3}) EXPECT_EQ(bytes(out(frame), 2), bytes(in(1), 2));
    EXPECT_EQ(sidecar(3)["views"], (std::vector<std::string>{"left", "right"}));
    EXPECT_EQ(run_on(in(1), at("o.tif"), {"--view", "all"}).code, 2);
    // Only run filters all views of a file.
    expect_ends(run({"plan", at("fxaa.yaml"), "-i", in(1), "--view", "all"}), 2, {"--view all"});
    expect_ends(run({"inspect", in(1), "--view", "all"}), 2, {"--view all"});
}

// Two views in one part, whose fill masks have names of their own, and a view whose window differs.
TEST_F(ConventionTest, AllViewsOfAPart) {
    FilePart part;
    for (const char* view : {"", "right."})
        for (const char* channel : {"A", "B", "G", "R", "Z"})
            part.channels.push_back({std::string(view) + channel, Imf::FLOAT});
    part.data = part.display = {{0, 0}, {31, 23}};
    part.edit = [](Imf::Header& header) { Imf::addMultiView(header, {"left", "right"}); };
    for (const int frame : {1, 2}) write_file(in(frame), {part});
    const auto filtered = [&](const std::string& view) {
        expect_ends(run_on(in(), at(view + ".####.exr"),
                           {"--frames", "1-2", "--view", view, "--fill-mask", "fill"}),
                    0);
        return oiio_channels(at(view + ".0002.exr"));
    };
    const auto left = filtered("left"), right = filtered("right"), all = filtered("all");
    const auto before = oiio_channels(in(2));
    for (const char* name : {"R", "G", "B", "right.R", "right.G", "right.B"}) {
        const auto& alone = std::string(name).size() > 1 ? right : left;
        EXPECT_EQ(named(all, name), named(alone, name)) << name;
        EXPECT_NE(named(all, name).bytes, named(before, name).bytes) << name;
    }
    EXPECT_EQ(named(all, "fill.frame"), named(left, "fill.frame"));
    EXPECT_EQ(named(all, "fill.right.frame"), named(right, "fill.right.frame"));
    for (const char* channel : {"Z", "right.Z"})
        EXPECT_EQ(named(all, channel), named(before, channel)) << channel;
    EXPECT_EQ(all.size(), before.size() + 6);

    FilePart wide = part_of_view("right", "right");
    wide.data = {{-4, 0}, {31, 23}};
    write_file(in(3), {part_of_view("left", "left"), wide});
    expect_ends(run_on(in(3), out(3), {"--view", "all"}), 4,
                {"view right has the data window (-4, 0)-(31, 23), view left (0, 0)-(31, 23); "
                 "filter one after the other (--view right)"});
}

}  // namespace
}  // namespace postchain::test::convention_test
