// Jobs from JSON: all faults with their places, strict values, and paths that do not leave the
// roots.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <concepts>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <tuple>

#include "passes/registry.h"
#include "tests/command/frames.h"
#include "tests/io/exr_files.h"
#include "tools/service/lab/ab_bench.h"
#include "tools/service/lab/study_job.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/request_body.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

// Reads requests for a folder of two small frames; a folder beside it must not be reached.
class RequestTest : public testing::Test {
  protected:
    void SetUp() override {
        base_ = fs::canonical(folder_.path()).string();
        fs::create_directories(base_ + "/root/out");
        fs::create_directories(base_ + "/outside");
        test::write_sequence(base_ + "/root", {1, 2}, 16, 12);
        write("root/camera.json", "{\"focal_length_mm\": 50}");
        write("outside/camera.json", "{\"focal_length_mm\": 50}");
        write("root/chain.yaml", "postchain: 1\npasses: [fxaa]\n");
        write("outside/chain.yaml", "postchain: 1\npasses: [fxaa]\n");
        roots_ = *Roots::of({base_ + "/root"});
        reader_ = std::make_unique<JobReader>(roots_, builtin_passes(), version_, 1);
        whole_ = {{"chain", "fast"}, {"input", "in.####.exr"}, {"output", "out/o.####.exr"}};
    }
    void write(const std::string& name, const std::string& text) {
        std::ofstream(base_ + "/" + name) << text;
    }
    Problem refused(const std::string& body) {
        auto read = reader_->job(body);
        if (auto* problem = std::get_if<Problem>(&read)) return std::move(*problem);
        throw std::runtime_error("was taken: " + body.substr(0, 300));
    }
    template <std::same_as<json> Json>
    Problem refused(const Json& body) {
        return refused(body.dump());
    }
    JobRequest taken(const std::string& body) {
        auto read = reader_->job(body);
        if (auto* request = std::get_if<JobRequest>(&read)) return std::move(*request);
        throw std::runtime_error(text_of(std::get<Problem>(read).diagnostics));
    }
    template <std::same_as<json> Json>
    JobRequest taken(const Json& body) {
        return taken(body.dump());
    }
    json with(const json& more) const {
        json body = whole_;
        body.update(more);
        return body;
    }
    json with(const std::string& key, const json& value) const { return with(json{{key, value}}); }

    test::TempFolder folder_;
    std::string base_, version_ = "test";
    Roots roots_;
    std::unique_ptr<JobReader> reader_;
    json whole_;
};

TEST_F(RequestTest, WarningsComeWithTheJob) {
    EXPECT_EQ(taken(whole_).warnings.size(), 0u);
    write("root/empty.json", "{\"fps\": 24}");
    const auto found = taken(with("camera", "empty.json")).warnings;
    ASSERT_EQ(found.size(), 1u);
    EXPECT_THAT(found[0], HasSubstr("empty.json:1:1: warning: "));
}

TEST_F(RequestTest, AWholeJob) {
    const JobRequest request = taken(with({{"kind", "run"},
                                           {"priority", -7},
                                           {"frames", "1-2"},
                                           {"camera", "camera.json"},
                                           {"set", {"fxaa.mode=directional"}},
                                           {"strict", true},
                                           {"sidecar", false},
                                           {"on_existing", "skip"},
                                           {"max_memory", "1G"},
                                           {"no_elide", "all"}}));
    EXPECT_EQ(request.kind, JobKind::run);
    EXPECT_EQ(request.priority, -7);
    EXPECT_EQ(request.run.frames->frames, (std::vector<int>{1, 2}));
    EXPECT_EQ(request.run.input.color().text(), base_ + "/root/in.####.exr");
    EXPECT_EQ(request.run.output.text(), base_ + "/root/out/o.####.exr");
    EXPECT_EQ(request.run.source.camera->camera.focal_length_mm, 50);
    EXPECT_TRUE(request.run.strict);
    EXPECT_FALSE(request.run.sidecar);
    EXPECT_FALSE(request.run.plan.elide);
    EXPECT_EQ(request.run.on_existing, io::OnExisting::skip);
    EXPECT_EQ(request.run.source.max_memory, uint64_t(1) << 30);
    EXPECT_EQ(request.run.version, "test");
    EXPECT_EQ(request.chain.name, "fast");
    EXPECT_THAT(request.chain.chain.text(), HasSubstr("directional"));
}

