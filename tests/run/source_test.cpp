// One frame from its files to the canonical frame.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "chain/pass/depth_at.h"
#include "chain/plan/plan_print.h"
#include "config/chain_file.h"
#include "config/profile.h"
#include "passes/registry.h"
#include "tests/command/frames.h"
#include "tests/io/exr_files.h"
#include "tests/support/status.h"
#include "tests/support/temp_folder.h"
#include "tools/sequence/source/file_convention.h"
#include "tools/sequence/source/frame_plan.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain::sequence {
namespace {

using test::error_of;
using test::FrameFile;
using test::make_planes;
using test::must;
using test::Planes;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr RoleSet kEverything = {Role::inverse_depth, Role::motion, Role::motion_back};

class Source : public testing::Test {
  protected:
    void write(const Planes& planes, const FrameFile& file = {}) {
        test::write_frame(path_, planes, file);
    }
    FrameHeader header() { return must(open_source_frame(settings_, {{Role::color, path_}}, 1)); }
    SourceFrame read(RoleSet wanted = kEverything) {
        return must(read_source_frame(settings_, header(), wanted, io::Keep::nothing));
    }
    // Only color, and frames with other planes from these files.
    void write_color(const Planes& planes) {
        FrameFile plain = of("generic", false);
        plain.depth = false;
        write(planes, plain);
    }
    SourceFrame read_from(std::map<Role, std::string> files) {
        files[Role::color] = path_;
        return must(read_source_frame(settings_, must(open_source_frame(settings_, files, 1)),
                                      kEverything, io::Keep::nothing));
    }
    void camera(const std::string& text) {
        settings_.camera = parse_camera(text, "camera.json");
        ASSERT_EQ(error_of(settings_.camera->status()), "");
    }
    static FrameFile of(const std::string& convention, bool motion = true) {
        FrameFile file;
        file.convention = convention;
        file.motion = motion;
        return file;
    }
    static std::string warnings(const SourceFrame& frame) {
        std::string text;
        for (const std::string& warning : frame.warnings) text += warning + "\n";
        return text;
    }

