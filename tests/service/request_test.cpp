// Bodies become words of a program: all faults with their places, strict values, and paths that do
// not leave the roots.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <concepts>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <tuple>

#include "tests/service/schemas.h"
#include "tests/support/status.h"
#include "tests/support/temp_folder.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/programs.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;
using Words = std::vector<std::string>;

// Reads requests for a folder; a folder beside it must not be reached.
class RequestTest : public testing::Test {
  protected:
    void SetUp() override {
        base_ = fs::canonical(folder_.path()).string();
        for (const char* name : {"/root/out", "/outside"}) fs::create_directories(base_ + name);
        fs::create_directory_symlink(base_ + "/outside", base_ + "/root/link");
        roots_ = *Roots::of({base_ + "/root"});
        for (const auto& [kind, text] : {std::pair(RequestKind::run, test::kRunSchema),
                                         {RequestKind::plan, test::kRunSchema},
                                         {RequestKind::preview, test::kRunSchema},
                                         {RequestKind::ab, test::kAbSchema},
                                         {RequestKind::study, test::kStudySchema}})
            schemas_[kind] = io::Json::parse(text);
        schemas_[RequestKind::preview]["required"] = {"chain", "input"};
        reader_ = std::make_unique<JobReader>(roots_, schemas_);
        whole_ = {{"chain", "fast"}, {"input", "in.####.exr"}, {"output", "out/o.####.exr"}};
    }
    std::string root(const std::string& name) const { return base_ + "/root/" + name; }
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
    Words words(const json& body, const std::vector<std::string_view>& without = {}) {
        return words_of(taken(body.dump()), "/texts", without);
    }
    json with(const json& more) const {
        json body = whole_;
        body.update(more);
        return body;
    }
    json with(const std::string& key, const json& value) const { return with(json{{key, value}}); }

    test::TempFolder folder_;
    std::string base_;
    Roots roots_;
    Schemas schemas_;
    std::unique_ptr<JobReader> reader_;
    json whole_;
};

TEST_F(RequestTest, AWholeJob) {
    const json body = with({{"kind", "run"},
                            {"priority", -7},
                            {"frame_timeout", 9},
                            {"frames", "1-2"},
                            {"camera", "camera.json"},
                            {"profile", "cycles"},
                            {"set", {"fxaa.mode=directional", "camera.aperture_image=a.exr"}},
                            {"strict", true},
                            {"sidecar", false},
                            {"samples", 8},
                            {"ppd", 50.5},
                            {"behind", nullptr},
                            {"on_existing", "skip"}});
    EXPECT_EQ(words(body, {"on_existing"}),
              (Words{"run", "fast", "--set=fxaa.mode=directional",
                     "--set=camera.aperture_image=" + root("a.exr"),
                     "--input=" + root("in.####.exr"), "--output=" + root("out/o.####.exr"),
                     "--frames=1-2", "--camera=" + root("camera.json"), "--profile=cycles",
                     "--samples=8", "--ppd=50.5", "--no-sidecar", "--strict"}));
    const JobRequest request = taken(body.dump());
    EXPECT_EQ(request.priority, -7);
    EXPECT_EQ(request.frame_timeout_s, 9);
    EXPECT_EQ(request.output, root("out/o.####.exr"));
    EXPECT_EQ(request.value("on_existing", "fail"), "skip");
    EXPECT_EQ(request.value("on_error", "continue"), "continue");
    EXPECT_EQ(words(with("input", "color=a.####.exr,depth=out/z.####.exr"))[2],
              concat("--input=color=", root("a.####.exr"), ",depth=", root("out/z.####.exr")));
}

