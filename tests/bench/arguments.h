// The command line of a benchmark: words, and options as --KEY=VALUE.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace postchain::bench {

// Prints the error and ends the program.
[[noreturn]] void fail(const std::string& text, int code = 1);

class Arguments {
  public:
    // `usage` lists the options.
    Arguments(int argc, char** argv, std::string usage);

    // These remove an option. If it is given several times, the last one counts.
    bool flag(const std::string& key);
    std::optional<std::string> text(const std::string& key);
    std::vector<std::string> texts(const std::string& key);
    int count(const std::string& key, int value);  // above 0; `value`: the default
    std::array<int, 2> size(int width, int height);

    std::vector<std::string> words() const;  // the rest; another option ends the program
    void none() const;                       // anything left ends the program

  private:
    [[noreturn]] void refuse(const std::string& word) const;

    std::vector<std::string> left_;
    std::string usage_;
};

}  // namespace postchain::bench