TEST_F(RequestTest, ChainsInEveryForm) {
    json text = whole_;
    text.erase("chain");
    text["chain_text"] = "postchain: 1\npasses: [fxaa]\n";
    const std::string hash = hex_of(taken(text).chain.chain.hash());
    for (const json& chain : {json("chain.yaml"), json(base_ + "/root/chain.yaml"),
                              json{{"postchain", 1}, {"passes", {"fxaa"}}}})
        EXPECT_EQ(hex_of(taken(with("chain", chain)).chain.chain.hash()), hash) << chain;
    text["chain"] = "fast";
    EXPECT_EQ(refused(text).diagnostics.at(0).path, "chain_text");
    for (const char* none : {"fats", "none.yaml"}) {
        const Problem problem = refused(with("chain", none));
        EXPECT_EQ(problem.kind, Problem::Kind::invalid) << none;
        EXPECT_EQ(problem.diagnostics.at(0).path, "chain") << none;
    }
    // A fault of a chain's file is at its place there.
    write("root/chain.yaml", "postchain: 1\npasses: [fxaa, fxxa]\n");
    EXPECT_THAT(refused(with("chain", "chain.yaml")).detail, StartsWith("chain.yaml:2:16: error"));
}

// They are under the roots, and relative to the folder of the file that names them.
TEST_F(RequestTest, ApertureImagesInEveryForm) {
    fs::create_directory(base_ + "/root/in");
    test::write_rgb(base_ + "/root/in/a.exr", ImageF(32, 32, 3, 1));
    write("root/in/chain.yaml", "postchain: 1\ncamera: {aperture_image: a.exr}\npasses: [fxaa]\n");
    write("root/in/camera.json", "{\"aperture_image\": \"a.exr\"}");
    const std::string key = "camera.aperture_image=", image = base_ + "/root/in/a.exr";
    const auto of_chain = [&](const json& body) {
        const JobRequest request = taken(body);
        const BokehKernel& read = request.chain.chain.camera.aperture_image;
        const auto& inputs = request.run.other_inputs;
        EXPECT_EQ(read.is_read(), std::ranges::count(inputs, image, &io::InputFile::path) == 1);
        return read.file();
    };
    EXPECT_EQ(of_chain(with("chain", "in/chain.yaml")), image);
    for (const std::string& path : {std::string("in/a.exr"), image})
        EXPECT_EQ(of_chain(with("set", {key + path})), image) << path;
    EXPECT_EQ(of_chain(with({{"chain", "in/chain.yaml"}, {"set", {key + "null"}}})), "");
    const auto camera = taken(with("camera", "in/camera.json")).run.source.camera;
    EXPECT_EQ(camera->camera.aperture_image.file(), image);
    EXPECT_THAT(refused(with("set", {key + "none.exr"})).detail, HasSubstr("none.exr"));
    EXPECT_THAT(refused(with("set", {key})).detail, HasSubstr("camera.aperture_image"));
}

TEST_F(RequestTest, InputsInSeveralFiles) {
    const auto pattern = [](const JobRequest& request, Role role) {
        return request.run.input.patterns.at(role).text();
    };
    const json names = "color=in.####.exr,depth=out/z.####.exr";
    const JobRequest several = taken(with("input", names));
    EXPECT_EQ(pattern(several, Role::inverse_depth), base_ + "/root/out/z.####.exr");
    // The cameras of neighboring frames are read from the same files.
    EXPECT_EQ(several.run.source.color_frames->text(), base_ + "/root/in.####.exr");
    EXPECT_EQ(pattern(taken(with("behind", "out/b.####.exr")), Role::behind),
              base_ + "/root/out/b.####.exr");
    EXPECT_EQ(taken(with("profile", "cycles")).run.source.profile->name, "cycles");
    const json ab = {{"kind", "ab"}, {"output", "report"}, {"chain_b", "best"}, {"truth", names}};
    EXPECT_THAT(refused(with(ab)).detail, HasSubstr("truth: give one pattern, for color only"));
}

