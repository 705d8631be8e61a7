// What the calls of a test say, compared whole with a file at its end (POSTCHAIN_UPDATE=1 writes
// it). What varies is replaced by a word.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <utility>

#include "tests/support/text_file.h"

namespace postchain::test {

class Transcript {
  public:
    // The file SUITE.TEST of the folder.
    explicit Transcript(const std::filesystem::path& folder) {
        const auto& test = *testing::UnitTest::GetInstance()->current_test_info();
        path_ = folder / (std::string(test.test_suite_name()) + "." + test.name());
        current_ = this;
    }
    ~Transcript() {
        current_ = nullptr;
        expect_text_of(path_, text_);
    }
    Transcript(const Transcript&) = delete;
    Transcript& operator=(const Transcript&) = delete;

    // A line of the transcript that is now being made, if there is one; equal ones in a row once.
    static void say(const std::string& line) {
        const std::string one = without_numbers(line) + "\n";
        if (current_ && !current_->text_.ends_with("\n" + one)) current_->text_ += one;
    }

  private:
    // Numbers of textures and of the device's limits are N. <regex> takes seconds to compile.
    static std::string without_numbers(std::string text) {
        for (const auto& [before, digits] : {std::pair<std::string, size_t>("texture ", 1),
                                             {"limit is ", 1},
                                             {"1 to ", 5},
                                             {"up to ", 5}})
            for (size_t at = 0; (at = text.find(before, at)) != text.npos;) {
                at += before.size();
                const size_t end = std::min(text.find_first_not_of("0123456789", at), text.size());
                if (end - at >= digits) text.replace(at, end - at, "N");
            }
        return text;
    }

    inline static Transcript* current_ = nullptr;
    std::filesystem::path path_;
    std::string text_;
};

}  // namespace postchain::test
