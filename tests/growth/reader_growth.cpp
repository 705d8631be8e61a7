// Readers of texts and requests, with texts that are wide, deep or long in one place.
// Usage: reader_growth doubled|whole|times FOLDER
// FOLDER is empty, and gets a file.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>

#include "config/camera_file.h"
#include "config/chain_file.h"
#include "config/profile.h"
#include "growth.h"
#include "passes/registry.h"
#include "tests/service/schemas.h"
#include "tools/measure/study/study_reader.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/files/sequence.h"
#include "tools/sequence/settings/job_settings.h"
#include "tools/service/work/job_request.h"

namespace postchain::growth {
namespace {

namespace fs = std::filesystem;
using io::Json;

struct Shape {
    const char* name;
    std::function<std::string(size_t bytes)> text;
};

// `item` again and again; each # in it is the number of the repetition.
std::string repeated(const std::string& item, size_t bytes) {
    std::string text;
    for (size_t i = 0; text.size() + item.size() + 8 < bytes; ++i)
        for (const char c : item)
            if (c == '#')
                text += std::to_string(i);
            else
                text += c;
    return text;
}

Shape shape(const char* name, const std::string& before, const std::string& item,
            const std::string& after = "") {
    return {name, [=](size_t bytes) {
                return before + repeated(item, bytes - before.size() - after.size()) + after;
            }};
}

// Whole documents.
std::vector<Shape> documents() {
    return {shape("JSON map", "{", "\"k#\":1,", "\"z\":1}"),
            shape("JSON map of frames", "{\"frames\":{", "\"#\":{},", "\"9999999\":{}}}"),
            shape("JSON matrices", "{\"camera_matrix_world\":{",
                  "\"#\":[[1,0,0,0],[0,1,0,0],[0,0,1,0]],", "\"9999999\":1}}"),
            shape("JSON list", "{\"passes\":[", "1,", "1]}"),
            shape("JSON maps", "[", "{\"a\":1},", "1]"),
            shape("JSON maps of 256", "[",
                  "{" + repeated("\"key_number_#\":1,", 4300) + "\"z\":1},", "1]"),
            shape("JSON nesting", "", "["),
            shape("JSON text", "{\"postchain\":\"", "\\n\xc3\xa9", "\"}"),
            shape("JSON number", "{\"postchain\":", "1", "}"),
            shape("JSON of no end", "{", "\"k#\":1,"),
            shape("YAML map", "", "k#: 1\n"),
            shape("YAML map of frames", "frames:\n", "  #: {}\n"),
            shape("YAML list", "passes:\n", "- fxaa\n"),
            shape("YAML flow", "passes: [", "fxaa: {},", "fxaa]"),
            shape("YAML flow of keys", "{", "a#, ", "a}"),
            shape("YAML flow of colons", "[", "a:,", "a]"),
            shape("YAML map of maps", "{", "{a}: 1,", "a: 1}"),
            shape("YAML unknown keys of passes", "postchain: 1\npasses:\n", "- fxaa: {key_#: 1}\n"),
            shape("YAML nesting", "", "- "),
            shape("YAML nested lists", "[", "[[[[[[[[[[[[[]]]]]]]]]]]]],", "1]"),
            shape("YAML duplicates", "", "a: 1\n"),
            shape("YAML complex keys", "", "? a\n"),
            shape("YAML anchors", "", "- &a# 1\n"),
            shape("YAML tags", "", "- !t 1\n"),
            shape("YAML comments", "", "# comment\n", "a: 1\n"),
            shape("YAML empty lines", "a: x", "\n", " y\n"),
            shape("YAML folded lines", "a: >\n", " x\n\n"),
            shape("YAML quoted", "a: \"", "\\x41 \n ", "\"\n"),
            shape("YAML documents", "", "---\n- a\n"),
            shape("spaces", "", " ", "a: 1"),
            shape("commas", "[", ",", "]"),
            shape("control characters", "a: ", "x", "\x01")};
}

// Values of a key, as JSON.
std::vector<Shape> values() {
    return {shape("text", "\"", "x", "\""),
            shape("commas", "\"", "a,", "a\""),
            shape("slashes", "\"", "../", "a\""),
            shape("planes", "\"color=", ",", "\""),
            shape("frames", "\"", "#,", "1\""),
            shape("ranges", "\"", "1-500000,", "1\""),
            shape("numbers", "\"", "####.", "exr\""),
            shape("equals", "\"", "a=1,", "b=2\""),
            shape("list", "[", "\"fxaa.contrast=0.#\",", "\"a\"]"),
            shape("list of numbers", "[", "1,", "1]"),
            shape("map", "{", "\"k#\":1,", "\"z\":1}"),
            shape("nesting", "[[[[[[[[[[", "[],", "1]]]]]]]]]]"),
            shape("chain of passes", "{\"postchain\":1,\"passes\":[", "\"fxaa\",", "\"fxaa\"]}"),
            shape("number", "1", "0")};
}

class Cases {
  public:
    explicit Cases(const std::string& folder) : folder_(fs::canonical(folder).string()) {
        std::ofstream(folder_ + "/in.0001.exr") << "not an EXR file";
        roots_ = *service::Roots::of({folder_});
        using service::RequestKind;
        for (const auto& [kind, text] : {std::pair(RequestKind::run, test::kRunSchema),
                                         {RequestKind::ab, test::kAbSchema},
                                         {RequestKind::study, test::kStudySchema},
                                         {RequestKind::plan, test::kRunSchema},
                                         {RequestKind::preview, test::kRunSchema}})
            schemas_[kind] = Json::parse(text);
        reader_ = std::make_unique<service::JobReader>(roots_, schemas_);
        add_readers();
        add_words();
        add_requests();
    }
    const std::vector<Case>& all() const { return all_; }