TEST_F(RequestTest, PreviewsOfAPlaneAndAScale) {
    json body = {{"chain", "fast"}, {"input", "in.####.exr"}, {"frame", -3}};
    const auto read = [&](const std::string& key, const json& value) {
        body[key] = value;
        return reader_->preview(body.dump());
    };
    const auto fault = [&](const std::string& key, const json& value) {
        const auto answer = read(key, value);
        return std::get<Problem>(answer).detail;
    };
    EXPECT_EQ(std::get<JobRequest>(read("plane", "color")).plane, PreviewPlane::color);
    EXPECT_EQ(std::get<JobRequest>(read("plane", "depth")).plane, PreviewPlane::depth);
    for (const double scale : {kMinPreviewScale, 1.0})
        EXPECT_EQ(std::get<JobRequest>(read("scale", scale)).scale, scale);
    EXPECT_EQ(std::get<JobRequest>(read("scale", 1)).frame, -3);
    for (const json& scale : {json(kMinPreviewScale / 2), json(1.01), json("1"), json(nullptr)})
        EXPECT_THAT(fault("scale", scale), HasSubstr("is not a number in ")) << scale;
    body.erase("scale");
    for (const json& plane : {json("motion"), json(1)})
        EXPECT_THAT(fault("plane", plane), HasSubstr("unknown plane")) << plane;
    body.erase("plane");
    EXPECT_THAT(fault("frame", 1.5), HasSubstr("frame: "));
    body.erase("frame");
    EXPECT_THAT(fault("set", json::array()), HasSubstr("frame: missing"));
}

// A job is read again when it begins: of a user who has been removed since, it has no folders.
TEST_F(RequestTest, AJobNeedsItsOwner) {
    const Users everyone;
    EXPECT_TRUE(Readers(*reader_, everyone).of("ann").ok()) << "there are no users any more";
    write("users", "postchain_users: 1\nusers:\n  bob: {tokens: [" +
                       *hash_of_token("bbbbbbbbbbbbbbbb") + "]}\n");
    const auto users =
        *Users::of_file(base_ + "/users", [](const std::string&) { return Status(); });
    const Readers readers(*reader_, *users);
    EXPECT_TRUE(readers.of("bob").ok());
    EXPECT_TRUE(readers.of("").ok()) << "from before there were users";
    EXPECT_THAT(readers.of("ann").status().message(), HasSubstr("'ann' is no longer in"));
}

TEST_F(RequestTest, EveryFaultAtOnceWithItsPlace) {
    const Problem problem = refused(R"({"chain": "fast",
  "inpt": "in.####.exr",
  "output": "out/o.####.exr",
  "strict": 1,
  "frames": "5-1",
  "priority": 101,
  "on_existing": "never"})");
    EXPECT_EQ(problem.kind, Problem::Kind::invalid);
    std::string found;
    for (const Diagnostic& one : problem.diagnostics)
        found += concat(one.file, ":", one.line, " ", one.path, " ", one.message, "\n");
    for (const char* fault :
         {"job:2 inpt ", "did you mean 'input'", " input missing\n", "job:4 strict ",
          "job:5 frames ", "job:6 priority ", "job:7 on_existing "})
        EXPECT_THAT(found, HasSubstr(fault));
    EXPECT_EQ(problem.diagnostics.size(), 6u) << found;
}

TEST_F(RequestTest, ValuesAreStrict) {
    const std::vector<std::pair<std::string, std::vector<json>>> bad = {
        {"strict", {"true", 0, nullptr}},
        {"frames", {5, "", std::string("1-2\0", 4)}},
        {"camera", {"", "none.json", "fault.json"}},
        {"priority", {1.0, "1", 1e300}},
        {"set", {"a=b", json::array({1}), json::array({std::string("a=b\0", 4)})}},
        {"chain", {5, json::array(), "", std::string(300, 'c')}},
        {"kind", {"walk", 1}},
        {"max_memory", {"-1"}},
        {"precision", {"fp64"}},
        {"input",
         {json::array({"a", "b"}), std::string(300, 'i') + ".####.exr",
          "color=in.####.exr,color=in.####.exr"}},
        {"behind", {"b.##.##.exr"}},
        {"output", {"out/o.png/"}},
        // Keys of other kinds. A job waits in its queue, not for a renderer.
        {"sweep", {json::array({"a=1"})}},
        {"watch", {true}}};
    write("root/fault.json", R"({"f_stop": "x"})");
    for (const auto& [key, values] : bad)
        for (const json& value : values) {
            const Problem problem = refused(with(key, value));
            ASSERT_FALSE(problem.diagnostics.empty()) << key << " " << value;
            EXPECT_EQ(problem.diagnostics[0].path.substr(0, key.size()), key) << value;
            EXPECT_EQ(problem.kind, Problem::Kind::invalid) << key << " " << value;
        }
}

