// Folders that postchain-programs writes, for its tests.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace postchain::test {

// Runs postchain-programs with these words; its exit code. Its messages go to the file.
int run_programs(const std::string& words, const std::filesystem::path& messages);
// Files in this language of the programs of chains. A failure fails the test.
void write_programs(const std::string& language, const std::filesystem::path& folder,
                    const std::string& chains);

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder,
                                            const std::string& ending);
std::vector<uint32_t> words_of(const std::filesystem::path& file);

// Changes the files of HLSL so that their registers are the units of GLSL, and the first group is a
// push constant; compiles each to SPIR-V beside it, and validates that. A failure fails the test.
void compile_hlsl(const std::filesystem::path& folder);

}  // namespace postchain::test