TEST_F(RequestTest, ChainsInEveryForm) {
    for (const std::string& file : {std::string("./c.yaml"), root("c.yaml")})
        EXPECT_EQ(words(with("chain", file))[1], root("c.yaml"));
    json text = whole_;
    text.erase("chain");
    text["chain_text"] = "postchain: 1\npasses: [fxaa]\n";
    const Words said = words(text);
    EXPECT_EQ(said[1], "/texts/chain.yaml");
    EXPECT_EQ(said[2], "--relative-to=.") << "files that it names";
    ASSERT_TRUE(write_texts(taken(text.dump()), base_).ok());
    EXPECT_EQ(*read_text_file(base_ + "/chain.yaml", StatusCode::input),
              text["chain_text"].get<std::string>());
    EXPECT_FALSE(write_texts(taken(text.dump()), base_ + "/none").ok());
    text["chain"] = "fast";
    EXPECT_EQ(refused(text).diagnostics.at(0).path, "chain_text");
    EXPECT_THAT(refused(with("chain", "fats")).detail, HasSubstr("fast"));
    for (const json& none : {json(5), json::array(), json(""), json(std::string("c.yaml\0", 7))})
        EXPECT_EQ(refused(with("chain", none)).diagnostics.at(0).path, "chain") << none;
    EXPECT_THAT(refused(json{{"input", "a"}, {"output", "b"}}).detail, HasSubstr("chain: missing"));
}

void expect_same_places(const TextNode& a, const TextNode& b) {
    EXPECT_EQ(concat(a.line, ":", a.column, " ", a.text),
              concat(b.line, ":", b.column, " ", b.text));
    EXPECT_EQ(a.quoted, b.quoted) << a.text;
    ASSERT_EQ(a.items.size(), b.items.size());
    ASSERT_EQ(a.entries.size(), b.entries.size());
    for (size_t i = 0; i < a.items.size(); ++i) expect_same_places(a.items[i], b.items[i]);
    for (size_t i = 0; i < a.entries.size(); ++i) {
        expect_same_places(a.entries[i].key, b.entries[i].key);
        expect_same_places(a.entries[i].value, b.entries[i].value);
    }
}

// Faults of an object are where it stands in the body; so are those that the program finds.
TEST_F(RequestTest, AnObjectKeepsItsLinesAndColumns) {
    const std::string body =
        "{\"input\": \"in.####.exr\", \"output\": \"o.####.exr\",\n \"chain\": {\"postchain\": 1,\n"
        "    \"passes\": [{\"fxaa\": {\"mode\": \"a\\n\\\"b\", \"preset\": null,\n"
        "  \"on\": true, \"\xc3\xa9\": [1, 2.50, -1e3], \"5\": \"5\"}}]}}";
    const JobRequest request = taken(body);
    EXPECT_TRUE(request.subjects[0].in_body);
    expect_same_places(*read_json_body(body).root.find("chain"),
                       read_json_body(request.subjects[0].text).root);
    const io::Json faults = io::Json::parse(
        R"([{"file": "/texts/chain.yaml", "line": 3, "column": 26, "path": "passes[0].mode",
             "message": "is unknown"},
            {"key": "frames", "message": "--frames: none"}, {"key": "", "message": "why"}, 5])");
    const Problem problem = problem_of_faults(faults, body, request, roots_);
    ASSERT_EQ(problem.diagnostics.size(), 3u);
    EXPECT_THAT(problem.detail, testing::StartsWith("job:3:26: error: passes[0].mode: is unknown"));
    EXPECT_EQ(problem.diagnostics[1].path, "frames");
}

TEST_F(RequestTest, AStudyIsAFileOrAnObject) {
    json body = {{"kind", "study"}, {"study", "./s.yaml"}, {"output", "out/study"}};
    EXPECT_EQ(words(body), (Words{"study", root("s.yaml"), "--output=" + root("out/study")}));
    body["study"] = {{"postchain_study", 1}};
    EXPECT_EQ(words(body)[1], "/texts/study.yaml");
    for (const json& none : {json(""), json(5), json::array(), json(nullptr)}) {
        body["study"] = none;
        EXPECT_EQ(refused(body).diagnostics.at(0).path, "study") << none;
    }
    body["study"] = "../outside/s.yaml";
    EXPECT_EQ(refused(body).kind, Problem::Kind::forbidden);
    const json ab = {{"kind", "ab"}, {"chain_b", json{{"postchain", 1}}}, {"output", "report"}};
    EXPECT_EQ(words(with(ab)),
              (Words{"ab", "fast", "/texts/chain_b.yaml", "--relative-to=.",
                     "--input=" + root("in.####.exr"), "--output=" + root("report")}));
    EXPECT_THAT(refused(json{{"kind", "bench"}}).detail, HasSubstr("need postchain-lab"));
}

