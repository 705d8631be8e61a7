// Files with several views and parts.
#include <ImfStandardAttributes.h>

#include "tests/command/fixture.h"

namespace postchain::test::convention_test {
namespace {

class ConventionTest : public CommandTest {
  protected:
    Outcome run_on(const std::string& input, const std::string& output,
                   const Arguments& more = {}) {
        return run(joined({"run", at("fxaa.yaml"), "-i", input, "-o", output}, more));
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

// Two views in parts of their own; a part that is not filtered stays unchanged.
TEST_F(ConventionTest, PartsAndViews) {
    FilePart other;
    other.name = "matte";
    other.channels = {{"red", Imf::FLOAT}};
    other.data = other.display = {{0, 0}, {31, 23}};
    write_file(in(1),
               {part_of_view("rgba.left", "left"), part_of_view("rgba.right", "right"), other});
    expect_ends(run_on(in(1), out(1)), 2, {"several views: left, right; choose one with --view"});
    int frame = 0;
    for (const char* view : {"left", "right", "all"})
        expect_ends(run_on(in(1), out(++frame), {"--view", view}), 0);
    const auto bytes = [](const std::string& path, int part) { return oiio_channels(path, part); };
    EXPECT_NE(bytes(out(1), 0), bytes(in(1), 0));
    EXPECT_EQ(bytes(out(1), 1), bytes(in(1), 1));
    // Every view as it comes out alone.
    EXPECT_EQ(bytes(out(3), 0), bytes(out(1), 0));
    EXPECT_EQ(bytes(out(3), 1), bytes(out(2), 1));
    EXPECT_EQ(bytes(out(3), 2), bytes(in(1), 2));
    EXPECT_EQ(sidecar(3)["views"], (std::vector<std::string>{"left", "right"}));
    // Only run filters all views of a file, into an EXR.
    expect_ends(run_on(in(1), at("o.tif"), {"--view", "all"}), 2);
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