TEST_F(RequestTest, TextsThatAreNoJob) {
    for (const std::string& text : std::vector<std::string>{
             "", "[]", "5", "{", "{} {}", "\xff\xfe",
             "{\"a\": \"" + std::string(1 << 20, 'x') + "\"}",
             "{\"chain\": " + std::string(100, '[') + std::string(100, ']') + "}",
             "{\"chain\": \"\xff\"}"}) {
        const Problem problem = refused(text);
        EXPECT_EQ(problem.kind, Problem::Kind::invalid);
        EXPECT_FALSE(problem.diagnostics.empty()) << text.substr(0, 50);
    }
    EXPECT_EQ(refused("{\"a\": 1,\n \"b\" 2}").diagnostics.at(0).line, 2);
    // Also forms of YAML.
    for (const std::string text :
         {"{\"a\": }", "{\"chain\": \"fast\",}", "{\"a\": NaN}", "chain: fast\n", "{chain: fast}",
          "{'chain': 'fast'}", "{\"chain\": fast}", "{\"chain\": \"fast\",\n}",
          "{\"chain\": \"fast\"} # comment", "{\"frames\": 010}"}) {
        const Problem problem = refused(text);
        ASSERT_EQ(problem.diagnostics.size(), 1u) << text;
        EXPECT_THAT(problem.diagnostics[0].message, HasSubstr("not valid JSON")) << text;
        EXPECT_GT(problem.diagnostics[0].column, 0) << text;
    }
}

TEST_F(RequestTest, ListsHaveALimit) {
    const auto sets = [](size_t count) {
        json list = json::array();
        for (size_t i = 0; i < count; ++i) list.push_back("camera.f_stop=2");
        return list;
    };
    taken(with("set", sets(256)));
    EXPECT_THAT(refused(with("set", sets(257))).detail,
                HasSubstr("set: more than 256 items; remove some"));
}

TEST_F(RequestTest, ABodyHasALimitOfKeys) {
    json body = whole_;
    while (body.size() < 257) body[concat("key", body.size())] = 1;
    const Problem problem = refused(body);
    ASSERT_EQ(problem.diagnostics.size(), 1u) << problem.detail;
    EXPECT_THAT(problem.detail, HasSubstr("more than 256 keys in one map"));
}

TEST_F(RequestTest, AFaultNamesItsFileLineColumnAndKey) {
    const std::string files = R"({"input": "in.####.exr", "output": "out/o.####.exr",)";
    for (const auto& [body, place, path] : std::vector<std::array<std::string, 3>>{
             {"{\"input\": \"a.exr\",\n \"input\": \"b.exr\"}", "job:2:2", ""},
             {"{\"chain\": \"fast\",\n \"priority\": 1e400}", "job:2:14", ""},
             {files + "\n \"chain\": \"fast\", \"set\": [\"fxaa.mode=directional\", 5]}",
              "job:2:52", "set[1]"},
             {files + "\n \"chain\": {\"postchain\": 1,\n \"passes\": [{\"fxaa\": {\"mod\": 1}}]}}",
              "job:3:23", "passes[0].mod"},
             {files + R"("chain_text": "postchain: 1\npasses:\n  - fxxa\n"})", "chain_text:3:5",
              "passes[0]"}}) {
        const Problem problem = refused(body);
        ASSERT_EQ(problem.diagnostics.size(), 1u) << problem.detail;
        const Diagnostic& found = problem.diagnostics[0];
        EXPECT_EQ(concat(found.file, ":", found.line, ":", found.column), place);
        EXPECT_EQ(found.path, path);
        EXPECT_THAT(problem.detail, HasSubstr(place));
    }
    EXPECT_THAT(refused(files + R"("chain": "fast", "priority": 1e3, "strict": [true]})").detail,
                testing::EndsWith("(and 1 more)"));
}

// Forms of JSON that are unusual in YAML.
TEST_F(RequestTest, JsonInEveryForm) {
    for (const char* text :
         {"{\"chain\":\n\t\"fast\",\r\n\t\"input\"\t:\t\"in.####.exr\" , \"output\":\"out\\/"
          "\\u006f\\ud83d\\ude00.####.exr\"}",
          "\xef\xbb\xbf{\"chain\":\"fast\",\"input\":\"in.####.exr\",\"output\":"
          "\"out/o\xf0\x9f\x98\x80.####.exr\",\"set\":[ ],\"strict\":true,\"priority\":-0}\n\n"}) {
        EXPECT_EQ(taken(std::string(text)).run.output.text(),
                  base_ + "/root/out/o\xf0\x9f\x98\x80.####.exr");
    }
}

