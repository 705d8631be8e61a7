#include "tests/gpu_like/spirv_of.h"

#include <stdlib.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace postchain::test {

std::vector<uint32_t> spirv_of(const std::string& source) {
    namespace fs = std::filesystem;
    std::string name = (fs::temp_directory_path() / "gpu_like_XXXXXX").string();
    if (!::mkdtemp(name.data())) std::abort();
    const fs::path folder = name;
    std::ofstream(folder / "program.comp") << source;
    const std::string command =
        "cd " + name +
        " && unset LD_PRELOAD && glslangValidator -G program.comp -o whole.spv >log && "
        "spirv-opt --inline-entry-points-exhaustive --eliminate-dead-functions "
        "--scalar-replacement --ssa-rewrite whole.spv -o program.spv >>log 2>&1 || "
        "{ cat log >&2; exit 1; }";
    if (std::system(command.c_str()) != 0) {
        std::fputs("gpu_like: glslangValidator or spirv-opt failed\n", stderr);
        std::abort();
    }
    std::ifstream in(folder / "program.spv", std::ios::binary);
    const std::string bytes(std::istreambuf_iterator<char>(in), {});
    fs::remove_all(folder);
    std::vector<uint32_t> words(bytes.size() / sizeof(uint32_t));
    std::copy_n(bytes.data(), words.size() * sizeof(uint32_t),
                reinterpret_cast<char*>(words.data()));
    return words;
}

}  // namespace postchain::test