    test::TempFolder folder_;
    const std::string path_ = folder_.path("f.exr");
    SourceSettings settings_;
};

// Plain files whose vectors are fractions of the image, or of another form.
Profile fractions(const std::string& form = "unit: fraction") {
    const ProfileFile file = parse_profile(
        "profile: 1\nname: uv\ncolor: [{channels: [[R, G, B, A]]}]\n"
        "motion: [{channels: [[motion.x, motion.y]], " +
            form + "}]\n",
        "uv.yaml");
    EXPECT_EQ(error_of(file.status()), "");
    return file.profile;
}

Chain chain_from(const std::string& text, const std::vector<std::string>& sets = {}) {
    auto file = parse_chain(text, "chain.yaml", builtin_passes(), sets);
    EXPECT_EQ(error_of(file.status()), "");
    return std::move(file.chain);
}

// The tables of docs/frame.md and docs/profiles.md, checked on planes, not on filtered results.
TEST_F(Source, EveryConventionGivesTheCanonicalPlanes) {
    const Planes planes = make_planes(24, 16);
    for (const std::string name : {"cycles", "nuke", "arnold", "vray", "generic"}) {
        SCOPED_TRACE(name);
        write(planes, of(name));
        const SourceFrame frame = read();
        EXPECT_EQ(frame.header.match.profile, name);
        EXPECT_EQ(frame.planes.at(Role::color)->data, planes.color.data);
        EXPECT_LE(test::largest_difference(*frame.planes.at(Role::motion), planes.motion), 1e-6);
        const auto& w = *frame.planes.at(Role::inverse_depth);
        for (size_t i = 0; i < w.pixels(); ++i)
            ASSERT_NEAR(w.data[i], 1 / planes.depth.data[i], 1e-6);
        const auto back = frame.planes.find(Role::motion_back);
        EXPECT_EQ(back == frame.planes.end(), name == "arnold" || name == "vray");
        if (back != frame.planes.end()) {
            EXPECT_LE(test::largest_difference(*back->second, planes.back), 1e-6);
            EXPECT_NEAR(frame.description.bounds.max_speed_back_px, std::sqrt(29.0), 1e-5);
        }
        EXPECT_NEAR(frame.description.bounds.max_speed_px, std::sqrt(45.0), 1e-5);
    }
}

TEST_F(Source, IsDescribedFromItsHeader) {
    test::write_file(path_, {{.channels = {{"R"}, {"G"}, {"B"}},
                              .data = {{-2, -1}, {13, 9}},
                              .display = {{0, 0}, {11, 7}},
                              .edit = [](Imf::Header& h) { h.pixelAspectRatio() = 2; }}});
    camera(R"({"focal_length_mm": 35})");
    settings_.data_window = DataWindow::keep;
    const auto frame = describe(must(open_source_frame(settings_, {{Role::color, path_}}, 17)));
    EXPECT_THAT((std::array{frame.width, frame.height, frame.display_width, frame.display_height,
                            frame.origin_x, frame.origin_y, frame.frame_number}),
                ElementsAre(16, 11, 12, 8, -2, -1, 17));
    EXPECT_EQ(frame.pixel_aspect, 2);
    EXPECT_EQ(frame.camera.focal_length_mm, 35);
}

TEST_F(Source, ADisplayWindowThatIsTooLargeIsNotFilled) {
    for (const auto& [x, y] : {std::pair(io::kMaxSide, 8), {8, io::kMaxSide}, {8, 8}}) {
        test::write_file(path_, {{.channels = {{"R"}, {"G"}, {"B"}},
                                  .data = {{0, 0}, {7, 7}},
                                  .display = {{0, 0}, {x, y}}}});
        const FrameHeader opened = header();
        const bool large = std::max(x, y) > 8;
        EXPECT_EQ(opened.window, large ? io::Window(0, 0, 7, 7) : io::Window(0, 0, 8, 8));
        EXPECT_EQ(opened.warnings.size(), large ? 1u : 0u);
        if (large) {
            EXPECT_THAT(opened.warnings[0], HasSubstr("is too large to filter (at most 16384"));
        }
    }
}

// Fractions are of the display window: neither overscan nor a crop of the file, which may move from
// frame to frame, nor what is filtered changes a vector.
TEST_F(Source, FractionsAreOfTheDisplay) {
    settings_.profile = fractions();
    FrameFile file = of("generic");
    struct Case {
        io::Window data, display;
    };
    for (const Case& one :
         {Case{{0, 0, 23, 15}, {0, 0, 23, 15}}, Case{{4, 2, 19, 9}, {0, 0, 39, 31}},
          Case{{-4, -2, 27, 17}, {0, 0, 23, 15}}, Case{{-4, 3, 19, 9}, {0, 0, 23, 15}}}) {
        SCOPED_TRACE(one.data.text() + " of " + one.display.text());
        file.origin_x = one.data.min_x;
        file.origin_y = one.data.min_y;
        file.display = one.display;
        write(make_planes(one.data.width(), one.data.height()), file);
        for (const DataWindow window : {DataWindow::grow, DataWindow::keep}) {
            settings_.data_window = window;
            const SourceFrame frame = read();
            const ImageF& motion = *frame.planes.at(Role::motion);
            const int x = one.data.min_x - frame.header.window.min_x,
                      y = one.data.min_y - frame.header.window.min_y;
            EXPECT_FLOAT_EQ(motion.at(x, y, 0), -2 * one.display.width());
            EXPECT_FLOAT_EQ(motion.at(x, y, 1), 1 * one.display.height());
        }
    }
}

// A file of motion vectors has both directions, of which the command's `motion=` names one.
TEST_F(Source, BackwardVectorsComeFromTheFileOfMotion) {
    const Planes planes = make_planes(24, 16);
    Planes still = planes;
    still.motion = still.back = ImageF(24, 16, 2);
    const std::string moves = folder_.path("m.exr"), other = folder_.path("o.exr");
    test::write_frame(moves, planes);
    test::write_frame(other, still);
    write_color(planes);
    const auto is = [](const SourceFrame& frame, Role role, const ImageF& expected) {
        return test::largest_difference(*frame.planes.at(role), expected) <= 1e-6;
    };
    const SourceFrame both = read_from({{Role::motion, moves}});
    EXPECT_TRUE(is(both, Role::motion, planes.motion));
    EXPECT_TRUE(is(both, Role::motion_back, planes.back));
    EXPECT_EQ(both.planes.count(Role::inverse_depth), 0u);
    // A file that is named for them has priority.
    EXPECT_TRUE(is(read_from({{Role::motion, moves}, {Role::motion_back, other}}),
                   Role::motion_back, still.back));
    // At a cut, the other side's vectors come from their own file.
    settings_.cuts = {1};
    EXPECT_TRUE(is(read_from({{Role::motion, other}, {Role::motion_back, moves}}), Role::motion,
                   planes.back));
}

// Each file keeps its own convention: Nuke's depth is 1/distance.
TEST_F(Source, PlanesInFilesOfTheirOwn) {
    const Planes planes = make_planes(24, 16);
    write_color(planes);
    const std::string depth = folder_.path("z.exr"), motion = folder_.path("m.exr"),
                      nuke = folder_.path("n.exr"), vectors = folder_.path("v.exr");
    test::write_frame(nuke, planes, of("nuke"));
    must(io::write_planes_exr(depth, planes.depth, {"Y"}));
    must(io::write_planes_exr(motion, planes.motion, {"motion.x", "motion.y"}));
    must(io::write_planes_exr(vectors, planes.motion, {"forward.u", "forward.v"}));
    for (const auto& [of_depth, of_motion] : {std::pair(depth, motion), {nuke, nuke}}) {
        const SourceFrame frame =
            read_from({{Role::inverse_depth, of_depth}, {Role::motion, of_motion}});
        EXPECT_LE(test::largest_difference(*frame.planes.at(Role::motion), planes.motion), 1e-6);
        const ImageF& w = *frame.planes.at(Role::inverse_depth);
        for (size_t i = 0; i < w.pixels(); ++i)
            ASSERT_NEAR(w.data[i], 1 / planes.depth.data[i], 1e-6) << of_depth;
    }
    // Which form a depth without a name has beside Nuke's vectors is not guessed.
    EXPECT_THAT(
        error_of(open_source_frame(
            settings_,
            {{Role::color, path_}, {Role::inverse_depth, depth}, {Role::motion, vectors}}, 1)),
        HasSubstr("{profile}"_keyed));
    // A named profile says how.
    settings_.profile = must(find_profile("nuke"));
    const SourceFrame inverse = read_from({{Role::inverse_depth, depth}});
    EXPECT_EQ(inverse.planes.at(Role::inverse_depth)->data, planes.depth.data);
    settings_.profile = fractions();  // which says nothing of depth
    const SourceFrame linear = read_from({{Role::inverse_depth, depth}});
    EXPECT_FLOAT_EQ(linear.planes.at(Role::inverse_depth)->data[0], 1 / planes.depth.data[0]);
}

// Channels without a known name, read by the first convention of the profile.
TEST_F(Source, VectorsInPlainFilesOfTheirOwn) {
    const Planes planes = make_planes(24, 16);
    write_color(planes);
    const std::string motion = folder_.path("m.exr"), back = folder_.path("b.exr");
    must(io::write_planes_exr(motion, planes.motion, {"X", "Y"}));
    must(io::write_planes_exr(back, planes.back, {"U", "V"}));
    for (const char* name : {"generic", "nuke"}) {  // y down, y up
        settings_.profile = must(find_profile(name));
        const SourceFrame frame = read_from({{Role::motion, motion}, {Role::motion_back, back}});
        const float up = settings_.profile->name == "nuke" ? -1 : 1;
        EXPECT_EQ(frame.planes.at(Role::motion)->data[1], up * planes.motion.data[1]);
        EXPECT_EQ(std::abs(frame.planes.at(Role::motion_back)->data[0]),
                  std::abs(planes.back.data[0]));
    }
    const std::string many = folder_.path("many.exr");
    std::vector<std::string> names;
    for (int i = 10; i < 52; ++i) names.push_back(concat("c", i));
    must(io::write_planes_exr(many, ImageF(24, 16, 42), names));
    EXPECT_THAT(error_of(open_source_frame(settings_,
                                           {{Role::color, path_}, {Role::inverse_depth, many}}, 1)),
                AllOf(HasSubstr("no inverse_depth channels found among c10 "),
                      HasSubstr(" c49 and 2 more; name them in a profile")));
}

TEST_F(Source, PlanesOfAnotherViewAreRefused) {
    FrameFile left = of("generic"), right = left;
    left.attributes["view"] = std::string("left");
    right.attributes["view"] = std::string("right");
    const Planes planes = make_planes(24, 16);
    write(planes, left);
    test::write_frame(folder_.path("r.exr"), planes, right);
    const std::map<Role, std::string> files = {{Role::color, path_},
                                               {Role::inverse_depth, folder_.path("r.exr")}};
    EXPECT_THAT(error_of(open_source_frame(settings_, files, 1)), HasSubstr("several views"));
    settings_.profile = must(find_profile("generic"));
    EXPECT_THAT(
        error_of(open_source_frame(settings_, files, 1)),
        HasSubstr("r.exr: has no view left; filter one after the other ({view=right})"_keyed));
    test::write_frame(folder_.path("r.exr"), planes, left);
    EXPECT_TRUE(open_source_frame(settings_, files, 1).ok());
}

// A matrix of the frame's file, and of that of a frame beside it.
TEST_F(Source, CamerasOfNeighborsAreReadFromTheirFiles) {
    const Planes planes = make_planes(24, 16);
    const std::string next = folder_.path("f.2.exr");
    camera(R"({"focal_length_mm": 40, "sensor_width_mm": 36})");
    settings_.color_frames = *io::PathPattern::parse(folder_.path("f.#.exr"));
    const auto of_camera = [](bool motion, const char* matrix) {
        FrameFile file = of("generic", motion);
        file.attributes["worldToCamera"] = std::string(matrix);
        return file;
    };
    const char* straight = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";
    const char* turned = "0 0 1 0 0 1 0 0 -1 0 0 0 0 0 0 1";
    write(planes, of_camera(false, straight));
    EXPECT_FALSE(header().makes_motion) << "the other is missing";
    test::write_text(next, "no EXR");
    EXPECT_FALSE(header().makes_motion);
    test::write_frame(next, planes, of("generic", false));
    EXPECT_FALSE(header().makes_motion) << "it has no camera";
    test::write_frame(next, planes, of_camera(false, straight));
    EXPECT_TRUE(header().makes_motion);
    settings_.color_frames = *io::PathPattern::parse(next);
    EXPECT_FALSE(header().makes_motion) << "the name is of one frame";
    // Beside vectors of the file it is for the sky, if asked for.
    settings_.color_frames = *io::PathPattern::parse(folder_.path("f.#.exr"));
    write(planes, of_camera(true, straight));
    for (const char* matrix : {straight, turned}) {
        test::write_frame(next, planes, of_camera(true, matrix));
        using enum CameraMotion;
        for (const CameraMotion wanted : {none, missing, sky, zoom}) {
            settings_.camera_motion = wanted;
            EXPECT_EQ(header().sky.has_value(),
                      matrix == turned && (wanted == sky || wanted == zoom));
        }
    }
}

TEST_F(Source, VectorsInAnotherUnitAreDoubted) {
    const auto said = [&](const ImageF& motion) {
        Planes planes = make_planes(24, 16);
        planes.motion = motion;
        write(planes, of("generic"));
        return warnings(read());
    };
    const auto doubt = HasSubstr("every motion vector lies in 0..1: is the channel clamped");
    ImageF motion(24, 16, 2, 0.5f);
    EXPECT_THAT(said(motion), doubt);
    for (const float outside : {-0.1f, 1.1f}) {
        motion.at(3, 3, 1) = outside;
        EXPECT_THAT(said(motion), Not(doubt)) << outside;
    }
    // Zero everywhere has a warning of its own.
    EXPECT_THAT(said(ImageF(24, 16, 2)),
                AllOf(HasSubstr("every motion vector is zero"), Not(doubt)));
    // A profile that states the unit is believed.
    for (const char* form :
         {"unit: fraction", "scale: [2, 1]", "scale: [1, -2]", "bias: 0.5, scale: [1, 1]"}) {
        settings_.profile = fractions(form);
        EXPECT_THAT(said(ImageF(24, 16, 2, 0.75f)), Not(doubt)) << form;
    }
    settings_.profile = fractions("scale: [1, -1]");
    EXPECT_THAT(said(ImageF(24, 16, 2, 0.75f)), doubt);
}

// DWA packs channels by their last word: .R and .G, and of .X and .Y only .Y, as colors.
TEST_F(Source, VectorsStoredWithLossAreNamed) {
    const auto said = [&](const std::string& convention, io::ExrMethod method) {
        FrameFile file = of(convention);
        file.method = method;
        write(make_planes(24, 16), file);
        std::string text;
        for (const std::string& warning : header().warnings) text += warning + "\n";
        return text;
    };
    EXPECT_THAT(said("arnold", io::ExrMethod::dwaa),
                HasSubstr("f.exr: motion is stored with loss (dwaa: motionvector.G "
                          "motionvector.R); write depth and motion vectors as zip"));
    EXPECT_THAT(said("cycles", io::ExrMethod::dwab),
                AllOf(HasSubstr("motion_back is stored with loss (dwab: ViewLayer.Vector.Y)"),
                      Not(HasSubstr(": motion is"))));
    EXPECT_EQ(said("generic", io::ExrMethod::zip), "");
    EXPECT_EQ(said("arnold", io::ExrMethod::pxr24), "") << "its steps do not show";
}

// Vectors that lead to another shot are replaced by those of the frame's other side.
TEST_F(Source, MotionAcrossACutIsNotUsed) {
    Planes planes = make_planes(24, 16);
    for (float& value : planes.back.data) value *= 0.5f;
    const ImageF *motion = &planes.motion, *back = &planes.back, *none = nullptr;
    struct Case {
        const char* convention;
        std::set<int> cuts;
        const ImageF *motion, *back;
    };
    const Case cases[] = {
        {"cycles", {2}, motion, back},  {"cycles", {1}, back, none},  // the last of a shot
        {"cycles", {0}, motion, none},                                // the first
        {"cycles", {0, 1}, none, none},                               // a shot of its own
        {"nuke", {1}, back, none},      {"arnold", {0}, motion, none}, {"arnold", {1}, none, none},
    };
    for (const Case& one : cases) {
        SCOPED_TRACE(concat(one.convention, " ", testing::PrintToString(one.cuts)));
        write(planes, of(one.convention));
        settings_.cuts = one.cuts;
        const SourceFrame frame = read();
        EXPECT_EQ(frame.description.bounds.camera_cut, !one.motion);
        for (const auto& [role, expected] :
             {std::pair(Role::motion, one.motion), {Role::motion_back, one.back}})
            if (expected) {
                EXPECT_LE(test::largest_difference(*frame.planes.at(role), *expected), 1e-6);
            }
        EXPECT_EQ(frame.planes.count(Role::motion_back), one.back ? 1u : 0u);
    }
}

// A plane of another size would be cropped: the wrong quarter of it for a proxy.
TEST_F(Source, PlanesOfAnotherDisplayWindowAreRefused) {
    const auto open = [&](const FrameFile& data, int width, int height) {
        test::write_frame(folder_.path("color.exr"), make_planes(24, 16));
        test::write_frame(folder_.path("data.exr"), make_planes(width, height), data);
        return open_source_frame({},
                                 {{Role::color, folder_.path("color.exr")},
                                  {Role::inverse_depth, folder_.path("data.exr")}},
                                 1);
    };
    EXPECT_TRUE(open({}, 24, 16).ok());
    EXPECT_THAT(
        error_of(open({}, 48, 32)),
        AllOf(HasSubstr("data.exr: inverse_depth has display window (0, 0)-(47, 31), color"),
              HasSubstr("(0, 0)-(23, 15); render both at one size")));
    // Overscan of the same display window covers color.
    FrameFile overscan;
    overscan.origin_x = overscan.origin_y = -4;
    overscan.display = io::Window{0, 0, 23, 15};
    EXPECT_TRUE(open(overscan, 32, 24).ok());
    FrameFile anamorphic;
    anamorphic.attributes["pixelAspectRatio"] = 2.0f;
    EXPECT_THAT(must(open(anamorphic, 24, 16)).warnings,
                ElementsAre(HasSubstr("data.exr: inverse_depth has pixel aspect 2, color (")));
}

// Which planes are decoded is known before a pixel is read.
TEST_F(Source, WhatNobodyCanReadIsNotDecoded) {
    write(make_planes(24, 16));
    Chain chain = chain_from(test::kMotionBlur);
    const auto needed = [&](const PlanOptions& options = {}) {
        return planes_needed(chain, settings_, header(), options);
    };
    const RoleSet blur = {Role::color, Role::inverse_depth, Role::motion};
    EXPECT_EQ(needed(), blur);
    settings_.cuts = {0, 1};
    EXPECT_EQ(needed(), RoleSet());
    settings_.cuts = {2};
    EXPECT_EQ(needed(), blur);
    chain = chain_from(test::kMotionBlur, {"motion_blur.shutter_frames=0"});
    EXPECT_EQ(needed(), RoleSet());
    EXPECT_EQ(needed({.elide = false}), blur | RoleSet{Role::motion_back});
    const SourceFrame frame = read(needed());
    EXPECT_EQ(frame.planes.size(), 1u);
    EXPECT_TRUE(frame.warnings.empty());
    // Depth, motion, and motion back: 4, 8 and 8 bytes per pixel.
    uint64_t bytes = 0;
    for (const auto& elision : must(plan_source_frame(chain, frame, {})).elisions)
        if (elision.rule == kRuleUnusedPlane) bytes += elision.saving.bytes;
    EXPECT_EQ(bytes, 20u * 24 * 16);
}

// Depth at a place is read even if no step reads depth, and the plan states it.
TEST_F(Source, FocusAtAPlaceIsFoundInEachFrame) {
    write(make_planes(24, 16));
    camera(R"({"focal_length_mm": 50, "sensor_width_mm": 36, "f_stop": 1e9})");
    const Chain chain =
        chain_from("postchain: 1\npasses:\n  - depth_of_field: {focus_at: [0.25, 0.5]}\n");
    const SourceFrame frame = read(planes_needed(chain, settings_, header(), {}));
    const Plan plan = must(plan_source_frame(chain, frame, {}));
    const double w =
        inverse_depth_at(*frame.planes.at(Role::inverse_depth), frame.description, {0.25, 0.5});
    ASSERT_EQ(plan.inverse_depth_at.size(), 1u);
    EXPECT_EQ(plan.inverse_depth_at.begin()->second, w);
    EXPECT_THAT(json_text(plan_json(plan)),
                HasSubstr(R"("depth_at":[{"place":[0.25,0.5],"distance":)"));
}

// Depth of another encoding than the profile's gives surfaces before the near clip plane.
TEST_F(Source, DepthOfAnotherEncodingIsDoubted) {
    struct Case {
        const char* convention;
        double scale, power;  // of the stored depth
        std::optional<double> near;
        std::string said;  // empty: nothing
    };
    const Case cases[] = {
        {"nuke", 1, 1, 0.3, ""},
        {"nuke", 1, 1, 2.0, ""},
        // Distances of 2 and 6, or of the sky too, in the channel of 1/distance.
        {"nuke", 1, -1, 0.3, "read as 1/distance, is 0.167, before the near clip plane at 0.3"},
        {"nuke", 1, -1, 0.3, "is it a distance? Then give {profile=generic}"_keyed},
        {"nuke", 1e-9, -1, {}, "before the near clip plane; is it"},
        {"nuke", INFINITY, 1, {}, "read as 1/distance, is 0 everywhere: infinitely far"},
        // From 0 to 1 between the clip planes.
        {"generic", 1, 1, 0.3, ""},
        {"generic", 0.01, 1, 0.3, "read as distance, is 0.02, before the near clip plane at 0.3"},
        {"generic", 0.01, 1, 0.3, "is it a distance in scene units? Otherwise state its encoding"},
        {"generic", 0.01, 1, {}, ""},
    };
    for (const Case& one : cases) {
        SCOPED_TRACE(concat(one.convention, " ", one.scale, " ", one.power));
        Planes planes = make_planes(24, 16);
        for (float& depth : planes.depth.data)
            depth = float(one.scale * std::pow(double(depth), one.power));
        write(planes, of(one.convention));
        settings_.camera.emplace().camera.near_clip = one.near;
        const std::string said = warnings(read());
        EXPECT_THAT(said, HasSubstr(one.said));
        EXPECT_EQ(said.empty(), one.said.empty());
    }
}

// OpenEXR's `focus` is in meters (ImfStandardAttributes.h); the last stated meters_per_unit defines
// a scene unit.
TEST_F(Source, FocusOfTheMetadataIsInMeters) {
    FrameFile file;
    file.attributes["focus"] = 7.0f;
    write(make_planes(24, 16), file);
    // A stated distance is in scene units.
    for (const auto& [camera_file, chain_camera, focus] :
         {std::tuple{"{}", "{}", 7},
          {R"({"meters_per_unit": 0.01})", "{}", 700},
          {"{}", "{meters_per_unit: 0.5}", 14},
          {R"({"meters_per_unit": 0.01})", "{meters_per_unit: 0.5}", 14},
          {R"({"meters_per_unit": 0.01, "focus_distance": 3})", "{}", 3},
          {"{}", "{meters_per_unit: 0.5, focus_distance: 3}", 3},
          {R"({"focus_distance": 3})", "{meters_per_unit: 0.5}", 3}}) {
        camera(camera_file);
        const Chain chain =
            chain_from(concat("postchain: 1\ncamera: ", chain_camera, "\npasses: [fxaa]\n"));
        EXPECT_DOUBLE_EQ(*read().description.camera.overlaid_by(chain.camera).focus_distance, focus)
            << camera_file << chain_camera;
    }
}

TEST_F(Source, APlanThatFailsSaysWhatWasFound) {
    write(make_planes(24, 16), of("generic", false));
    const auto plan = plan_source_frame(chain_from(test::kMotionBlur), read(), {});
    EXPECT_EQ(plan.status().code(), StatusCode::input);
    for (const char* word : {"f.exr: ", "needs motion", "looked for as motion.x", "found were A B"})
        EXPECT_THAT(error_of(plan), HasSubstr(word));
}

TEST_F(Source, AMatrixThatIsNotUsedIsNamedWithTheReason) {
    const auto said = [&](const std::string& matrix, bool motion, CameraMotion wanted) {
        FrameFile file = of("generic", motion);
        if (!matrix.empty()) file.attributes["worldToCamera"] = matrix;
        write(make_planes(24, 16), file);
        settings_.camera_motion = wanted;
        const SourceFrame frame = read();
        const auto plan = plan_source_frame(chain_from(test::kMotionBlur), frame, {});
        EXPECT_EQ(plan.ok(), motion);
        return warnings(frame) + error_of(plan);
    };
    const std::string one = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";
    const std::pair<std::string, const char*> cases[] = {
        {"1 0 0 0 0 1 0 0 0 0 0 0 0 0 0 1", "worldToCamera (singular)"},
        {"nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1", "worldToCamera (not finite)"},
        {"1 0 0 0 0.5 1 0 0 0 0 1 0 0 0 0 1", "worldToCamera (its axes are not at right angles)"},
        {one, "worldToCamera (unknown focal length"},
    };
    using enum CameraMotion;
    for (const auto& [matrix, why] : cases) {
        for (const CameraMotion wanted : {missing, all})
            EXPECT_THAT(said(matrix, false, wanted),
                        AllOf(HasSubstr(why), HasSubstr("looked for as motion.x")));
        EXPECT_THAT(said(matrix, true, all),
                    AllOf(HasSubstr(why), HasSubstr("vectors are the file's own")));
        EXPECT_THAT(said(matrix, true, missing), Not(HasSubstr("worldToCamera")));
        EXPECT_THAT(said(matrix, false, none), Not(HasSubstr("worldToCamera")));
    }
    EXPECT_THAT(said("", false, all), Not(HasSubstr("matrix")));
    FrameFile two = of("generic", false);
    two.attributes["worldToCamera"] = std::string("left");
    two.attributes["cameraTransform"] = std::string("right");
    for (const bool one_is_good : {false, true}) {
        if (one_is_good) two.attributes["worldToCamera"] = one;
        two.depth = !one_is_good;
        write(make_planes(24, 16), two);
        settings_.camera_motion = missing;
        EXPECT_THAT(header().match.missing.at(Role::motion),
                    HasSubstr(one_is_good ? "not used: worldToCamera (no depth)"
                                          : "not used: worldToCamera (not 16 numbers), "
                                            "cameraTransform (not 16 numbers)"));
    }
}

TEST_F(Source, MotionOfTheCameraInPlaceOfMissingVectorsIsAWarning) {
    write(make_planes(24, 16), of("generic", false));
    camera(R"({"focal_length_mm": 40, "sensor_width_mm": 36, "camera_matrix_world": {
            "1": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]],
            "2": [[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0]]}})");
    const auto said = [&](CameraMotion wanted, RoleSet planes) {
        settings_.camera_motion = wanted;
        const SourceFrame frame = read(planes);
        EXPECT_EQ(frame.findings.motion_from_camera, planes.empty() ? 0u : 24u * 16);
        return frame.warnings;
    };
    EXPECT_THAT(said(CameraMotion::missing, kEverything),
                ElementsAre(AllOf(HasSubstr("f.exr: no motion vectors (looked for motion.x, "),
                                  HasSubstr("stay sharp"))));
    EXPECT_TRUE(said(CameraMotion::all, kEverything).empty());
    EXPECT_TRUE(said(CameraMotion::missing, {}).empty());
}