const AbOrBench& ab_or_bench(const JobRequest& request) {
    return dynamic_cast<const AbOrBench&>(*request.measurement);
}

const study::Study& study_of(const JobRequest& request) {
    return dynamic_cast<const StudyJob&>(*request.measurement).study();
}

TEST_F(RequestTest, AbAndBenchTakeTheTablesOfTheCommand) {
    json ab = with({{"kind", "ab"},
                    {"chain_b", "best"},
                    {"output", "report"},
                    {"truth", "in.####.exr"},
                    {"repeats", 3},
                    {"ppd", 50.5},
                    {"fail_above", {"flip=0.05"}}});
    JobRequest request = taken(ab);
    EXPECT_EQ(request.kind, JobKind::ab);
    EXPECT_EQ(request.measurement->report_folder(), base_ + "/root/report");
    const auto settings = ab_or_bench(request).settings();
    EXPECT_EQ(settings.folder, base_ + "/root/report");
    EXPECT_EQ(settings.truth, base_ + "/root/in.####.exr");
    EXPECT_EQ(settings.truth_is, "in.####.exr");  // reports show no path of the server
    EXPECT_EQ(settings.repeats, 3);
    EXPECT_EQ(settings.page_frames, 8);  // of ab; bench has 1
    EXPECT_EQ(settings.flip.pixels_per_degree, 50.5);
    // No output of the job may replace its chains.
    ab["chain_b"] = "chain.yaml";
    const auto inputs = taken(ab).run.other_inputs;
    EXPECT_TRUE(std::any_of(inputs.begin(), inputs.end(), [&](const auto& input) {
        return input.path == base_ + "/root/chain.yaml";
    }));
    ab["fail_above"] = {"flop=1"};
    EXPECT_EQ(refused(ab).diagnostics.at(0).path, "fail_above");
    json bench = with({{"kind", "bench"}, {"output", "report"}});
    bench["sweep"] = {"joint_blur.samples=5,9"};
    EXPECT_EQ(ab_or_bench(taken(bench)).variants().size(), 2u);
    for (const char* sweep : {"joint_blur.sample=5", "joint_blur.samples"}) {
        bench["sweep"] = {sweep};
        EXPECT_EQ(refused(bench).diagnostics.at(0).path, "sweep");
        EXPECT_THAT(refused(bench).detail, Not(HasSubstr("--"))) << "the command's option";
    }
}