TEST_F(RequestTest, PreviewsOfAScale) {
    json body = {{"chain", "fast"}, {"input", "in.####.exr"}, {"frame", -3}};
    const auto read = [&](const std::string& key, const json& value) {
        body[key] = value;
        return reader_->preview(body.dump());
    };
    const auto fault = [&](const std::string& key, const json& value) {
        const auto answer = read(key, value);
        return std::get<Problem>(answer).detail;
    };
    for (const double scale : {kMinPreviewScale, 1.0})
        EXPECT_EQ(std::get<JobRequest>(read("scale", scale)).scale, scale);
    EXPECT_EQ(std::get<JobRequest>(read("scale", 1)).frame, -3);
    for (const json& scale : {json(kMinPreviewScale / 2), json(1.01), json("1"), json(nullptr)})
        EXPECT_THAT(fault("scale", scale), HasSubstr("is not a number in ")) << scale;
    body.erase("scale");
    EXPECT_THAT(fault("frame", 1.5), HasSubstr("frame: "));
    body.erase("frame");
    EXPECT_THAT(fault("set", json::array()), HasSubstr("frame: missing"));
    body["priority"] = 1;  // of jobs alone
    EXPECT_THAT(fault("frame", 1), HasSubstr("priority: "));
}

// A job is read again when it begins: of a user who has been removed since, it has no folders.
TEST_F(RequestTest, AJobNeedsItsOwner) {
    const Users everyone;
    EXPECT_TRUE(Readers(*reader_, everyone).of("ann").ok()) << "there are no users any more";
    std::ofstream(base_ + "/users") << "postchain_users: 1\nusers:\n  bob: {tokens: ["
                                    << *hash_of_token("bbbbbbbbbbbbbbbb") << "]}\n";
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
  "samples": 65,
  "priority": 101,
  "on_existing": "overwrit"})");
    EXPECT_EQ(problem.kind, Problem::Kind::invalid);
    std::string found;
    for (const Diagnostic& one : problem.diagnostics)
        found += concat(one.file, ":", one.line, " ", one.path, " ", one.message, "\n");
    for (const char* fault : {"job:2 inpt ", "did you mean 'input'", " input missing\n",
                              "job:4 strict ", "job:5 samples '65' is not a whole number in 1..64",
                              "job:6 priority ", "job:7 on_existing ", "did you mean 'overwrite'"})
        EXPECT_THAT(found, HasSubstr(fault));
    EXPECT_EQ(problem.diagnostics.size(), 6u) << found;
    EXPECT_THAT(problem.detail, testing::EndsWith("(and 5 more)"));
}

