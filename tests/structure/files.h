// The files of this repository, line by line.
#pragma once

#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <set>
#include <string>
#include <vector>

namespace postchain::structure {

inline const std::filesystem::path kRoot = POSTCHAIN_SOURCE_DIR;

struct File {
    std::string name;  // relative to the root
    std::vector<std::string> lines;
};

inline std::vector<std::string> lines_of(const std::filesystem::path& path) {
    std::vector<std::string> lines;
    std::ifstream in(path);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
}

// "chain/plan/plan.cpp:7: ", of the line at this index.
inline std::string place_of(const File& file, size_t line) {
    return file.name + ":" + std::to_string(line + 1) + ": ";
}

// All below these folders whose names end so.
inline std::vector<File> files_below(std::initializer_list<const char*> folders,
                                     const std::set<std::string>& extensions) {
    namespace fs = std::filesystem;
    std::vector<File> files;
    for (const char* folder : folders)
        for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder))
            if (entry.is_regular_file() && extensions.contains(entry.path().extension().string()))
                files.push_back(
                    {fs::relative(entry.path(), kRoot).string(), lines_of(entry.path())});
    return files;
}

}  // namespace postchain::structure
