// A whole file as a string.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace postchain::test {

inline std::string read_text(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

inline void write_text(const std::filesystem::path& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
}

// A record compared whole. POSTCHAIN_UPDATE=1 writes the file: read the difference as a reviewer.
inline void expect_text_of(const std::filesystem::path& path, const std::string& text) {
    if (std::getenv("POSTCHAIN_UPDATE")) write_text(path, text);
    EXPECT_EQ(text, read_text(path)) << path;
}

}  // namespace postchain::test