// A chain that reads fewer planes gets the same ones.
TEST_F(Source, APlaneDoesNotDependOnWhichOthersAreRead) {
    Planes planes = make_planes(24, 16);
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 24; ++x) {
            if (planes.depth.at(x, y) == 2) continue;
            planes.depth.at(x, y) = 1e10f;  // sky, whose vectors are not or half written
            for (int c = 0; c < 2; ++c) planes.motion.at(x, y, c) = 0;
            if (y < 8)
                for (int c = 0; c < 2; ++c) planes.back.at(x, y, c) = 0;
            planes.color.at(x, y, 3) = x == 5 ? 0.5f : 1;  // beside the square: a clear edge
        }
    FrameFile file;
    file.attributes["cycles.ViewLayer.samples"] = std::string("96");
    write(planes, file);
    for (const double later : {40, 50}) {  // mm: without a zoom, and with one
        camera(concat(R"({"sensor_width_mm": 36, "frames": {"1": {"focal_length_mm": 40},
            "2": {"focal_length_mm": )",
                      later, R"(}}, "camera_matrix_world": {"1": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
            "2": [[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]]}})"));
        const SourceFrame whole = read();
        EXPECT_GT(whole.findings.sky_motion_from_camera, 0u);
        EXPECT_GT(whole.findings.clear_edges, 0u);
        for (const RoleSet wanted :
             {RoleSet{Role::inverse_depth}, RoleSet{Role::motion}, RoleSet{Role::motion_back},
              RoleSet{Role::inverse_depth, Role::motion}, RoleSet{Role::motion, Role::motion_back}})
            for (const SourceFrame part = read(wanted); const auto& [role, plane] : part.planes)
                EXPECT_EQ(plane->data, whole.planes.at(role)->data)
                    << name_of(role) << " of " << wanted.text();
    }
}

