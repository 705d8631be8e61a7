// One frame from its files to the canonical frame.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "chain/depth_at.h"
#include "chain/plan_print.h"
#include "config/chain_file.h"
#include "config/profile.h"
#include "passes/registry.h"
#include "tests/command/frames.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain::sequence {
namespace {

using test::FrameFile;
using test::make_planes;
using test::Planes;
using test::TempFolder;

constexpr RoleSet kEverything = {Role::inverse_depth, Role::motion, Role::motion_back};

Result<SourceFrame> source_of(const std::string& path, const SourceSettings& settings = {},
                              RoleSet wanted = kEverything) {
    auto header = open_source_frame(settings, {{Role::color, path}}, 1);
    if (!header.ok()) return header.status();
    return read_source_frame(settings, std::move(*header), wanted, io::Keep::nothing);
}

// The tables of docs/frame.md, checked on the planes and not on a filter's result.
TEST(Source, EveryConventionGivesTheCanonicalPlanes) {
    TempFolder folder;
    const Planes planes = make_planes(24, 16);
    for (const std::string name : {"cycles", "nuke", "arnold", "vray", "generic"}) {
        FrameFile file;
        file.convention = name;
        test::write_frame(folder.path("f.exr"), planes, file);
        const auto frame = source_of(folder.path("f.exr"));
        ASSERT_TRUE(frame.ok()) << frame.status().message();
        EXPECT_EQ(frame->match.profile, name);
        EXPECT_EQ(frame->planes.at(Role::color)->data, planes.color.data) << name;
        EXPECT_LE(test::largest_difference(*frame->planes.at(Role::motion), planes.motion), 1e-6);
        const auto& w = *frame->planes.at(Role::inverse_depth);
        for (size_t i = 0; i < w.pixels(); ++i)
            ASSERT_NEAR(w.data[i], 1 / planes.depth.data[i], 1e-6) << name;
        if (frame->planes.count(Role::motion_back)) {
            EXPECT_LE(test::largest_difference(*frame->planes.at(Role::motion_back), planes.back),
                      1e-6)
                << name;
        } else {
            EXPECT_TRUE(name == "arnold" || name == "vray") << name;
        }
        EXPECT_NEAR(frame->description.bounds.max_speed_px, std::sqrt(45.0), 1e-5) << name;
    }
}

// A renderer divides by the size of its image: the display window, or its overscan. A crop of the
// file, or of what is filtered, changes no vector.
TEST(Source, FractionsAreOfTheWholeImage) {
    TempFolder folder;
    SourceSettings settings;
    const ProfileFile profile = parse_profile(
        "profile: 1\nname: uv\ncolor: [{channels: [[R, G, B, A]]}]\n"
        "motion: [{channels: [[motion.x, motion.y]], unit: fraction}]\n",
        "uv.yaml");
    ASSERT_TRUE(profile.status().ok()) << profile.status().message();
    settings.profile = profile.profile;
    FrameFile file;
    file.convention = "generic";
    struct Case {
        io::Window data, display;
        int width, height;  // of the image
    };
    for (const Case& one :
         {Case{{0, 0, 23, 15}, {0, 0, 23, 15}, 24, 16}, Case{{4, 2, 19, 9}, {0, 0, 39, 31}, 40, 32},
          Case{{-4, -2, 27, 17}, {0, 0, 23, 15}, 32, 20}}) {
        SCOPED_TRACE(one.data.text() + " of " + one.display.text());
        file.origin_x = one.data.min_x;
        file.origin_y = one.data.min_y;
        file.display = one.display;
        test::write_frame(folder.path("f.exr"), make_planes(one.data.width(), one.data.height()),
                          file);
        for (const DataWindow window : {DataWindow::grow, DataWindow::keep}) {
            settings.data_window = window;
            const auto frame = source_of(folder.path("f.exr"), settings);
            ASSERT_TRUE(frame.ok()) << frame.status().message();
            const ImageF& motion = *frame->planes.at(Role::motion);
            const int x = one.data.min_x - frame->input.window.min_x,
                      y = one.data.min_y - frame->input.window.min_y;
            EXPECT_FLOAT_EQ(motion.at(x, y, 0), -2 * one.width);
            EXPECT_FLOAT_EQ(motion.at(x, y, 1), 1 * one.height);
        }
    }
}

// Vectors that lead to another shot are replaced by those of the frame's other side.
TEST(Source, MotionAcrossACutIsNotUsed) {
    TempFolder folder;
    Planes planes = make_planes(24, 16);
    for (float& value : planes.back.data) value *= 0.5f;
    const auto is = [&](const std::set<int>& cuts, const ImageF* motion, const ImageF* back) {
        SourceSettings settings;
        settings.cuts = cuts;
        const auto frame = source_of(folder.path("f.exr"), settings);
        ASSERT_TRUE(frame.ok()) << frame.status().message();
        EXPECT_EQ(frame->description.bounds.camera_cut, !motion);
        ASSERT_EQ(frame->planes.count(Role::motion_back), back ? 1u : 0u);
        if (motion) {
            EXPECT_LE(test::largest_difference(*frame->planes.at(Role::motion), *motion), 1e-6);
        }
        if (back) {
            EXPECT_LE(test::largest_difference(*frame->planes.at(Role::motion_back), *back), 1e-6);
        }
    };
    for (const char* convention : {"cycles", "nuke"}) {
        SCOPED_TRACE(convention);
        FrameFile file;
        file.convention = convention;
        test::write_frame(folder.path("f.exr"), planes, file);
        is({2}, &planes.motion, &planes.back);
        is({1}, &planes.back, nullptr);    // the last of a shot
        is({0}, &planes.motion, nullptr);  // the first
        is({0, 1}, nullptr, nullptr);      // a shot of its own
    }
    FrameFile file;
    file.convention = "arnold";
    test::write_frame(folder.path("f.exr"), planes, file);
    is({0}, &planes.motion, nullptr);
    is({1}, nullptr, nullptr);
}

TEST(Source, OnlyWhatIsWantedIsRead) {
    TempFolder folder;
    test::write_frame(folder.path("f.exr"), make_planes(24, 16));
    const auto frame = source_of(folder.path("f.exr"), {}, {});
    ASSERT_TRUE(frame.ok());
    EXPECT_EQ(frame->planes.size(), 1u);
    EXPECT_TRUE(frame->warnings.empty());
}

// A plane of another size would be cropped: the wrong quarter of it for a proxy.
TEST(Source, PlanesOfAnotherDisplayWindowAreRefused) {
    TempFolder folder;
    const auto open = [&](const FrameFile& data, int width, int height) {
        test::write_frame(folder.path("color.exr"), make_planes(24, 16));
        test::write_frame(folder.path("data.exr"), make_planes(width, height), data);
        return open_source_frame({},
                                 {{Role::color, folder.path("color.exr")},
                                  {Role::inverse_depth, folder.path("data.exr")}},
                                 1);
    };
    EXPECT_TRUE(open({}, 24, 16).ok());
    EXPECT_EQ(open({}, 48, 32).status().message(),
              folder.path("data.exr") +
                  ": inverse_depth has display window (0, 0)-(47, 31), color (" +
                  folder.path("color.exr") + ") (0, 0)-(23, 15); render both at one size");
    // Overscan of the same display window covers color.
    FrameFile overscan;
    overscan.origin_x = overscan.origin_y = -4;
    overscan.display = io::Window{0, 0, 23, 15};
    EXPECT_TRUE(open(overscan, 32, 24).ok());
    FrameFile anamorphic;
    anamorphic.attributes["pixelAspectRatio"] = 2.0f;
    const auto header = open(anamorphic, 24, 16);
    ASSERT_TRUE(header.ok()) << header.status().message();
    ASSERT_EQ(header->warnings.size(), 1u);
    EXPECT_NE(header->warnings[0].find("data.exr: inverse_depth has pixel aspect 2, color ("),
              std::string::npos)
        << header->warnings[0];
}

// Which planes are decoded is known before a pixel is read.
TEST(Source, WhatNobodyCanReadIsNotDecoded) {
    TempFolder folder;
    test::write_frame(folder.path("f.exr"), make_planes(24, 16));
    SourceSettings settings;
    auto chain = parse_chain(test::kMotionBlur, "chain.yaml", builtin_passes());
    const auto needed = [&](const PlanOptions& options = {}) {
        auto header = open_source_frame(settings, {{Role::color, folder.path("f.exr")}}, 1);
        return planes_needed(chain.chain, settings, *header, options);
    };
    const RoleSet blur = {Role::color, Role::inverse_depth, Role::motion};
    EXPECT_EQ(needed(), blur);
    settings.cuts = {0, 1};
    EXPECT_EQ(needed(), RoleSet());
    settings.cuts = {2};
    EXPECT_EQ(needed(), blur);
    chain = parse_chain(test::kMotionBlur, "chain.yaml", builtin_passes(),
                        {"motion_blur.shutter_frames=0"});
    EXPECT_EQ(needed(), RoleSet());
    PlanOptions whole;
    whole.elide = false;
    EXPECT_EQ(needed(whole), blur | RoleSet{Role::motion_back});

    const auto frame = source_of(folder.path("f.exr"), settings, needed());
    ASSERT_TRUE(frame.ok());
    EXPECT_EQ(frame->planes.size(), 1u);
    const auto plan = plan_source_frame(chain.chain, *frame, {});
    ASSERT_TRUE(plan.ok()) << plan.status().message();
    uint64_t bytes = 0;
    for (const auto& elision : plan->elisions) {
        if (elision.rule == kRuleUnusedPlane) bytes += elision.saving.bytes;
        if (elision.kind == ElisionKind::pass && elision.pass == 0) {
            EXPECT_GT(elision.saving.dispatches, 3);
        }
    }
    // Depth, motion, and motion back: 4, 8 and 8 bytes per pixel.
    EXPECT_EQ(bytes, 20u * 24 * 16);
}

// Depth at a place is read even if no step reads depth, and the plan states it.
TEST(Source, FocusAtAPlaceIsFoundInEachFrame) {
    TempFolder folder;
    test::write_frame(folder.path("f.exr"), make_planes(24, 16));
    SourceSettings settings;
    settings.camera = parse_camera(
        R"({"focal_length_mm": 50, "sensor_width_mm": 36, "f_stop": 1e9})", "camera.json");
    const auto chain =
        parse_chain("postchain: 1\npasses:\n  - depth_of_field: {focus_at: [0.25, 0.5]}\n",
                    "chain.yaml", builtin_passes());
    ASSERT_TRUE(chain.status().ok()) << chain.status().message();
    auto header = open_source_frame(settings, {{Role::color, folder.path("f.exr")}}, 1);
    const auto frame = source_of(folder.path("f.exr"), settings,
                                 planes_needed(chain.chain, settings, *header, {}));
    ASSERT_TRUE(frame.ok());
    const auto plan = plan_source_frame(chain.chain, *frame, {});
    ASSERT_TRUE(plan.ok()) << plan.status().message();
    const double w =
        inverse_depth_at(*frame->planes.at(Role::inverse_depth), frame->description, {0.25, 0.5});
    ASSERT_EQ(plan->inverse_depth_at.size(), 1u);
    EXPECT_EQ(plan->inverse_depth_at.begin()->second, w);
    EXPECT_NE(json_text(plan_json(*plan)).find(R"("depth_at":[{"place":[0.25,0.5],"distance":)"),
              std::string::npos)
        << json_text(plan_json(*plan));
}

// Depth of another encoding than the profile's gives surfaces before the near clip plane.
TEST(Source, DepthOfAnotherEncodingIsDoubted) {
    TempFolder folder;
    const auto warnings = [&](const std::string& convention, double scale, double power,
                              std::optional<double> near) {
        Planes planes = make_planes(24, 16);
        for (float& depth : planes.depth.data)
            depth = float(scale * std::pow(double(depth), power));
        FrameFile file;
        file.convention = convention;
        test::write_frame(folder.path("f.exr"), planes, file);
        SourceSettings settings;
        if (near) settings.camera.emplace().camera.near_clip = near;
        const auto frame = source_of(folder.path("f.exr"), settings);
        EXPECT_TRUE(frame.ok()) << frame.status().message();
        std::string text;
        for (const std::string& warning : frame->warnings) text += warning;
        return text;
    };
    using ::testing::HasSubstr;
    EXPECT_EQ(warnings("nuke", 1, 1, 0.3), "");
    EXPECT_EQ(warnings("nuke", 1, 1, 2.0), "");
    // Distances of 2 and 6, or of the sky too, in the channel of 1/distance.
    EXPECT_THAT(warnings("nuke", 1, -1, 0.3),
                HasSubstr("f.exr: the nearest depth, read as 1/distance, is 0.167, before the near "
                          "clip plane at 0.3; is it a distance? Then give --profile generic"));
    EXPECT_THAT(warnings("nuke", 1e-9, -1, {}), HasSubstr("before the near clip plane; is it"));
    EXPECT_THAT(warnings("nuke", std::numeric_limits<double>::infinity(), 1, {}),
                HasSubstr("depth, read as 1/distance, is 0 everywhere: infinitely far"));
    // From 0 to 1 between the clip planes.
    EXPECT_EQ(warnings("generic", 1, 1, 0.3), "");
    EXPECT_THAT(warnings("generic", 0.01, 1, 0.3),
                HasSubstr("read as distance, is 0.02, before the near clip plane at 0.3; is it a "
                          "distance in scene units?"));
    EXPECT_EQ(warnings("generic", 0.01, 1, {}), "");
}

TEST(Source, CameraFileOverMetadata) {
    TempFolder folder;
    FrameFile file;
    file.attributes["aperture"] = 2.0f;
    file.attributes["focus"] = 7.0f;
    test::write_frame(folder.path("f.exr"), make_planes(24, 16), file);
    SourceSettings settings;
    settings.camera = parse_camera(
        R"({"focus_distance": 3, "resolution": [99, 9], "frames": {"1": {"near_clip": 0.25}}})",
        "camera.json");
    ASSERT_TRUE(settings.camera->status().ok());
    const auto frame = source_of(folder.path("f.exr"), settings);
    ASSERT_TRUE(frame.ok()) << frame.status().message();
    EXPECT_EQ(frame->description.camera.f_stop, 2.0);
    EXPECT_EQ(frame->description.camera.focus_distance, 3.0);
    EXPECT_EQ(frame->description.camera.near_clip, 0.25);
    ASSERT_EQ(frame->warnings.size(), 1u);  // about the resolution
    EXPECT_NE(frame->warnings[0].find("resolution"), std::string::npos) << frame->warnings[0];
}

// OpenEXR's `focus` is in meters (ImfStandardAttributes.h); the last stated meters_per_unit defines
// a scene unit.
TEST(Source, FocusOfTheMetadataIsInMeters) {
    TempFolder folder;
    FrameFile file;
    file.attributes["focus"] = 7.0f;
    test::write_frame(folder.path("f.exr"), make_planes(24, 16), file);
    SourceSettings settings;
    const auto focus_of = [&](const char* camera_file, const char* chain_camera) {
        settings.camera = parse_camera(camera_file, "camera.json");
        EXPECT_TRUE(settings.camera->status().ok());
        const auto frame = source_of(folder.path("f.exr"), settings);
        EXPECT_TRUE(frame.ok()) << frame.status().message();
        const auto chain =
            parse_chain(concat("postchain: 1\ncamera: ", chain_camera, "\npasses: [fxaa]\n"),
                        "chain.yaml", builtin_passes());
        EXPECT_TRUE(chain.status().ok());
        return *frame->description.camera.overlaid_by(chain.chain.camera).focus_distance;
    };
    EXPECT_DOUBLE_EQ(focus_of("{}", "{}"), 7);
    EXPECT_DOUBLE_EQ(focus_of(R"({"meters_per_unit": 0.01})", "{}"), 700);
    EXPECT_DOUBLE_EQ(focus_of("{}", "{meters_per_unit: 0.5}"), 14);
    EXPECT_DOUBLE_EQ(focus_of(R"({"meters_per_unit": 0.01})", "{meters_per_unit: 0.5}"), 14);
    // A stated distance is in scene units.
    EXPECT_DOUBLE_EQ(focus_of(R"({"meters_per_unit": 0.01, "focus_distance": 3})", "{}"), 3);
    EXPECT_DOUBLE_EQ(focus_of("{}", "{meters_per_unit: 0.5, focus_distance: 3}"), 3);
    EXPECT_DOUBLE_EQ(focus_of(R"({"focus_distance": 3})", "{meters_per_unit: 0.5}"), 3);
}

TEST(Source, APlanThatFailsSaysWhatWasFound) {
    TempFolder folder;
    FrameFile file;
    file.convention = "generic";
    file.motion = false;
    test::write_frame(folder.path("f.exr"), make_planes(24, 16), file);
    const auto frame = source_of(folder.path("f.exr"));
    ASSERT_TRUE(frame.ok());
    const auto chain = parse_chain(test::kMotionBlur, "chain.yaml", builtin_passes());
    const auto plan = plan_source_frame(chain.chain, *frame, {});
    ASSERT_FALSE(plan.ok());
    EXPECT_EQ(plan.status().code(), StatusCode::input);
    for (const char* word : {"f.exr: ", "needs motion", "looked for as motion.x", "found were A B"})
        EXPECT_NE(plan.status().message().find(word), std::string::npos) << plan.status().message();
}

TEST(Source, AMatrixThatIsNotUsedIsNamedWithTheReason) {
    TempFolder folder;
    const auto said = [&](const std::string& matrix, bool motion, CameraMotion wanted) {
        FrameFile file;
        file.convention = "generic";
        file.motion = motion;
        if (!matrix.empty()) file.attributes["worldToCamera"] = matrix;
        test::write_frame(folder.path("f.exr"), make_planes(24, 16), file);
        SourceSettings settings;
        settings.camera_motion = wanted;
        const auto frame = source_of(folder.path("f.exr"), settings);
        EXPECT_TRUE(frame.ok()) << frame.status().message();
        std::string text;
        for (const std::string& warning : frame->warnings) text += warning + "\n";
        const auto chain = parse_chain(test::kMotionBlur, "chain.yaml", builtin_passes());
        const auto plan = plan_source_frame(chain.chain, *frame, {});
        EXPECT_EQ(plan.ok(), motion);
        return text + plan.status().message();
    };
    const std::string one = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";
    const std::pair<std::string, const char*> cases[] = {
        {"1 0 0 0 0 1 0 0 0 0 0 0 0 0 0 1", "worldToCamera (singular)"},
        {"nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1", "worldToCamera (not finite)"},
        {"1 0 0 0 0.5 1 0 0 0 0 1 0 0 0 0 1", "worldToCamera (its axes are not at right angles)"},
        {one, "worldToCamera (unknown focal length"},
    };
    const auto has = [](const std::string& text, const char* what) {
        return text.find(what) != std::string::npos;
    };
    for (const auto& [matrix, why] : cases) {
        for (const CameraMotion wanted : {CameraMotion::missing, CameraMotion::all}) {
            const std::string text = said(matrix, false, wanted);
            EXPECT_TRUE(has(text, why) && has(text, "looked for as motion.x")) << text;
        }
        const std::string text = said(matrix, true, CameraMotion::all);
        EXPECT_TRUE(has(text, why) && has(text, "vectors are the file's own")) << text;
        EXPECT_FALSE(has(said(matrix, true, CameraMotion::missing), "worldToCamera"));
        EXPECT_FALSE(has(said(matrix, false, CameraMotion::none), "worldToCamera"));
    }
    EXPECT_FALSE(has(said("", false, CameraMotion::all), "matrix"));
}

TEST(Source, MotionOfTheCameraInPlaceOfMissingVectorsIsAWarning) {
    TempFolder folder;
    FrameFile file;
    file.convention = "generic";
    file.motion = false;
    test::write_frame(folder.path("f.exr"), make_planes(24, 16), file);
    SourceSettings settings;
    settings.camera = parse_camera(
        R"({"focal_length_mm": 40, "sensor_width_mm": 36, "camera_matrix_world": {
            "1": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]],
            "2": [[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0]]}})",
        "camera.json");
    const auto said = [&](CameraMotion wanted, RoleSet planes) {
        settings.camera_motion = wanted;
        const auto frame = source_of(folder.path("f.exr"), settings, planes);
        EXPECT_TRUE(frame.ok()) << frame.status().message();
        EXPECT_EQ(frame->surface_health.motion_from_camera, planes.empty() ? 0u : 24u * 16);
        return frame->warnings;
    };
    const auto warnings = said(CameraMotion::missing, kEverything);
    ASSERT_EQ(warnings.size(), 1u);
    for (const char* word : {"f.exr: no motion vectors (looked for motion.x, ", "stay sharp"})
        EXPECT_NE(warnings[0].find(word), std::string::npos) << warnings[0];
    EXPECT_TRUE(said(CameraMotion::all, kEverything).empty());
    EXPECT_TRUE(said(CameraMotion::missing, {}).empty());
}

