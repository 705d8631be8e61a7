// Requests of a page to the service: folders, chains, jobs by search, places in the queue, and the
// pictures of a report one by one.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "tests/service/store_fixture.h"
#include "tools/sequence/files/json.h"
#include "tools/service/http/message.h"
#include "tools/service/http/report_parts.h"
#include "tools/service/work/browse.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using io::Json;

void write(const std::string& path, const std::string& text) {
    fs::create_directories(fs::path(path).parent_path());
    std::ofstream(path, std::ios::binary) << text;
}

class BrowseTest : public testing::Test {
  protected:
    void SetUp() override {
        base_ = fs::canonical(folder_.path()).string();
        for (const char* name : {"a.0001.exr", "a.0002.exr", "a.0004.exr", "still.exr"})
            write(base_ + "/root/shots/" + name, "x");
        write(base_ + "/root/shots/camera.json", "{\"f_stop\": 2, \"focus_distance\": 1}");
        write(base_ + "/root/shots/own.yaml", "postchain: 1\npasses: [fxaa]\n");
        write(base_ + "/root/shots/order.yaml", "postchain_study: 1\n");
        write(base_ + "/root/shots/notes.yaml", "text: 1\n");
        write(base_ + "/root/shots/parts.yml", "passes: [fxaa]\n");
        write(base_ + "/root/shots/short.yml", "postchain: 1\npasses: [fxaa]\n");
        write(base_ + "/root/shots/a.0001.json", "{\"f_stop\": 2}");  // a sidecar
        write(base_ + "/root/.hidden/a.exr", "x");
        write(base_ + "/secret/camera.json", "{\"f_stop\": 2}");
        write(base_ + "/second/b/c.exr", "x");
        fs::create_symlink(base_ + "/secret", base_ + "/root/way_out");
    }
    Roots roots(const std::vector<std::string>& names) const {
        std::vector<std::string> folders;
        for (const std::string& name : names) folders.push_back(base_ + "/" + name);
        return *Roots::of(folders);
    }
    static Json json(const Answer<std::string>& answer) {
        return Json::parse(std::get<std::string>(answer));
    }
    static Problem::Kind kind(const Answer<std::string>& answer) {
        return std::get<Problem>(answer).kind;
    }
    static Json paths(const Json& list) {
        Json found = Json::array();
        for (const Json& one : list) found.push_back(one["path"]);
        return found;
    }
    test::TempFolder folder_;
    std::string base_;
};

TEST_F(BrowseTest, TheOnlyRootAndAFolderInIt) {
    const Json root = json(browse("", roots({"root"})));
    EXPECT_EQ(root["folder"], ".");
    EXPECT_TRUE(root["parent"].is_null());
    EXPECT_EQ(paths(root["folders"]), Json({"shots"}));  // neither hidden nor outside
    const Json shots = json(browse("shots", roots({"root"})));
    EXPECT_EQ(shots["parent"], ".");
    EXPECT_EQ(paths(shots["sequences"]), Json({"shots/a.####.exr", "shots/still.exr"}));
    EXPECT_EQ(shots["sequences"][0]["frames"], "1-2,4");
    EXPECT_EQ(shots["sequences"][0]["count"], 3);
    EXPECT_EQ(shots["cameras"], Json({"shots/camera.json"}));
    EXPECT_EQ(shots["chains"], Json({"shots/own.yaml", "shots/short.yml"}));
    EXPECT_EQ(shots["studies"], Json({"shots/order.yaml"}));
}

TEST_F(BrowseTest, SeveralRoots) {
    const Roots two = roots({"root", "second"});
    EXPECT_EQ(paths(json(browse("", two))["folders"]), Json({".", base_ + "/second"}));
    EXPECT_EQ(json(browse(".", two))["parent"], "");
    EXPECT_EQ(json(browse(base_ + "/second/b", two))["parent"], base_ + "/second");
    EXPECT_EQ(paths(json(browse("", *two.within({"shots"})))["sequences"]),
              Json({"shots/a.####.exr", "shots/still.exr"}));
}