// Cycles leaves a zoom out of its motion vectors. CameraMotion has the vectors that are added.
TEST_F(Source, AZoomIsAddedInFilesOfCyclesAndIfAskedFor) {
    Planes planes = make_planes(24, 16);
    const auto read = [&](CameraMotion wanted, bool of_cycles, const char* frames) {
        FrameFile file;
        if (of_cycles) file.attributes["cycles.ViewLayer.samples"] = std::string("96");
        write(planes, file);
        settings_.camera_motion = wanted;
        camera(concat(R"({"sensor_width_mm": 36, "focal_length_mm": 40, "frames": )", frames, "}"));
        return Source::read();
    };
    const char* zooms = R"({"1": {"focal_length_mm": 40}, "2": {"focal_length_mm": 50}})";
    const char* still = R"({"1": {"focal_length_mm": 40}, "2": {"focal_length_mm": 40}})";
    using enum CameraMotion;
    EXPECT_THAT(warnings(read(zoom, true, "{}")), HasSubstr("adds no zoom"));
    for (const CameraMotion wanted : {none, missing, sky, zoom, all})
        for (const bool of_cycles : {true, false})
            for (const char* lens : {zooms, still}) {
                SCOPED_TRACE(concat(int(wanted), of_cycles ? " Cycles " : " other ", lens));
                const SourceFrame frame = read(wanted, of_cycles, lens);
                EXPECT_THAT(warnings(frame), Not(HasSubstr("zoom")));
                const bool added = lens == zooms && wanted != none && (of_cycles || wanted == zoom);
                EXPECT_EQ(frame.findings.zoom_motion_added, added ? 24u * 16 : 0u);
                const ImageF& motion = *frame.planes.at(Role::motion);
                EXPECT_EQ(test::largest_difference(motion, planes.motion) > 1e-5, added);
            }
    planes.motion = planes.back = ImageF(24, 16, 2);  // only the lens moves
    EXPECT_THAT(warnings(read(missing, false, zooms)), HasSubstr("every motion vector is zero"));
    EXPECT_EQ(warnings(read(missing, true, zooms)), "");
}

// Straight alpha is multiplied on input and divided on output. Clear pixels have a color in such a
// file, and keep it if no light reaches them.
TEST(StraightAlpha, ComesBack) {
    ConvertOptions options;
    options.unpremultiplied = true;
    ImageF stored(4, 1, 4), filtered(4, 1, 4);
    stored.data = {0, 0, 0, 0, 0.2f, 0.4f, 0.6f, 0, 0.2f, 0.4f, NAN, 0, 0.2f, 0.4f, 0.6f, 1};
    filtered.data = {0.25f, 0.5f, 1, 0.5f, 0, 0, 0, 0, 0, 7, 0, 0, 0, 0, 0, 0};
    ImageF same = filtered;
    to_file_convention(same, {}, stored);
    EXPECT_EQ(same.data, filtered.data);
    to_file_convention(filtered, options, stored);
    EXPECT_EQ(filtered.data, (std::vector<float>{0.5f, 1, 2, 0.5f, 0.2f, 0.4f, 0.6f, 0, 0.2f, 7, 0,
                                                 0, 0, 0, 0, 0}));
}

}  // namespace
}  // namespace postchain::sequence