// A chain that reads fewer planes gets the same ones.
TEST(Source, APlaneDoesNotDependOnWhichOthersAreRead) {
    TempFolder folder;
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
    file.convention = "cycles";
    file.attributes["cycles.ViewLayer.samples"] = std::string("96");
    test::write_frame(folder.path("f.exr"), planes, file);
    SourceSettings settings;
    for (const char* camera :
         {R"({"focal_length_mm": 40, "sensor_width_mm": 36, "camera_matrix_world": {
              "1": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "2": [[0.8, 0, 0.6], [0, 1, 0],
              [-0.6, 0, 0.8]]}})",
          R"({"sensor_width_mm": 36, "frames": {"1": {"focal_length_mm": 40},
              "2": {"focal_length_mm": 50}}, "camera_matrix_world": {
              "1": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "2": [[0.8, 0, 0.6], [0, 1, 0],
              [-0.6, 0, 0.8]]}})"}) {
        settings.camera = parse_camera(camera, "camera.json");
        ASSERT_TRUE(settings.camera->status().ok()) << settings.camera->status().message();
        const auto whole = source_of(folder.path("f.exr"), settings);
        ASSERT_TRUE(whole.ok()) << whole.status().message();
        EXPECT_GT(whole->surface_health.sky_motion_from_camera, 0u);
        EXPECT_GT(whole->surface_health.clear_edges, 0u);
        for (const RoleSet wanted :
             {RoleSet{Role::inverse_depth}, RoleSet{Role::motion}, RoleSet{Role::motion_back},
              RoleSet{Role::inverse_depth, Role::motion},
              RoleSet{Role::motion, Role::motion_back}}) {
            const auto part = source_of(folder.path("f.exr"), settings, wanted);
            ASSERT_TRUE(part.ok()) << part.status().message();
            for (const auto& [role, plane] : part->planes)
                EXPECT_EQ(plane->data, whole->planes.at(role)->data)
                    << name_of(role) << " of " << wanted.text();
        }
    }
}

