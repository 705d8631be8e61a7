// Values in the table of job settings reach the run.
#include "tools/sequence/settings/job_settings.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "passes/registry.h"

namespace postchain::sequence {
namespace {

const ParameterTable& table() {
    static const ParameterTable made = job_parameters(builtin_passes());
    return made;
}

Result<RunSettings> settings_of(const std::vector<std::pair<std::string, ParameterValue>>& values) {
    JobSettings job;
    job.input = "in.####.exr";
    for (const auto& [key, value] : values) {
        const Status status = table().set(&job, key, value);
        EXPECT_TRUE(status.ok()) << status.message();
    }
    Diagnostics notes;
    return parse_job(job, builtin_passes(), notes);
}

TEST(JobSettings, EveryRowSaysWhatItIs) {
    const std::set<std::string> groups = {kInputGroup, kLayerGroup, kPlanGroup, kOutputGroup,
                                          kWatchGroup};
    std::set<std::string> keys;
    for (const Parameter& row : table().rows()) {
        EXPECT_TRUE(keys.insert(row.key).second) << row.key;
        EXPECT_FALSE(row.help.empty()) << row.key;
        EXPECT_TRUE(groups.contains(row.group)) << row.key;
        EXPECT_EQ(row.optional, !row.unset_means.empty()) << row.key;
    }
    EXPECT_GE(keys.size(), 20u);
    // The parts of the help that have few.
    const auto in_group = [](const char* group) {
        std::vector<std::string> found;
        for (const Parameter& row : table().rows())
            if (row.group == std::string(group)) found.push_back(row.key);
        return found;
    };
    using Keys = std::vector<std::string>;
    EXPECT_EQ(in_group(kLayerGroup), (Keys{"aovs", "cryptomatte", "fill_mask"}));
    EXPECT_EQ(in_group(kPlanGroup), (Keys{"precision", "no_elide", "elide"}));
    EXPECT_EQ(in_group(kWatchGroup), (Keys{"watch", "idle"}));
}

TEST(JobSettings, DefaultsAreThoseOfARun) {
    const auto settings = settings_of({});
    ASSERT_TRUE(settings.ok()) << settings.status().message();
    const auto choices = [](const RunSettings& s) {
        return std::tuple(s.on_existing, s.overflow, s.missing, s.on_error, s.strict, s.sidecar,
                          s.preview, s.dump_folder, s.source.nonfinite_color, s.plan.precision,
                          s.plan.elide, s.plan.rules_off, s.plan.rules_on);
    };
    EXPECT_EQ(choices(*settings), choices(RunSettings()));
    EXPECT_FALSE(settings->frames || settings->source.profile || settings->source.camera);
}

TEST(JobSettings, EachValueArrives) {
    const std::string on("missing_plane"), off("sky_blocks");
    const std::vector<std::pair<std::string, ParameterValue>> values = {
        {"behind", "behind.####.exr"},
        {"frames", "3-5"},
        {"cuts", "4"},
        {"profile", "cycles"},
        {"view_layer", "two"},
        {"view", "left"},
        {"nonfinite", "zero"},
        {"data_window", "keep"},
        {"camera_motion", "zoom"},
        {"max_memory", "64M"},
        {"input_transfer", "cineon"},
        {"aovs", "diffuse"},
        {"cryptomatte", "filter=hero,tree_*"},
        {"fill_mask", "fill"},
        {"precision", "fp16"},
        {"no_elide", off},
        {"elide", on},
        {"chunk", "2/3"},
        {"output", "out/o.####.exr"},
        {"mkdir", true},
        {"on_existing", "overwrite"},
        {"missing", "hold"},
        {"on_error", "continue"},
        {"overflow", "clamp"},
        {"compression", "dwab:9"},
        {"half", true},
        {"channels", "R,*.Z"},
        {"output_transfer", "rec709"},
        {"bits", "12"},
        {"strict", true},
        {"sidecar", false},
        {"png", true},
        {"dump_stages", "stages"}};
    const auto settings = settings_of(values);
    ASSERT_TRUE(settings.ok()) << settings.status().message();
    // The other rows name files that are read here, or exclude one of these.
    std::set<std::string> tried = {"input",           "camera",       "ocio",
                                   "ocio_colorspace", "ocio_display", "ocio_view"},
                          recorded = {"input"}, given;
    for (const auto& [key, value] : values) tried.insert(key);
    for (const Parameter& row : table().rows())
        EXPECT_TRUE(tried.contains(row.key) || row.group == kWatchGroup) << row.key;
    // A record repeats what decides the pixels of a frame.
    for (const auto& [key, value] : values) recorded.insert(key);
    for (const char* key : {"frames", "chunk", "max_memory", "output", "mkdir", "on_existing",
                            "on_error", "missing", "sidecar", "png", "dump_stages"})
        recorded.erase(key);
    for (const auto& [key, value] : settings->given) given.insert(key);
    EXPECT_EQ(given, recorded);
    const auto watch = settings_of({{"watch", true}, {"idle", 9.0}});
    ASSERT_TRUE(watch.ok()) << watch.status().message();
    EXPECT_EQ(watch->watch->idle_s, 9);
    EXPECT_FALSE(settings->watch);
    EXPECT_EQ(settings->source.data_window, DataWindow::keep);
    EXPECT_EQ(settings->source.camera_motion, CameraMotion::zoom);
    EXPECT_EQ(settings->source.max_memory, uint64_t(64) << 20);
    EXPECT_EQ(std::get<io::Curve>(*settings->source.input_transfer), io::Curve::cineon);
    EXPECT_EQ(settings->source.layers.aovs, "diffuse");
    EXPECT_EQ(settings->source.layers.cryptomatte, CryptomatteChoice::filter);
    EXPECT_EQ(settings->source.layers.ids, (std::vector<std::string>{"hero", "tree_*"}));
    EXPECT_EQ(settings->source.layers.fill_mask, "fill");
    EXPECT_EQ(std::pair(settings->chunk.index, settings->chunk.count), std::pair(2, 3));
    EXPECT_TRUE(settings->make_folder);
    EXPECT_EQ(std::get<io::Curve>(*settings->picture.transfer), io::Curve::rec709);
    EXPECT_EQ(settings->picture.bits, 12);
    EXPECT_EQ(settings->input.color().text(), "in.####.exr");
    EXPECT_EQ(settings->input.patterns.at(Role::behind).text(), "behind.####.exr");
    EXPECT_EQ(settings->frames->frames, (std::vector<int>{3, 4, 5}));
    EXPECT_EQ(settings->source.cuts, std::set<int>{4});
    EXPECT_EQ(settings->source.profile->name, "cycles");
    EXPECT_EQ(settings->source.view_layer, "two");
    EXPECT_EQ(settings->source.view, "left");
    EXPECT_EQ(settings->source.nonfinite_color, NonfiniteColor::zero);
    EXPECT_EQ(settings->plan.precision, Precision::fp16);
    EXPECT_EQ(settings->plan.rules_off, std::set<std::string>{off});
    EXPECT_EQ(settings->plan.rules_on, std::set<std::string>{on});
    EXPECT_EQ(settings->output.text(), "out/o.####.exr");
    EXPECT_EQ(settings->on_existing, io::OnExisting::overwrite);
    EXPECT_EQ(settings->missing, MissingPolicy::hold);
    EXPECT_EQ(settings->on_error, ErrorPolicy::keep_going);
    EXPECT_EQ(settings->overflow, io::HalfOverflow::clamp);
    EXPECT_EQ(settings->exr.compression->method, io::ExrMethod::dwab);
    EXPECT_EQ(settings->exr.compression->level, 9);
    EXPECT_TRUE(settings->exr.half);
    EXPECT_EQ(settings->exr.channels, (std::vector<std::string>{"R", "*.Z"}));
    EXPECT_TRUE(settings->strict);
    EXPECT_FALSE(settings->sidecar);
    EXPECT_TRUE(settings->preview);
    EXPECT_EQ(settings->dump_folder, "stages");
}

TEST(JobSettings, ErrorsNameTheSetting) {
    const std::string own = (std::filesystem::current_path() / "in.####.exr").string();
    const std::pair<const char*, std::string> wrong[] = {
        {"frames", "2-1"},         {"cuts", "x"},
        {"profile", "maya"},       {"behind", "a.##.##.exr"},
        {"no_elide", "no_rule"},   {"elide", "no_rule"},
        {"output", "a.##.##.exr"}, {"compression", "zip:0"},
        {"channels", "R,,G"},      {"fill_mask", ".fill"},
        {"fill_mask", "fill."},    {"fill_mask", "a b"},
        {"fill_mask", "f/"},       {"behind", "in.####.exr"},
        {"behind", own},           {"behind", "./shots/..//in.####.exr"}};
    for (const auto& [key, value] : wrong) {
        const auto settings = settings_of({{key, value}});
        ASSERT_FALSE(settings.ok()) << key;
        EXPECT_EQ(settings.status().code(), StatusCode::usage) << key;
        EXPECT_TRUE(settings.status().message().starts_with(setting(key)))
            << settings.status().message();
    }
    using Values = std::vector<std::pair<std::string, ParameterValue>>;
    for (const Values& values :
         std::vector<Values>{{{"no_elide", "all"}, {"elide", "missing_plane"}},
                             {{"watch", true}},
                             {{"watch", true}, {"idle", 9.0}, {"chunk", "1/2"}},
                             {{"watch", true}, {"frames", "1-2"}, {"missing", "hold"}},
                             {{"input", "color=a.#.exr,behind=b.#.exr"}, {"behind", "c.#.exr"}},
                             {{"dump_stages", "stages"}, {"on_existing", "skip"}},
                             {{"dump_stages", "stages"}, {"view", kAllViews}},
                             {{"idle", 9.0}}})
        EXPECT_EQ(settings_of(values).status().code(), StatusCode::usage)
            << values.front().first << " " << values.back().first;
    JobSettings job;
    EXPECT_FALSE(table().set(&job, "view_layer", "").ok());
    EXPECT_FALSE(table().set(&job, "output", ParameterValue()).ok());
    EXPECT_FALSE(table().set(&job, "strict", "yes").ok());
    EXPECT_FALSE(table().set(&job, "idle", 0.0).ok());
}

}  // namespace
}  // namespace postchain::sequence