TEST_F(RequestTest, AStudyIsAFileOrAnObject) {
    const json scenes = json::array(
        {{{"name", "a"}, {"input", "in.####.exr"}, {"truth", "in.####.exr"}, {"frames", "1"}},
         {{"name", "b"}, {"input", "in.####.exr"}, {"truth", "in.####.exr"}, {"ppd", 40}}});
    const json study = {{"postchain_study", 1},
                        {"chains", {{"own", "./chain.yaml"}, {"quick", "fast"}}},
                        {"scenes", scenes}};
    json job = {{"kind", "study"}, {"study", study}, {"output", "out/study"}};
    JobRequest request = taken(job);
    EXPECT_EQ(request.kind, JobKind::study);
    EXPECT_EQ(request.measurement->report_folder(), base_ + "/root/out/study");
    ASSERT_EQ(study_of(request).scenes.size(), 2u);
    EXPECT_EQ(study_of(request).scenes[1].measured.flip.pixels_per_degree, 40);
    const sequence::RunSettings& run = study_of(request).scenes[0].measured.run;
    for (const io::PathPattern& color : {run.input.color(), *run.source.color_frames})
        EXPECT_EQ(color.text(), base_ + "/root/in.####.exr");
    // Paths in a file start at its folder.
    fs::create_directories(base_ + "/root/shots");
    json moved = study;
    for (json& scene : moved["scenes"]) scene["input"] = scene["truth"] = "../in.####.exr";
    moved["chains"]["own"] = "../chain.yaml";
    write("root/shots/order.yaml", moved.dump());
    job["study"] = "shots/order.yaml";
    request = taken(job);
    EXPECT_EQ(study_of(request).scenes[1].measured.truth, base_ + "/root/in.####.exr");
    // They must stay under the root, in a file and in an object.
    for (const auto& [place, path] : std::vector<std::pair<const char*, const char*>>{
             {"/chains/own", "../outside/chain.yaml"},
             {"/scenes/1/input", "../outside/in.####.exr"},
             {"/scenes/1/behind", "../outside/in.####.exr"},
             {"/scenes/1/truth", "../outside/in.####.exr"},
             {"/scenes/1/camera", "../outside/camera.json"},
             {"/scenes/1/profile", "../outside/profile.yaml"}}) {
        job["study"] = study;
        job["study"][json::json_pointer(place)] = path;
        const Problem problem = refused(job);
        EXPECT_EQ(problem.kind, Problem::Kind::forbidden) << place;
        EXPECT_THAT(text_of(problem.diagnostics), Not(HasSubstr(base_)));
    }
    job["study"] = "../outside/order.yaml";
    EXPECT_EQ(refused(job).kind, Problem::Kind::forbidden);
    for (const auto& [other, why] : std::vector<std::pair<json, const char*>>{
             {"none.yaml", "none.yaml"},
             {std::string("shots/order.yaml\0", 17), "is not a study's file or object"},
             {"", "is empty"},
             {5, "'5' is not a study's file or object"},
             {json::array({study}), "is not a study's file or object"}}) {
        job["study"] = other;
        const Problem problem = refused(job);
        EXPECT_EQ(problem.diagnostics.at(0).path, "study") << other;
        EXPECT_THAT(problem.detail, HasSubstr(why)) << other;
        EXPECT_THAT(problem.detail, Not(HasSubstr(base_))) << other;
    }
    // Other faults are reported too.
    json wrong = study;
    wrong["scenes"][0]["input"] = "../outside/in.####.exr";
    wrong["scenes"][1]["framse"] = "1";
    job["study"] = wrong;
    const Problem both = refused(job);
    EXPECT_EQ(both.kind, Problem::Kind::invalid);
    EXPECT_EQ(both.diagnostics.size(), 2u) << text_of(both.diagnostics);
    job.erase("study");
    EXPECT_EQ(refused(job).diagnostics.at(0).path, "study");
}

TEST_F(RequestTest, TheSchemaHasEveryKeyThatIsRead) {
    const json schema = json(job_schema(reader_->run_table()));
    EXPECT_EQ(schema["oneOf"].size(), 4u);
    for (const json& kind : schema["oneOf"]) {
        const std::string name = kind["title"];
        EXPECT_THAT(refused(json{{"kind", name}, {"kin", 1}}).detail, HasSubstr("unknown key"));
        for (const auto& [key, value] : kind["properties"].items()) {
            if (key == "kind") continue;
            // A value of no row's type: the key itself is known.
            const Problem problem = refused(json{{"kind", name}, {key, json::object()}});
            for (const Diagnostic& one : problem.diagnostics)
                EXPECT_THAT(one.message, Not(HasSubstr("unknown key"))) << name << " " << key;
        }
        if (name == "study") continue;
        // Frames are read and planned alike.
        for (const Parameter& row : reader_->run_table().rows())
            if (row.group == sequence::kInputGroup || row.group == sequence::kPlanGroup) {
                EXPECT_TRUE(kind["properties"].contains(row.key)) << name << " " << row.key;
            }
    }
}

