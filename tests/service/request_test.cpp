// Jobs from JSON: all faults with their places, and strict values.
#include <gmock/gmock.h>

#include "tests/service/request_fixture.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

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
    for (const Diagnostic& one : problem.diagnostics) {
        found += concat(one.path, " ", one.line, "\n");
        EXPECT_EQ(one.file, "job");
        if (one.path == "inpt") {
            EXPECT_THAT(one.message, HasSubstr("did you mean 'input'"));
        } else if (one.path == "input") {
            EXPECT_EQ(one.message, "missing");
        }
    }
    for (const char* fault :
         {"inpt 2", "input ", "strict 4", "frames 5", "priority 6", "on_existing 7"})
        EXPECT_THAT(found, HasSubstr(fault));
    EXPECT_EQ(problem.diagnostics.size(), 6u) << found;
}

TEST_F(RequestTest, ValuesAreStrict) {
    const std::vector<std::pair<std::string, std::vector<json>>> bad = {
        {"strict", {"true", 0}},
        {"sidecar", {nullptr}},
        {"frames", {5, "", std::string("1-2\0", 4)}},
        {"camera", {""}},
        {"priority", {1.0, "1", 1e300}},
        {"set", {"a=b", json::array({1})}},
        {"chain", {5, json::array()}},
        {"kind", {"walk", 1}},
        {"max_memory", {"-1"}},
        {"precision", {"fp64"}},
        {"input", {json::array({"a", "b"})}},
        {"sweep", {json::array({"a=1"})}},
        {"chain_b", {"fast"}},
        {"frame", {1}},
        {"output", {"out/o.png/"}},
        // A job waits in its queue, not for a renderer.
        {"watch", {true}},
        {"idle", {60}}};
    for (const auto& [key, values] : bad)
        for (const json& value : values) {
            const Problem problem = refused(with(key, value));
            ASSERT_FALSE(problem.diagnostics.empty()) << key << " " << value;
            EXPECT_EQ(problem.diagnostics[0].path.substr(0, key.size()), key) << value;
        }
}

TEST_F(RequestTest, TextsThatAreNoJob) {
    for (const std::string& text :
         {std::string(), std::string("[]"), std::string("5"), std::string("{"),
          std::string("{} {}"), std::string("\xff\xfe"),
          "{\"a\": \"" + std::string(1 << 20, 'x') + "\"}",
          "{\"chain\": " + std::string(100, '[') + std::string(100, ']') + "}",
          std::string("{\"chain\": \"\xff\"}")}) {
        const Problem problem = refused(text);
        EXPECT_EQ(problem.kind, Problem::Kind::invalid);
        EXPECT_FALSE(problem.diagnostics.empty()) << text.substr(0, 50);
        EXPECT_FALSE(problem.detail.empty());
    }
    EXPECT_EQ(refused("{\"a\": 1,\n \"b\" 2}").diagnostics.at(0).line, 2);
    // Also forms of YAML.
    for (const char* text :
         {"{\"a\": }", "{\"chain\": \"fast\",}", "{\"a\": NaN}", "chain: fast\n", "{chain: fast}",
          "{'chain': 'fast'}", "{\"chain\": fast}", "{\"chain\": \"fast\",\n}",
          "{\"chain\": \"fast\"} # comment", "{\"frames\": 010}"}) {
        const Problem problem = refused(std::string(text));
        ASSERT_EQ(problem.diagnostics.size(), 1u) << text;
        EXPECT_EQ(problem.diagnostics[0].message, "not valid JSON from here on") << text;
        EXPECT_GT(problem.diagnostics[0].column, 0) << text;
    }
}