TEST_F(BrowseTest, RefusalsNameNoPathOutside) {
    const Roots root = roots({"root"});
    for (const char* folder : {"..", "/etc", "way_out", "shots/../../secret"})
        EXPECT_EQ(kind(browse(folder, root)), Problem::Kind::forbidden) << folder;
    const auto none = browse("shots/none", root);
    EXPECT_EQ(kind(none), Problem::Kind::not_found);
    EXPECT_EQ(std::get<Problem>(none).detail.find(base_), std::string::npos);
    // No other file is read, and no pipe is waited for.
    ASSERT_EQ(mkfifo((base_ + "/root/shots/pipe.yaml").c_str(), 0600), 0);
    for (const auto& [file, expected] : std::vector<std::pair<const char*, Problem::Kind>>{
             {"/etc/passwd", Problem::Kind::forbidden},
             {"shots/pipe.yaml", Problem::Kind::not_found},
             {"shots", Problem::Kind::not_found},
             {"shots/notes.yaml", Problem::Kind::invalid},
             {"shots/a.0001.exr", Problem::Kind::invalid}})
        EXPECT_EQ(kind(chains_of(file, root)), expected) << file;
    EXPECT_EQ(json(browse("shots", roots({"root"})))["chains"],
              Json({"shots/own.yaml", "shots/short.yml"}));
}

TEST_F(BrowseTest, HasALimitOfFilesAndOfTheirBytes) {
    const std::string chain = "postchain: 1\npasses: [fxaa]\n";
    const auto listed = [&](const std::string& folder) {
        return json(browse(folder, roots({"root"})))["chains"].size();
    };
    for (int i = 1; i <= 101; ++i) {
        write(concat(base_, "/root/many/c", 1000 + i, "x.yaml"), chain);
        if (i >= 100) {
            EXPECT_EQ(listed("many"), 100u) << i << " files";
        }
    }
    const size_t most = size_t(1) << 18;
    const auto of_bytes = [&](size_t bytes) {
        return chain + "#" + std::string(bytes - chain.size() - 1, 'a');
    };
    write(base_ + "/root/large/most.yaml", of_bytes(most));
    write(base_ + "/root/large/more.yaml", of_bytes(most + 1));
    EXPECT_EQ(json(browse("large", roots({"root"})))["chains"], Json({"large/most.yaml"}));
}

TEST_F(BrowseTest, ChainsWithTheirTexts) {
    const Json shipped = json(chains_of("", roots({"root"})))["chains"];
    ASSERT_GE(shipped.size(), 5u);
    EXPECT_EQ(shipped[0]["name"], "balanced");
    const Json own = json(chains_of("shots/own.yaml", roots({"root"})))["chains"];
    EXPECT_EQ(own[0]["text"], "postchain: 1\npasses: [fxaa]\n");
}

// Bytes of memory that this process has used at most.
size_t most_memory() {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;)
        if (size_t kib = 0; word == "VmHWM:" && status >> kib) return kib << 10;
    return 0;
}

class PartsTest : public BrowseTest {
  protected:
    // The text of a picture, or the page without pictures; "none": the problem's status is 404.
    std::string part(const std::string& id = "", const std::string& name = "page.html") {
        const auto found = parts_.find(base_ + "/" + name, id);
        if (const auto* wrong = std::get_if<Problem>(&found))
            return wrong->kind == Problem::Kind::not_found ? "none" : wrong->detail;
        const Reply reply = parts_reply({base_ + "/" + name, name, "text/html", 0},
                                        std::get<std::vector<FilePart>>(found));
        std::string text;
        for (auto next = reply.file->next(); next.ok() && !next->empty(); next = reply.file->next())
            text += *next;
        EXPECT_EQ(text.size(), reply.file->bytes());
        return text;
    }
    PageParts parts_;
};

