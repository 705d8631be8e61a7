// One frame in the convention of each renderer, in separate files, layers, views and parts.
#include <ImfStandardAttributes.h>

#include "tests/command/fixture.h"

namespace postchain::test::convention_test {
namespace {

class ConventionTest : public CommandTest {
  protected:
    // Filters one frame and returns the image; `profile` gets the profile.
    ImageF filtered(const std::string& input, const Arguments& more = {},
                    const std::string& chain = "all.yaml") {
        const Arguments arguments = joined(
            {"run", at(chain), "-i", input, "-o", out(9), "--on-existing", "overwrite"}, more);
        const auto outcome = run(arguments);
        EXPECT_EQ(outcome.code, 0) << outcome.text();
        if (outcome.code != 0) return {};
        profile = sidecar(9)["profile"].get<std::string>();
        return read_color(out(9));
    }
    std::string profile;
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
    const ImageF got =
        filtered(in(2), {"--profile", at("engine.yaml"), "--camera", at("near.json")});
    EXPECT_EQ(profile, "engine");
    EXPECT_LE(largest_difference(got, expected), 1e-4);
    const auto without = run({"run", at("all.yaml"), "-i", in(2), "-o", out(9), "--profile",
                              at("engine.yaml"), "--on-existing", "overwrite"});
    EXPECT_NE(without.code, 0);
    EXPECT_TRUE(contains(without.err, "near_clip")) << without.err;
}

TEST_F(ConventionTest, PlanesInFilesOfTheirOwn) {
    const Planes planes = make_planes(96, 64);
    write_frame(in(1), planes);
    const ImageF expected = filtered(in(1));
    FrameFile color;
    color.convention = "generic";
    color.depth = color.motion = false;
    write_frame(at("c.0001.exr"), planes, color);
    ASSERT_TRUE(io::write_planes_exr(at("z.0001.exr"), planes.depth, {"Y"}).ok());
    ASSERT_TRUE(
        io::write_planes_exr(at("m.0001.exr"), planes.motion, {"motion.x", "motion.y"}).ok());
    const std::string input =
        "color=" + at("c.####.exr") + ",depth=" + at("z.####.exr") + ",motion=" + at("m.####.exr");
    EXPECT_LE(largest_difference(filtered(input), expected), 1e-5);
    const auto inputs = sidecar(9)["inputs"];
    EXPECT_EQ(inputs["inverse_depth"], at("z.0001.exr"));
    EXPECT_EQ(inputs["motion"], at("m.0001.exr"));
    // A file in another convention keeps it: Nuke's depth is 1/distance.
    FrameFile nuke;
    nuke.convention = "nuke";
    write_frame(at("n.0001.exr"), planes, nuke);
    const std::string mixed =
        "color=" + at("c.####.exr") + ",depth=" + at("n.####.exr") + ",motion=" + at("n.####.exr");
    EXPECT_LE(largest_difference(filtered(mixed), expected), 1e-5);
    // A depth channel without a clear convention beside Nuke vectors is not guessed.
    ASSERT_TRUE(
        io::write_planes_exr(at("nm.0001.exr"), planes.motion, {"forward.u", "forward.v"}).ok());
    expect_ends(run({"run", at("all.yaml"), "-i",
                     "color=" + at("c.####.exr") + ",depth=" + at("z.####.exr") +
                         ",motion=" + at("nm.####.exr"),
                     "-o", out(9), "--on-existing", "overwrite"}),
                4, {"--profile"});
    // The output is the filtered color file, without added channels.
    EXPECT_EQ(other_channels(out(9)).size(), 0u);
    // A depth of another size is refused.
    ASSERT_TRUE(io::write_planes_exr(at("z.0001.exr"), ImageF(40, 20, 1, 2.0f), {"Y"},
                                     io::OnExisting::overwrite)
                    .ok());
    expect_ends(
        run({"run", at("all.yaml"), "-i", input, "-o", out(9), "--on-existing", "overwrite"}), 4,
        {at("z.0001.exr")});
}

TEST_F(ConventionTest, LayersAreChosenOrListed) {
    const Planes one = make_planes(48, 32, 1), two = make_planes(48, 32, 2);
    io::PlanesFile file;
    for (int c = 0; c < 4; ++c) {
        file.channels.push_back(
            {std::string("one.Combined.") + "RGBA"[c], io::PixelType::float32, &one.color, c});
        file.channels.push_back(
            {std::string("two.Combined.") + "RGBA"[c], io::PixelType::float32, &two.color, c});
    }
    ASSERT_TRUE(io::write_planes_exr(in(1), file).ok());
    const auto unchosen = run({"run", at("fxaa.yaml"), "-i", in(1), "-o", out(1)});
    EXPECT_EQ(unchosen.code, 4) << unchosen.text();
    EXPECT_TRUE(contains(unchosen.err, "one") && contains(unchosen.err, "two") &&
                contains(unchosen.err, "--layer"))
        << unchosen.err;
    expect_ends(run({"run", at("fxaa.yaml"), "-i", in(1), "-o", out(1), "--layer", "three"}), 2,
                {"one", "two"});
    expect_ends(run({"run", at("fxaa.yaml"), "-i", in(1), "-o", out(1), "--layer", "two"}), 0);
    const auto before = io::ExrFile::open(in(1))->read_channels(0, {"one.Combined.G"});
    const auto after = io::ExrFile::open(out(1))->read_channels(0, {"one.Combined.G"});
    EXPECT_EQ(before->data, after->data);
    EXPECT_NE(io::ExrFile::open(in(1))->read_channels(0, {"two.Combined.G"})->data,
              io::ExrFile::open(out(1))->read_channels(0, {"two.Combined.G"})->data);
}

// Two views, and depth in separate parts; parts that are not filtered stay unchanged.
TEST_F(ConventionTest, PartsAndViews) {
    const auto rgba = [](const char* name, const char* view) {
        FilePart part;
        part.name = name;
        part.channels = {{"A"}, {"B"}, {"G"}, {"R"}};
        part.data = part.display = {{0, 0}, {31, 23}};
        part.edit = [view](Imf::Header& header) { header.setView(view); };
        return part;
    };
    FilePart other;
    other.name = "matte";
    other.channels = {{"red", Imf::FLOAT}};
    other.data = other.display = {{0, 0}, {31, 23}};
    write_file(in(1), {rgba("rgba.left", "left"), rgba("rgba.right", "right"), other});
    const auto several = run({"run", at("fxaa.yaml"), "-i", in(1), "-o", out(1)});
    EXPECT_EQ(several.code, 2) << several.text();
    EXPECT_TRUE(contains(several.err, "several views: left, right; choose one with --view"))
        << several.err;
    const auto left = run({"run", at("fxaa.yaml"), "-i", in(1), "-o", out(1), "--view", "left"});
    ASSERT_EQ(left.code, 0) << left.text();
    const auto right = run({"run", at("fxaa.yaml"), "-i", in(1), "-o", out(2), "--view", "right"});
    ASSERT_EQ(right.code, 0) << right.text();
    const auto bytes = [](const std::string& path, int part) { return oiio_channels(path, part); };
    ASSERT_EQ(oiio_parts(out(1)), 3);
    EXPECT_NE(bytes(out(1), 0), bytes(in(1), 0));
    EXPECT_EQ(bytes(out(1), 1), bytes(in(1), 1));
    EXPECT_EQ(bytes(out(2), 0), bytes(in(1), 0));
    EXPECT_NE(bytes(out(2), 1), bytes(in(1), 1));
    EXPECT_EQ(bytes(out(1), 2), bytes(in(1), 2));
    // Every view as it comes out alone.
    const auto all = run({"run", at("fxaa.yaml"), "-i", in(1), "-o", out(3), "--view", "all"});
    ASSERT_EQ(all.code, 0) << all.text();
    EXPECT_EQ(bytes(out(3), 0), bytes(out(1), 0));
    EXPECT_EQ(bytes(out(3), 1), bytes(out(2), 1));
    EXPECT_EQ(bytes(out(3), 2), bytes(in(1), 2));
    EXPECT_EQ(sidecar(3)["views"], (std::vector<std::string>{"left", "right"}));
    EXPECT_EQ(run({"run", at("fxaa.yaml"), "-i", in(1), "-o", at("o.tif"), "--view", "all"}).code,
              2);
    const auto again = run({"run", at("fxaa.yaml"), "-i", in(1), "-o", out(3), "--view", "all",
                            "--on-existing", "skip"});
    EXPECT_EQ(again.code, 0) << again.text();
    EXPECT_TRUE(contains(again.text(), "skipped")) << again.text();
    // Only run filters all views of a file.
    expect_ends(run({"plan", at("fxaa.yaml"), "-i", in(1), "--view", "all"}), 2, {"--view all"});
    expect_ends(run({"inspect", in(1), "--view", "all"}), 2, {"--view all"});
    expect_ends(run({"run", at("fxaa.yaml"), "-i", in(1), "-o", out(4), "--view", "top"}), 2,
                {"left", "right"});
}

// Two views in one part, whose fill masks have names of their own, and a view whose window differs.
TEST_F(ConventionTest, AllViewsOfAPart) {
    FilePart part;
    for (const char* view : {"", "right."})
        for (const char* channel : {"A", "B", "G", "R", "Z"})
            part.channels.push_back({std::string(view) + channel, Imf::FLOAT});
    part.data = part.display = {{0, 0}, {31, 23}};
    part.edit = [](Imf::Header& header) { Imf::addMultiView(header, {"left", "right"}); };
    write_file(in(1), {part});
    write_file(in(2), {part});
    const auto filtered = [&](int to, const char* view) {
        expect_ends(
            run({"run", at("fxaa.yaml"), "-i", in(), "--frames", "1-2", "-o",
                 at(std::to_string(to) + ".####.exr"), "--view", view, "--fill-mask", "fill"}),
            0);
        return oiio_channels(at(std::to_string(to) + ".0002.exr"));
    };
    const auto left = filtered(1, "left"), right = filtered(2, "right"), all = filtered(3, "all");
    const auto before = oiio_channels(in(2));
    for (const auto& [alone, prefix] : {std::pair{&left, ""}, {&right, "right."}})
        for (const char* channel : {"R", "G", "B"}) {
            const std::string name = concat(prefix, channel);
            EXPECT_EQ(named(all, name), named(*alone, name)) << name;
            EXPECT_NE(named(all, name).bytes, named(before, name).bytes) << name;
        }
    EXPECT_EQ(named(all, "fill.frame"), named(left, "fill.frame"));
    EXPECT_EQ(named(all, "fill.right.frame"), named(right, "fill.right.frame"));
    for (const char* channel : {"Z", "right.Z"})
        EXPECT_EQ(named(all, channel), named(before, channel)) << channel;
    EXPECT_EQ(all.size(), before.size() + 6);
    FilePart wide = part;
    part.channels.resize(5);
    part.name = "left";
    part.edit = [](Imf::Header& header) { header.setView("left"); };
    wide.channels.resize(5);
    wide.name = "right";
    wide.edit = [](Imf::Header& header) { header.setView("right"); };
    wide.data = {{-4, 0}, {31, 23}};
    write_file(in(3), {part, wide});
    const auto apart = run({"run", at("fxaa.yaml"), "-i", in(3), "-o", out(3), "--view", "all"});
    EXPECT_EQ(apart.code, 4) << apart.text();
    EXPECT_TRUE(contains(apart.err,
                         "view right has the data window (-4, 0)-(31, 23), view left "
                         "(0, 0)-(31, 23); filter one after the other (--view right)"))
        << apart.err;
}

}  // namespace
}  // namespace postchain::test::convention_test
