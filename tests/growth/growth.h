// The work of parsers and routes for texts that grow: cases, and the program that runs them.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace postchain::growth {

struct Case {
    std::string name;
    std::function<std::string(size_t bytes)> text;
    std::function<void(const std::string& text)> run;
};

// The limit of a body, with room for the keys around a text.
inline constexpr size_t kLarge = (size_t(1) << 20) - 512;

// Under callgrind the instructions of each run are dumped, and growth_test.py compares them: with
// `doubled` those of 16 and 32 KiB, with `whole` those of kLarge, for the cases that the standard
// input names. With `times` the processor time of each case with kLarge is printed, the slowest
// last. Returns the exit code of a program.
int run_cases(const std::vector<Case>& cases, const std::string& what);

}  // namespace postchain::growth