TEST_F(RequestTest, ValuesAreStrict) {
    const std::vector<std::pair<std::string, std::vector<json>>> bad = {
        {"strict", {"true", 0, nullptr}},
        {"frames", {5, "", std::string("1-2\0", 4)}},
        {"camera", {""}},
        {"samples", {0, 1.5, "8", nullptr, json::array()}},
        {"ppd", {0.5, "50", 1e300}},
        {"priority", {1.0, "1", 1e300}},
        {"frame_timeout", {0, 86'401, "5"}},
        {"set", {"a=b", json::array({1}), json::array({std::string("a=b\0", 4)})}},
        {"kind", {"walk", 1, "plan"}},
        {"on_error", {"", "never", nullptr}},
        {"input",
         {json::array({"a", "b"}), std::string(300, 'i') + ".####.exr",
          "color=in.####.exr,color=in.####.exr"}},
        {"behind", {"b.##.##.exr"}},
        {"sweep", {json::array({"a=1"})}}};
    for (const auto& [key, values] : bad)
        for (const json& value : values) {
            const Problem problem = refused(with(key, value));
            ASSERT_FALSE(problem.diagnostics.empty()) << key << " " << value;
            EXPECT_EQ(problem.diagnostics[0].path.substr(0, key.size()), key) << value;
            EXPECT_EQ(problem.kind, Problem::Kind::invalid) << key << " " << value;
        }
    const auto sets = [](size_t count) {
        return json(std::vector<std::string>(count, "camera.f_stop=2"));
    };
    EXPECT_EQ(words(with("set", sets(256))).size(), 256u + 4);
    EXPECT_THAT(refused(with("set", sets(257))).detail,
                HasSubstr("set: more than 256 items; remove some"));
}

TEST_F(RequestTest, TextsThatAreNoJob) {
    for (const std::string& text : std::vector<std::string>{
             "", "[]", "5", "{", "{} {}", "\xff\xfe",
             "{\"a\": \"" + std::string(1 << 20, 'x') + "\"}", "{\"a\": }",
             "{\"chain\": \"fast\",}", "{\"a\": NaN}", "chain: fast\n", "{'chain': 'fast'}",
             "{\"chain\": \"fast\"} # comment", "{\"frames\": 010}",
             "{\"input\": \"a.exr\",\n \"input\": \"b.exr\"}"})
        EXPECT_EQ(refused(text).diagnostics.size(), 1u) << text.substr(0, 50);
    json many = whole_;
    while (many.size() < 257) many[concat("key", many.size())] = 1;
    EXPECT_THAT(refused(many).detail, HasSubstr("more than 256 keys in one map"));
    // Forms of JSON that are unusual in YAML.
    for (const char* text :
         {"{\"chain\":\n\t\"fast\",\r\n\t\"input\"\t:\t\"in.####.exr\" , \"output\":\"out\\/"
          "\\u006f\\ud83d\\ude00.####.exr\"}",
          "\xef\xbb\xbf{\"chain\":\"fast\",\"input\":\"in.####.exr\",\"output\":"
          "\"out/o\xf0\x9f\x98\x80.####.exr\",\"set\":[ ],\"strict\":true,\"priority\":-0}\n\n"})
        EXPECT_EQ(taken(text).output, root("out/o\xf0\x9f\x98\x80.####.exr"));
}

// Every key that names files, in every form.
TEST_F(RequestTest, NoPathLeavesTheRoots) {
    const json run = json::object();
    const json ab = {{"kind", "ab"}, {"output", "report"}, {"chain_b", "best"}};
    const std::tuple<json, const char*, const char*> attacks[] = {
        {run, "input", "../outside/in.####.exr"},
        {run, "input", "link/in.####.exr"},
        {run, "input", "color=in.####.exr,depth=../outside/d.####.exr"},
        {run, "output", "../o.####.exr"},
        {run, "output", "link/o.####.exr"},
        {run, "camera", "link/camera.json"},
        {run, "profile", "/etc/passwd"},
        {run, "chain", "link/chain.yaml"},
        {run, "behind", "../outside/in.####.exr"},
        {ab, "chain_b", "../outside/chain.yaml"},
        {ab, "truth", "../outside/t.####.exr"},
        {ab, "output", "../report"}};
    for (const auto& [kind, key, value] : attacks) {
        json body = with(kind);
        body[key] = value;
        const Problem problem = refused(body);
        EXPECT_EQ(problem.kind, Problem::Kind::forbidden) << key << " " << value;
        EXPECT_EQ(problem.diagnostics.at(0).path, key);
        // Only the path that the client has given.
        EXPECT_THAT(text_of(problem.diagnostics), Not(HasSubstr(base_ + "/outside"))) << key;
        body["priority"] = 101;
        EXPECT_EQ(refused(body).kind, Problem::Kind::invalid) << "with another fault";
    }
}

}  // namespace
}  // namespace postchain::service
