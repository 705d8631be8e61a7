// What the calls of a test say, compared whole with a file at its end (POSTCHAIN_UPDATE=1 writes
// it). What varies is replaced by a word.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <string>

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
        static const std::regex varying("(texture|limit is|(?:1 to|up to)(?= [0-9]{5})) [0-9]+");
        const std::string one = std::regex_replace(line, varying, "$1 N") + "\n";
        if (current_ && !current_->text_.ends_with("\n" + one)) current_->text_ += one;
    }

  private:
    inline static Transcript* current_ = nullptr;
    std::filesystem::path path_;
    std::string text_;
};

}  // namespace postchain::test
