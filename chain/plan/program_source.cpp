#include "chain/plan/program_source.h"

#include <algorithm>
#include <fstream>
#include <sstream>

#include "chain/base/parameter.h"
#include "shaders/embedded.h"

namespace postchain {
namespace {

Result<std::string> read_source(const std::string& file, const std::string& folder) {
    if (!folder.empty()) {
        const std::string path = folder + "/" + file;
        std::ifstream in(path, std::ios::binary);
        if (!in) return Status(StatusCode::gl, path + ": cannot be read");
        std::ostringstream text;
        text << in.rdbuf();
        return text.str();
    }
    if (const auto text = find_shader(file)) return std::string(*text);
    return Status(StatusCode::gl, "shader file '" + file + "' is not embedded in this build");
}

Status append(const std::string& file, const std::string& folder, std::vector<std::string>& open,
              std::vector<std::string>& files, std::string& out) {
    if (std::find(open.begin(), open.end(), file) != open.end())
        return Status(StatusCode::gl, "'" + file + "' includes itself");
    ASSIGN_OR_RETURN(auto source, read_source(file, folder));
    auto known = std::find(files.begin(), files.end(), file);
    const size_t number = size_t(known - files.begin());
    if (known == files.end()) files.push_back(file);
    open.push_back(file);
    if (open.size() > 1) out += concat("#line 1 ", number, "\n");
    std::istringstream lines(source);
    std::string line;
    for (int row = 1; std::getline(lines, line); ++row) {
        if (line.rfind("#include", 0) != 0) {
            out += line + "\n";
            continue;
        }
        if (line.rfind("#include <", 0) == 0) {
            out += "\n";  // of a shared header's C++ side
            continue;
        }
        const size_t begin = line.find('"'), end = line.rfind('"');
        if (begin == std::string::npos || end <= begin)
            return Status(StatusCode::gl, "#include takes a \"path\"").at(concat(file, ":", row));
        Status status = append(line.substr(begin + 1, end - begin - 1), folder, open, files, out);
        if (!status.ok()) return status.at(concat(file, ":", row));
        out += concat("#line ", row + 1, " ", number, "\n");
    }
    open.pop_back();
    return Status();
}

}  // namespace

std::string with_defines(const std::string& source, const ProgramKey& key) {
    const size_t end = source.find('\n');  // #version comes first
    std::string out = source.substr(0, end + 1);
    for (const auto& [name, value] : key.defines) out += "#define " + name + " " + value + "\n";
    return out + "#line 2 0\n" + source.substr(end + 1);
}

Result<std::string> resolve_includes(const std::string& file, const std::string& folder,
                                     std::vector<std::string>* files) {
    std::vector<std::string> open, own;
    std::string out;
    RETURN_IF_ERROR(append(file, folder, open, files ? *files : own, out));
    return out;
}

Result<std::string> program_source(const ProgramKey& key, const std::string& folder) {
    ASSIGN_OR_RETURN(auto source, resolve_includes(key.file, folder));
    return with_defines(source, key);
}

uint64_t program_key(const std::string& source) {
    return hash_text(concat("SPIR-V ", POSTCHAIN_VERSION, "\n", source));
}

}  // namespace postchain
