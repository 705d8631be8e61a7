#include "tests/bench/arguments.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

namespace postchain::bench {

void fail(const std::string& text, int code) {
    std::fprintf(stderr, "%s\n", text.c_str());
    std::exit(code);
}

Arguments::Arguments(int argc, char** argv, std::string usage)
    : left_(argv + 1, argv + argc), usage_(std::move(usage)) {}

void Arguments::refuse(const std::string& word) const {
    fail(word + ": usage: " + usage_, 2);
}

bool Arguments::flag(const std::string& key) {
    return std::erase(left_, key) > 0;
}

std::vector<std::string> Arguments::texts(const std::string& key) {
    std::vector<std::string> found;
    std::erase_if(left_, [&](const std::string& word) {
        const bool is_given = word.starts_with(key + "=");
        if (is_given) found.push_back(word.substr(key.size() + 1));
        return is_given;
    });
    return found;
}

std::optional<std::string> Arguments::text(const std::string& key) {
    const auto found = texts(key);
    return found.empty() ? std::nullopt : std::optional(found.back());
}

int Arguments::count(const std::string& key, int value) {
    const auto found = text(key);
    char end;
    if (found && (std::sscanf(found->c_str(), "%d%c", &value, &end) != 1 || value < 1))
        refuse(key + "=" + *found);
    return value;
}

std::array<int, 2> Arguments::size(int width, int height) {
    const auto found = text("--size");
    char end;
    if (found && (std::sscanf(found->c_str(), "%dx%d%c", &width, &height, &end) != 2 ||
                  std::min(width, height) < 1))
        refuse("--size=" + *found);
    return {width, height};
}

std::vector<std::string> Arguments::words() const {
    for (const std::string& word : left_)
        if (word.starts_with("--")) refuse(word);
    return left_;
}

void Arguments::none() const {
    if (!left_.empty()) refuse(left_[0]);
}

}  // namespace postchain::bench