TEST_F(PartsTest, AReportInParts) {
    const std::string path = base_ + "/page.html";
    const std::string others =
        "<script type=\"text/plain\" id=\"image-20\">without an end\n"
        "<script type=\"text/plain\" id=\"image-21</script>\">\n";
    const std::string large(200'000, 'B');
    write(path,
          "<html>\n<script type=\"text/plain\" id=\"view.vert\">v</script>\n"
          "<script type=\"text/plain\" id=\"image-0\">AAAA</script>\n"
          "<script type=\"text/plain\" id=\"image-10\">" +
              large + "</script>\n" + others + "</html>");
    EXPECT_EQ(part(), "<html>\n<script type=\"text/plain\" id=\"view.vert\">v</script>\n" + others +
                          "</html>");
    EXPECT_EQ(part("image-10"), large);
    EXPECT_EQ(part("image-0"), "AAAA");
    for (const char* none : {"image-1", "image-20", "image-21", "image-21</script>", "view.vert"})
        EXPECT_EQ(part(none), "none");
    // A page that has changed is read again.
    write(path, "\n<script type=\"text/plain\" id=\"image-10\">CCCCCC</script>\n");
    EXPECT_EQ(part("image-10"), "CCCCCC");
    EXPECT_EQ(part("image-0"), "none");
    EXPECT_EQ(part("", "none.html"), "none");
}

// Its user may have written it.
TEST_F(PartsTest, AForgedReportTakesNoMemory) {
    const std::string path = base_ + "/page.html";
    write(path, "<html>\n");
    fs::resize_file(path, size_t(1) << 28);
    const size_t before = most_memory();
    EXPECT_TRUE(std::holds_alternative<std::vector<FilePart>>(parts_.find(path)));
    write(path, "<script type=\"text/plain\" id=\"image-1\">");
    fs::resize_file(path, size_t(1) << 28);
    EXPECT_EQ(part("image-1"), "none");
    EXPECT_LT(most_memory() - before, size_t(16) << 20);
    fs::resize_file(path, PageParts::kMostBytes + 1);
    EXPECT_EQ(part(), "the page of the report is larger than 4 GiB");
    for (const char* between : {"", "\n"}) {
        std::string many;
        for (size_t i = 0; i <= PageParts::kMostPictures; ++i)
            many += concat("<script type=\"text/plain\" id=\"image-", *between ? 1 : i,
                           "\"></script>\n", between);
        write(path, many);
        EXPECT_EQ(part(), "the page of the report has more than 100000 pictures");
    }
}

TEST_F(StoreTest, SearchFindsWordsInNamesAndPathsOnly) {
    const auto found = [&](const std::string& search, const std::string& state = "") {
        std::string ids;
        const auto jobs = store_->jobs(state, "", 100, "", search);
        for (const Job& job : *jobs) ids += job.id;
        return ids;
    };
    const User ann = user_of("ann");
    add(0, ann, R"({"input": "shots/Alpha.####.exr", "output": "out/a.exr", "chain": "balanced"})");
    add(0, user_of("bob"), R"({"input": "shots/beta.####.exr", "chain": {"passes": ["fxaa"]}})");
    add(0, ann, "not JSON");
    for (const auto& [search, ids] : std::vector<std::pair<const char*, const char*>>{
             {"", "321"},
             {"alpha", "1"},
             {"  BALANCED ann ", "1"},
             // Sixteen words count.
             {"a a a a a a a a a a a a a a a alpha", "1"},
             {"a a a a a a a a a a a a a a a a alpha", "321"},
             {"ann beta", ""},
             {"fxaa", "2"},
             {"input", ""},  // a key, not a value
             {"ann", "31"},
             {"%", ""},
             {"') OR 1 --", ""}})
        EXPECT_EQ(found(search), ids) << search;
    EXPECT_EQ(found("ann", "running"), "");
}

// The order in which jobs are in fact taken.
TEST_F(StoreTest, PlacesAreThoseOfTheQueue) {
    const char* owners[] = {"ann", "ann", "ann", "bob", "carl", "bob", "ann", "carl", "bob"};
    const int priorities[] = {0, 5, 0, 0, 0, 5, 0, 5, 0};
    for (int i = 0; i < 9; ++i) add(priorities[i], user_of(owners[i]));
    // Turns of the past.
    EXPECT_TRUE(*store_->start("4"));
    EXPECT_TRUE(*store_->cancel("4"));
    const QueuePlaces places = *store_->places();
    EXPECT_EQ(places.size(), 8u);
    EXPECT_FALSE(places.contains("4"));
    for (int place = 1; place <= 8; ++place) {
        const std::string id = (**store_->next(-100)).id;
        EXPECT_EQ(places.at(id), place) << id;
        EXPECT_TRUE(*store_->start(id));
    }
}

}  // namespace
}  // namespace postchain::service
