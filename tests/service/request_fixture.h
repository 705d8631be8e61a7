// Reads requests for a folder of two small frames; a folder beside it must not be reached.
#pragma once

#include <gtest/gtest.h>

#include <concepts>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "passes/registry.h"
#include "tests/command/frames.h"
#include "tests/io/exr_files.h"
#include "tools/service/work/job_request.h"

namespace postchain::service {

class RequestTest : public testing::Test {
  protected:
    void SetUp() override {
        base_ = std::filesystem::canonical(folder_.path()).string();
        std::filesystem::create_directories(base_ + "/root/out");
        std::filesystem::create_directories(base_ + "/outside");
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
    template <std::same_as<nlohmann::json> Json>
    Problem refused(const Json& body) {
        return refused(body.dump());
    }
    JobRequest taken(const std::string& body) {
        auto read = reader_->job(body);
        if (auto* request = std::get_if<JobRequest>(&read)) return std::move(*request);
        throw std::runtime_error(text_of(std::get<Problem>(read).diagnostics));
    }
    template <std::same_as<nlohmann::json> Json>
    JobRequest taken(const Json& body) {
        return taken(body.dump());
    }
    nlohmann::json with(const nlohmann::json& more) const {
        nlohmann::json body = whole_;
        body.update(more);
        return body;
    }
    nlohmann::json with(const std::string& key, const nlohmann::json& value) const {
        return with(nlohmann::json{{key, value}});
    }

    test::TempFolder folder_;
    std::string base_, version_ = "test";
    Roots roots_;
    std::unique_ptr<JobReader> reader_;
    nlohmann::json whole_;
};

}  // namespace postchain::service
