// Cryptomatte manifests, which frames name: a service reads them only under its roots.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/command/frames.h"
#include "tests/service/support.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

// Frames with the manifest root/man.json, which is a link.
class ManifestsOfAService : public test::ServiceTest {
  protected:
    void SetUp() override {
        ServiceTest::SetUp();
        test::FrameFile file;
        for (const char* channel : {"r", "g", "b", "a"})
            file.mattes[concat("crypto00.", channel)] = ImageF(24, 16, 1);
        file.attributes = {{"cryptomatte/1234567/name", "crypto"},
                           {"cryptomatte/1234567/manif_file", "man.json"}};
        test::write_sequence(root(), {1, 2}, 24, 16, file);
        fs::create_directory(root("more"));
        std::ofstream(root("more/names.json")) << R"({"inside": "00000007"})";
        std::ofstream(outside("names.json")) << R"({"secret": "00000007"})";
        open();
    }
    void link(const std::string& target) const {
        fs::remove(root("man.json"));
        fs::create_symlink(target, root("man.json"));
    }
    // All replies about a request for the matte zzz: faults, messages, warnings, sidecars.
    std::string plan() {
        const auto answer = service_->plan(user(), chain({{"input", "in.####.exr"}}).dump());
        if (const auto* problem = std::get_if<Problem>(&answer)) return problem->detail;
        return std::get<std::string>(answer);
    }
    std::string preview() {
        const std::string asked = chain({{"input", "in.####.exr"}, {"frame", 1}}).dump();
        const auto answer = answer_to(previewing(asked));
        const auto* problem = std::get_if<Problem>(&answer);
        return problem ? problem->detail : "an image";
    }
    std::string work(const std::string& kind) {
        json body = chain({{"kind", kind}, {"output", concat(kind, ++jobs_)}});
        if (kind == "study") {
            std::ofstream(root("held.json")) << body["chain"];
            std::ofstream(root("plain.json")) << R"({"postchain": 1, "passes": ["fxaa"]})";
            body.erase("chain");
            body["study"] = json::parse(R"({
                "postchain_study": 1, "settings": {"repeats": 1},
                "chains": {"held": "held.json", "plain": "plain.json"},
                "scenes": [{"name": "s", "input": "in.####.exr", "truth": "in.####.exr"}]})");
        } else {
            body["input"] = "in.####.exr";
            body["frames"] = "1";
        }
        if (kind == "run") body["output"] = concat("out/o", jobs_, ".####.exr");
        if (kind == "ab") body["chain_b"] = {{"postchain", 1}, {"passes", json::array()}};
        if (kind == "bench") body.update({{"sweep", {"fxaa.preset=12,39"}}, {"split_frames", 0}});
        if (kind == "ab" || kind == "bench") body["repeats"] = 1;
        const Job job = ran(body.dump());
        std::string said = job.message + job.verdict;
        for (const JobFrame& frame : frames(job.id)) said += frame.message + frame.sidecar;
        return said;
    }
    std::vector<std::string> replies() {
        return {plan(), preview(), work("run"), work("ab"), work("bench"), work("study")};
    }
    static json chain(json more) {
        more["chain"] = {{"postchain", 1},
                         {"passes", {{{"fxaa", {{"matte", "cryptomatte:zzz"}}}}}}};
        return more;
    }
    int jobs_ = 0;
};

TEST_F(ManifestsOfAService, AreReadUnderItsRoots) {
    link("more/names.json");
    for (const std::string& said : replies())
        EXPECT_THAT(said, HasSubstr("no 'zzz' in the cryptomatte; it has inside"));
}

TEST_F(ManifestsOfAService, AreNotReadElsewhere) {
    link(outside("names.json"));
    for (const std::string& said : replies()) EXPECT_THAT(said, Not(HasSubstr("no 'zzz'")));
    // The reply does not reveal whether the file exists.
    for (const char* name : {"names.json", "none.json"}) {
        link(outside(name));
        EXPECT_THAT(work("run"), AllOf(HasSubstr("man.json' is outside the folders"),
                                       HasSubstr("'zzz' is found by the hash of its name")));
    }
}

}  // namespace
}  // namespace postchain::service
