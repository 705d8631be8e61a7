// A folder with a few small frames and chain files, and helper functions.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/command/command.h"
#include "tests/command/frames.h"

namespace postchain::test {

class CommandTest : public testing::Test {
  protected:
    void SetUp() override {
        std::filesystem::create_directory(at("out"));
        write_text(at("all.yaml"), kAllPasses);
        write_text(at("reversed.yaml"), kReversed);
        write_text(at("fxaa.yaml"), kFxaa);
        write_text(at("motion_blur.yaml"), kMotionBlur);
    }
    void TearDown() override {
        // Every test must leave only finished files.
        if (std::filesystem::is_directory(at("out"))) {
            EXPECT_EQ(temporaries(at("out")), std::vector<std::string>());
        }
    }

    std::string at(const std::string& name) const { return folder_.path(name); }
    std::string in() const { return at("in.####.exr"); }
    std::string out() const { return at("out/o.####.exr"); }
    std::string in(int frame) const { return numbered("in.", frame); }
    std::string out(int frame) const { return numbered("out/o.", frame); }
    bool exists(const std::string& path) const { return std::filesystem::exists(path); }
    std::vector<std::string> outputs() const {
        std::vector<std::string> names;
        for (const auto& entry : std::filesystem::directory_iterator(at("out")))
            if (entry.path().extension() == ".exr")
                names.push_back(entry.path().filename().string());
        std::sort(names.begin(), names.end());
        return names;
    }
    // run CHAIN.yaml over in.####.exr into out/o.####.exr.
    Outcome filter(const std::string& chain, const Arguments& more = {},
                   const Launch& launch = {}) {
        return run(joined({"run", at(chain + ".yaml"), "-i", in(), "-o", out()}, more), launch);
    }
    Json sidecar(int frame) const {
        Json json = Json::parse(read_text(out(frame) + ".json"), nullptr, false);
        EXPECT_TRUE(json.is_object()) << "sidecar of frame " << frame;
        return json.is_object() ? json : Json::object();
    }

    TempFolder folder_;

  private:
    std::string numbered(const char* prefix, int frame) const {
        char number[32];
        std::snprintf(number, sizeof(number), "%04d.exr", frame);
        return at(std::string(prefix) + number);
    }
};

}  // namespace postchain::test