// Cycles leaves a zoom out of its motion vectors.
TEST(Source, AZoomIsAddedInFilesOfCyclesAndIfAskedFor) {
    TempFolder folder;
    const Planes planes = make_planes(24, 16);
    Planes still_planes = planes;  // only the lens moves
    for (ImageF* plane : {&still_planes.motion, &still_planes.back})
        std::fill(plane->data.begin(), plane->data.end(), 0.0f);
    bool all_still = false;
    const auto read = [&](CameraMotion wanted, bool of_cycles, const char* frames) {
        FrameFile file;
        file.convention = "cycles";
        if (of_cycles) file.attributes["cycles.ViewLayer.samples"] = std::string("96");
        test::write_frame(folder.path("f.exr"), all_still ? still_planes : planes, file);
        SourceSettings settings;
        settings.camera_motion = wanted;
        settings.camera = parse_camera(
            concat(R"({"sensor_width_mm": 36, "focal_length_mm": 40, "frames": )", frames, "}"),
            "camera.json");
        auto frame = source_of(folder.path("f.exr"), settings);
        EXPECT_TRUE(frame.ok()) << frame.status().message();
        return std::move(*frame);
    };
    const auto said = [](const SourceFrame& frame) {
        std::string text;
        for (const std::string& warning : frame.warnings) text += warning + "\n";
        return text;
    };
    const char* zooms = R"({"1": {"focal_length_mm": 40}, "2": {"focal_length_mm": 50}})";
    const char* still = R"({"1": {"focal_length_mm": 40}, "2": {"focal_length_mm": 40}})";
    using enum CameraMotion;
    EXPECT_NE(said(read(zoom, true, "{}")).find("adds no zoom"), std::string::npos);
    for (const CameraMotion wanted : {none, missing, sky, zoom, all})
        for (const bool of_cycles : {true, false})
            for (const char* lens : {zooms, still}) {
                SCOPED_TRACE(concat(int(wanted), of_cycles ? " Cycles " : " other ", lens));
                const SourceFrame frame = read(wanted, of_cycles, lens);
                EXPECT_EQ(said(frame).find("zoom"), std::string::npos) << said(frame);
                const bool added = lens == zooms && wanted != none && (of_cycles || wanted == zoom);
                EXPECT_EQ(frame.surface_health.zoom_motion_added, added ? 24u * 16 : 0u);
                const ImageF& motion = *frame.planes.at(Role::motion);
                for (int y = 0; y < 16; ++y)
                    for (int x = 0; x < 24; ++x)
                        for (int c = 0; c < 2; ++c) {
                            const double own = planes.motion.at(x, y, c);
                            const double at = c == 0 ? x + 0.5 - 12 : y + 0.5 - 8;
                            ASSERT_NEAR(motion.at(x, y, c), added ? 1.25 * own + 0.25 * at : own,
                                        1e-5);
                        }
            }
    all_still = true;
    EXPECT_NE(said(read(missing, false, zooms)).find("every motion vector is zero"),
              std::string::npos);
    EXPECT_EQ(said(read(missing, true, zooms)), "");
}