// Every key that names files, in every form.
TEST_F(RequestTest, NoPathLeavesTheRoots) {
    fs::create_directory_symlink(base_ + "/outside", base_ + "/root/link");
    write("root/picture_outside.json", "{\"aperture_image\": \"../outside/a.png\"}");
    write("root/frame_outside.json", "{\"frames\": {\"1\": {\"aperture_image\": \"/a.png\"}}}");
    const json picture_outside = {{"postchain", 1},
                                  {"camera", {{"aperture_image", "../outside/a.png"}}},
                                  {"passes", {"fxaa"}}};
    const json sets = {"camera.aperture_image=../outside/a.png"};
    const json run = json::object();
    const json view = {{"output", "out/o.####.png"}, {"output_transfer", "view"}};
    const json ab = {{"kind", "ab"}, {"output", "report"}, {"chain_b", "best"}};
    const json bench = {{"kind", "bench"}, {"output", "report"}};
    const std::tuple<json, const char*, json> attacks[] = {
        {run, "input", "../outside/in.####.exr"},
        {run, "input", "link/in.####.exr"},
        {run, "input", "color=in.####.exr,depth=../outside/d.####.exr"},
        {run, "output", "../o.####.exr"},
        {run, "output", "link/o.####.exr"},
        {run, "camera", "link/camera.json"},
        {run, "camera", "picture_outside.json"},
        {run, "camera", "frame_outside.json"},
        {run, "profile", "/etc/passwd"},
        {run, "dump_stages", "link"},
        {run, "chain", "link/chain.yaml"},
        {run, "chain", picture_outside},
        {run, "set", sets},
        {run, "behind", "../outside/in.####.exr"},
        {view, "ocio", "/etc/passwd"},
        {ab, "chain_b", "../outside/chain.yaml"},
        {ab, "truth", "../outside/t.####.exr"},
        {ab, "output", "../report"},
        {ab, "assets", "link/assets"},
        {bench, "sweep", sets}};
    for (const auto& [kind, key, value] : attacks) {
        json body = with(kind);
        body[key] = value;
        const Problem problem = refused(body);
        EXPECT_EQ(problem.kind, Problem::Kind::forbidden) << key << " " << value;
        // Only the path that the client has given.
        EXPECT_THAT(text_of(problem.diagnostics), Not(HasSubstr(base_ + "/outside"))) << key;
    }
}

TEST_F(RequestTest, OcioAndItsTablesAreUnderTheRoots) {
    json body =
        with({{"output", "out/o.####.png"}, {"ocio", "look.ocio"}, {"output_transfer", "view"}});
    const auto write_look = [&](const std::string& search, const std::string& table) {
        write("root/look.ocio",
              "ocio_profile_version: 1\nsearch_path: '" + search +
                  "'\nroles: {scene_linear: lin}\n"
                  "displays: {screen: [!<View> {name: Film, colorspace: film}]}\n"
                  "colorspaces:\n  - !<ColorSpace>\n    name: lin\n  - !<ColorSpace>\n"
                  "    name: film\n    from_reference: !<FileTransform> {src: '" +
                  table + "'}\n");
    };
    write_look(".:luts", "../root/a.spi1d");
    const auto transfer = taken(body).run.picture.transfer;
    ASSERT_TRUE(transfer.has_value());
    EXPECT_EQ(std::get<io::DisplayView>(*transfer).config, base_ + "/root/look.ocio");
    body["output_transfer"] = "film";
    EXPECT_THAT(refused(body).diagnostics.at(0).message, HasSubstr("unknown name 'film'"));
    body["output_transfer"] = "view";
    fs::create_symlink("/etc/passwd", base_ + "/root/link.spi1d");
    for (const auto& [search, table] : {std::pair{"", "../outside.spi1d"},
                                        {"/etc", "passwd"},
                                        {"", "/etc/none.spi1d"},
                                        {"", "link.spi1d"}}) {
        write_look(search, table);
        const Problem problem = refused(body);
        EXPECT_EQ(problem.kind, Problem::Kind::forbidden) << search << " " << table;
        ASSERT_EQ(problem.diagnostics.size(), 1u) << search << " " << table;
        EXPECT_EQ(problem.diagnostics[0].path, "ocio");
        // Whether the file exists is not told.
        EXPECT_EQ(problem.diagnostics[0].message,
                  "names a table outside the folders of this service");
    }
}

// A new row of a table that names files must be checked against the roots.
TEST_F(RequestTest, EveryTextOfTheTablesIsKnownToNameFilesOrNot) {
    std::istringstream words(
        "frames chunk cuts view_layer view aovs max_memory no_elide elide compression channels "
        "ocio_display ocio_view ocio_colorspace input_transfer output_transfer cryptomatte "
        "fill_mask");
    const std::set<std::string> no_files(std::istream_iterator<std::string>(words), {});
    size_t files = 0;
    for (const ParameterTable* table :
         {&reader_->run_table(), &experiment::ab_parameters(), &experiment::bench_parameters()})
        for (const Parameter& row : table->rows()) {
            if (row.type != ParameterType::text) continue;
            const bool names = path_kind(row) != PathKind::none;
            EXPECT_NE(names, no_files.count(row.key) > 0) << row.key;
            files += names;
        }
    EXPECT_EQ(files, 7u + 2 * 3);
}

}  // namespace
}  // namespace postchain::service