TEST_F(RequestTest, AFaultNamesItsFileLineColumnAndKey) {
    const std::string files = R"({"input": "in.####.exr", "output": "out/o.####.exr",)";
    struct Case {
        std::string body, file;
        int line, column;
        std::string path;
    };
    for (const Case& one : std::vector<Case>{
             {"{\"input\": \"a.exr\",\n \"input\": \"b.exr\"}", "job", 2, 2, ""},
             {"{\"chain\": \"fast\",\n \"priority\": 1e400}", "job", 1, 1, ""},
             {files + "\n \"chain\": \"fast\", \"set\": [\"fxaa.mode=directional\", 5]}", "job", 2,
              52, "set[1]"},
             {files + "\n \"chain\": {\"postchain\": 1,\n \"passes\": [{\"fxaa\": {\"mod\": 1}}]}}",
              "job", 3, 23, "passes[0].mod"},
             {files + R"("chain_text": "postchain: 1\npasses:\n  - fxxa\n"})", "chain_text", 3, 5,
              "passes[0]"}}) {
        const Problem problem = refused(one.body);
        ASSERT_EQ(problem.diagnostics.size(), 1u) << problem.detail;
        const Diagnostic& found = problem.diagnostics[0];
        EXPECT_EQ(std::tie(found.file, found.line, found.column, found.path),
                  std::tie(one.file, one.line, one.column, one.path))
            << problem.detail;
        EXPECT_THAT(problem.detail, HasSubstr(concat(one.file, ":", one.line, ":", one.column)));
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

TEST_F(RequestTest, AbAndBenchTakeTheTablesOfTheCommand) {
    json ab = with({{"kind", "ab"},
                    {"chain_b", "best"},
                    {"output", "report"},
                    {"repeats", 3},
                    {"ppd", 50.5},
                    {"fail_above", {"flip=0.05"}}});
    JobRequest request = taken(ab);
    EXPECT_EQ(request.kind, JobKind::ab);
    EXPECT_EQ(request.chain_b.name, "best");
    EXPECT_EQ(request.measured.folder, base_ + "/root/report");
    EXPECT_EQ(request.measured.repeats, 3);
    EXPECT_EQ(request.measured.page_frames, 8);  // of ab; bench has 1
    EXPECT_EQ(request.measured.flip.pixels_per_degree, 50.5);
    // No output of the job may replace its chains.
    ab["chain_b"] = "chain.yaml";
    const auto inputs = taken(ab).measured.run.other_inputs;
    EXPECT_TRUE(std::any_of(inputs.begin(), inputs.end(), [&](const auto& input) {
        return input.path == base_ + "/root/chain.yaml";
    }));
    ab["fail_above"] = {"flop=1"};
    EXPECT_EQ(refused(ab).diagnostics.at(0).path, "fail_above");
    json bench = with({{"kind", "bench"}, {"output", "report"}});
    bench["sweep"] = {"joint_blur.samples=5,9"};
    EXPECT_EQ(taken(bench).variants.size(), 2u);
    bench["sweep"] = {"joint_blur.sample=5"};
    EXPECT_EQ(refused(bench).diagnostics.at(0).path, "sweep");
}

TEST_F(RequestTest, AStudyIsAFileOrAnObject) {
    const json scenes = json::array(
        {{{"name", "a"}, {"input", "in.####.exr"}, {"truth", "in.####.exr"}, {"frames", "1"}},
         {{"name", "b"}, {"input", "in.####.exr"}, {"truth", "in.####.exr"}, {"ppd", 40}}});
    const json study = {{"postchain_study", 1},
                        {"chains", {{"own", "./chain.yaml"}, {"quick", "fast"}}},
                        {"scenes", scenes}};
    json job = {{"kind", "study"}, {"study", study}, {"output", "out/study"}, {"priority", 3}};
    JobRequest request = taken(job);
    EXPECT_EQ(request.kind, JobKind::study);
    EXPECT_EQ(request.priority, 3);
    EXPECT_EQ(request.study_settings.folder, base_ + "/root/out/study");
    ASSERT_EQ(request.study.scenes.size(), 2u);
    EXPECT_EQ(request.study.scenes[1].measured.flip.pixels_per_degree, 40);
    EXPECT_EQ(request.study.scenes[0].measured.run.input.color().text(),
              base_ + "/root/in.####.exr");
    // Paths in a file start at its folder.
    fs::create_directories(base_ + "/root/shots");
    json moved = study;
    for (json& scene : moved["scenes"]) scene["input"] = scene["truth"] = "../in.####.exr";
    moved["chains"]["own"] = "../chain.yaml";
    write("root/shots/order.yaml", moved.dump());
    job["study"] = "shots/order.yaml";
    request = taken(job);
    EXPECT_EQ(request.study.scenes[1].measured.truth, base_ + "/root/in.####.exr");
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
    // Other faults are reported too, with their places.
    json wrong = study;
    wrong["scenes"][0]["input"] = "../outside/in.####.exr";
    wrong["scenes"][1]["framse"] = "1";
    job["study"] = wrong;
    const Problem both = refused(job);
    EXPECT_EQ(both.kind, Problem::Kind::invalid);
    EXPECT_EQ(both.diagnostics.size(), 2u) << text_of(both.diagnostics);
    job["study"] = study;
    job["frames"] = "1";
    EXPECT_EQ(refused(job).diagnostics.at(0).path, "frames");
    job.erase("frames");
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
    }
}

}  // namespace
}  // namespace postchain::service