// Straight alpha is multiplied on input and divided on output; pixels with alpha 0 are unchanged.
TEST(Source, StraightAlphaComesBack) {
    ConvertOptions options;
    options.unpremultiplied = true;
    ImageF color(2, 1, 4);
    color.data = {0.25f, 0.5f, 1, 0.5f, 3, 4, 5, 0};
    ImageF stored(2, 1, 4, 0.0f);
    to_file_convention(color, options, stored);
    EXPECT_EQ(color.data, (std::vector<float>{0.5f, 1, 2, 0.5f, 3, 4, 5, 0}));
    ImageF same = color;
    to_file_convention(same, {}, stored);
    EXPECT_EQ(same.data, color.data);
}

// Clear pixels have a color in such a file, and keep it if no light reaches them.
TEST(Source, ClearPixelsOfStraightAlphaKeepTheirColor) {
    ConvertOptions options;
    options.unpremultiplied = true;
    ImageF stored(3, 1, 4), filtered(3, 1, 4);
    stored.data = {0.2f, 0.4f, 0.6f, 0, 0.2f, 0.4f, NAN, 0, 0.2f, 0.4f, 0.6f, 1};
    filtered.data = {0, 0, 0, 0, 0, 7, 0, 0, 0, 0, 0, 0};
    to_file_convention(filtered, options, stored);
    EXPECT_EQ(filtered.data, (std::vector<float>{0.2f, 0.4f, 0.6f, 0, 0.2f, 7, 0, 0, 0, 0, 0, 0}));
}

}  // namespace
}  // namespace postchain::sequence