  private:
    void add(const std::string& reader, const std::vector<Shape>& shapes,
             const std::function<void(const std::string&)>& run) {
        for (const Shape& one : shapes) all_.push_back({reader + ": " + one.name, one.text, run});
    }

    void add_readers() {
        add("chain", documents(),
            [](const std::string& text) { parse_chain(text, "chain.yaml", builtin_passes()); });
        add("camera", documents(), [](const std::string& text) { parse_camera(text, "c.json"); });
        add("profile", documents(), [](const std::string& text) { parse_profile(text, "p.yaml"); });
        add("study", documents(), [this](const std::string& text) {
            const std::string file = folder_ + "/study.yaml";
            study::read_study(text, file, builtin_passes(), study::paths_beside(file), "0");
        });
        add("record", documents(), [](const std::string& text) { (void)io::read_json(text, "r"); });
        add("report", documents(), [](const std::string& text) {
            if (const auto json = io::read_json(text, "r", io::kReportLimits); json.ok())
                (void)io::json_text(*json);
        });
    }

    // Parsers of a word, whose text is not in quotes.
    void add_words() {
        std::vector<Shape> words;
        for (const Shape& one : values())
            words.push_back({one.name, [text = one.text](size_t bytes) {
                                 const std::string quoted = text(bytes);
                                 return quoted.substr(1, quoted.size() - 2);
                             }});
        add("range", words, [](const std::string& text) { (void)io::FrameRange::parse(text); });
        add("pattern", words, [](const std::string& text) { (void)io::PathPattern::parse(text); });
        add("input", words, [](const std::string& text) { (void)io::InputSpec::parse(text); });
        add("override", words, [](const std::string& text) {
            parse_chain("postchain: 1\npasses: [fxaa]\n", "c", builtin_passes(), {text});
        });
    }

    void add_requests() {
        add("POST /v1/chain/check", documents(), [this](const std::string& text) {
            (void)service::check_chain_text(io::json_text({{"text", text}}), roots_,
                                            builtin_passes());
        });
        add("PATCH /v1/jobs/{id}", documents(),
            [this](const std::string& text) { (void)service::read_priority(text, roots_); });
        const Json schema = service::job_schema(schemas_);
        std::set<std::string> keys = {"kind"};  // most belong to several kinds
        for (const Json& kind : schema.at("oneOf"))
            for (const auto& [key, value] : kind.at("properties").items())
                if (keys.insert(key).second) add_key(kind.at("title").get<std::string>(), key);
        for (const char* key : {"chain", "input", "camera", "frames"}) {
            add_key("plan", key);
            add_key("preview", key);
        }
    }

    // A whole request but for one key.
    void add_key(const std::string& kind, const std::string& key) {
        Json whole = {{"kind", kind}, {"chain", "fast"}, {"input", "in.####.exr"}};
        if (kind == "run") whole["output"] = "out.####.exr";
        if (kind == "study")
            whole = {{"kind", kind}, {"study", {{"postchain_study", 1}}}, {"output", "out"}};
        const bool asks = kind == "plan" || kind == "preview";
        if (asks) whole.erase("kind");
        if (kind == "preview") whole["frame"] = 1;
        whole.erase(key);
        std::string head = io::json_text(whole);
        head.pop_back();
        head += ", \"" + key + "\": ";
        std::vector<Shape> bodies;
        for (const Shape& one : values())
            bodies.push_back({one.name, [head, text = one.text](size_t bytes) {
                                  return head + text(bytes - head.size() - 1) + "}";
                              }});
        const std::string route =
            kind == "plan" || kind == "preview" ? "POST /v1/" + kind : "POST /v1/jobs " + kind;
        add(route + " " + key, bodies, [this, kind](const std::string& body) {
            if (kind == "plan")
                (void)reader_->plan(body);
            else if (kind == "preview")
                (void)reader_->preview(body);
            else
                (void)reader_->job(body);
        });
    }

    const std::string folder_;
    service::Roots roots_;
    service::Schemas schemas_;
    std::unique_ptr<service::JobReader> reader_;
    std::vector<Case> all_;
};

}  // namespace
}  // namespace postchain::growth

int main(int argc, char** argv) {
    if (argc == 3) {
        const postchain::growth::Cases cases(argv[2]);
        return postchain::growth::run_cases(cases.all(), argv[1]);
    }
    std::fprintf(stderr, "usage: reader_growth doubled|whole|times FOLDER\n");
    return 2;
}
