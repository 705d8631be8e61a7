// Mattes: previews at full size and reduced; manifests, which are read only under the roots.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/command/frames.h"
#include "tests/service/support.h"
#include "tests/support/images.h"
#include "tools/sequence/image/contact_sheet.h"

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

// Frames with mattes: "all" is 1, "none" 0 and "half" 0.5 everywhere, "checker" alternates between
// 1 and 0, "left" is 1 in the left half.
class MattePreviews : public test::ServiceTest {
  protected:
    void SetUp() override {
        ServiceTest::SetUp();
        test::FrameFile file;
        const auto matte = [&](const char* name, const std::function<float(int, int, int)>& value) {
            file.mattes[concat("mask.", name)] = test::make_image(kWidth, kHeight, 1, value);
        };
        matte("all", [](int, int, int) { return 1; });
        matte("none", [](int, int, int) { return 0; });
        matte("half", [](int, int, int) { return 0.5f; });
        matte("checker", [](int x, int y, int) { return float((x + y) % 2); });
        matte("left", [](int x, int, int) { return x < kWidth / 2 ? 1.0f : 0.0f; });
        test::write_sequence(root(), {1, 2, 3}, kWidth, kHeight, file);
        open();
    }
    // Two passes, so that one plane holds mattes of two names.
    static std::string chain(const std::string& blur, const std::string& fxaa) {
        const auto matte = [](const std::string& name) {
            return name.empty() ? "" : concat(R"("matte": "mask.)", name, "\"");
        };
        return concat(R"("chain": {"postchain": 1, "passes": [{"motion_blur": {)", matte(blur),
                      R"(}}, {"fxaa": {)", matte(fxaa), "}}]}");
    }
    ImageF preview(const std::string& chain, double scale) {
        const std::string asked =
            concat("{", chain, R"(, "input": "in.####.exr", "frame": 2, "scale": )", scale, "}");
        const Picture exr = picture(previewing(asked, {"image/x-exr"}));
        std::ofstream(root("preview.exr"), std::ios::binary) << exr.bytes;
        return test::read_color(root("preview.exr"));
    }
    static constexpr int kWidth = 48, kHeight = 32;
};

TEST_F(MattePreviews, AtItsSizeItIsWhatARunWrites) {
    const std::string held = chain("left", "half");
    done(submit(concat("{", held, R"(, "input": "in.####.exr", "frames": "2",
        "output": "out/o.####.exr"})")));
    const ImageF written = test::read_color(root("out/o.0002.exr")), shown = preview(held, 1);
    EXPECT_EQ(shown.data, written.data);
    const ImageF input = test::make_planes(kWidth, kHeight, 2).color;
    double moved = 0;
    for (int x = kWidth / 2; x < kWidth; ++x)
        moved = std::max(moved, double(std::abs(shown.at(x, 14, 0) - input.at(x, 14, 0))));
    EXPECT_GT(moved, 0.05) << "nothing is blurred where the matte is 0";
}

TEST_F(MattePreviews, ReducedTheMatteIsTheMeanOfWhatAPixelCovers) {
    const ImageF plain = preview(chain("", ""), 0.5), held = preview(chain("all", "all"), 0.5);
    ASSERT_EQ(held.width, kWidth / 2);
    EXPECT_EQ(preview(chain("none", "none"), 0.5).data, plain.data);
    const ImageF input =
        io::shrunk(test::make_planes(kWidth, kHeight, 2).color, kWidth / 2, kHeight / 2);
    EXPECT_LT(test::largest_difference(held, input), 1e-6);
    EXPECT_GT(test::largest_difference(held, plain), 0.05);
    const ImageF soft = preview(chain("half", "none"), 0.5);
    EXPECT_EQ(preview(chain("checker", "none"), 0.5).data, soft.data);
    EXPECT_GT(test::largest_difference(soft, plain), 0.01);
    EXPECT_GT(test::largest_difference(soft, held), 0.01);
    // FXAA leaves out the left half: each plane of the stack is reduced by itself.
    const ImageF left = preview(chain("left", "all"), 0.5);
    for (int y = 0; y < kHeight / 2; ++y)
        for (int x = 0; x < kWidth / 4; ++x)
            ASSERT_NEAR(left.at(x, y, 0), held.at(x, y, 0), 1e-6) << x << " " << y;
    EXPECT_GT(test::largest_difference(left, held), 0.05);
}

}  // namespace
}  // namespace postchain::service
