#pragma once

#include <cstdlib>
#include <set>
#include <sstream>

#include "tests/command/fixture.h"

namespace postchain::test {

// Bash's completions.
class Completion : public CommandTest {
  protected:
    // After these words, with the programs of the build on the PATH.
    std::set<std::string> offered(const std::vector<std::string>& words) {
        write_text(at("completion"), run({"completion"}).out);
        std::string script = "source " + at("completion") + "\nCOMP_WORDS=(";
        for (const auto& word : words) script += "'" + word + "' ";
        script += ")\nCOMP_CWORD=" + std::to_string(words.size() - 1) +
                  "\n$(complete -p postchain | sed 's/.*-F \\([a-z_]*\\).*/\\1/')\n"
                  "printf '%s\\n' \"${COMPREPLY[@]}\"\n";
        write_text(at("ask"), script);
        Launch launch;
        launch.folder = at("");
        launch.environment["PATH"] =
            std::filesystem::path(with_command({})[0]).parent_path().string() + ":" +
            std::getenv("PATH");
        const auto outcome = run_program({"bash", "--norc", at("ask")}, launch);
        EXPECT_EQ(outcome.code, 0) << outcome.text();
        EXPECT_EQ(outcome.err, "");
        std::set<std::string> found;
        std::istringstream lines(outcome.out);
        for (std::string line; std::getline(lines, line);)
            if (!line.empty()) found.insert(line);
        return found;
    }
};

}  // namespace postchain::test
