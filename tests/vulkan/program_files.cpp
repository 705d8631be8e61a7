#include "tests/vulkan/program_files.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <regex>

#include "chain/base/status.h"
#include "tests/support/text_file.h"

namespace postchain::test {

namespace fs = std::filesystem;

int run_programs(const std::string& words, const fs::path& messages) {
    const int status =
        std::system(concat(PROGRAMS_PROGRAM, " ", words, " 2>", messages.string()).c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

void write_programs(const std::string& language, const fs::path& folder,
                    const std::string& chains) {
    const std::string messages = folder.string() + ".log";
    ASSERT_EQ(
        run_programs(concat("--format ", language, " --output ", folder.string(), " ", chains),
                     messages),
        0)
        << read_text(messages);
}

std::vector<fs::path> files_in(const fs::path& folder, const std::string& ending) {
    std::vector<fs::path> files;
    for (const auto& file : fs::directory_iterator(folder))
        if (file.path().extension() == ending) files.push_back(file.path());
    return files;
}

std::vector<uint32_t> words_of(const fs::path& file) {
    const std::string bytes = read_text(file);
    std::vector<uint32_t> words(bytes.size() / 4);
    std::copy_n(bytes.data(), 4 * words.size(), reinterpret_cast<char*>(words.data()));
    return words;
}

void compile_hlsl(const fs::path& folder) {
    static const std::regex kLists(R"(register\(([tu])1([6-9]), space0\))");
    static const std::regex kFirstGroup(R"(cbuffer \w+ : register\(b1, space0\))");
    for (const fs::path& file : files_in(folder, ".hlsl")) {
        std::string text = read_text(file);
        for (std::smatch list; std::regex_search(text, list, kLists);)
            text = concat(list.prefix().str(), "register(", list[1].str(), list[2].str()[0] - '6',
                          ", space0)", list.suffix().str());
        write_text(file, std::regex_replace(text, kFirstGroup,
                                            "[[vk::push_constant]] cbuffer FirstGroup"));
    }
    ASSERT_EQ(std::system(concat("cd ", folder.string(),
                                 " && ls *.hlsl | sed s/.hlsl// | xargs -P2 -I{} sh -c '"
                                 "glslangValidator -D -V -e main -S comp {}.hlsl -o {}.spv "
                                 ">{}.log && spirv-val --target-env vulkan1.0 {}.spv >>{}.log 2>&1 "
                                 "|| { cat {}.log; exit 1; }'")
                              .c_str()),
              0)
        << "glslangValidator and spirv-val: tools/install_packages.sh --tests";
}

}  // namespace postchain::test
