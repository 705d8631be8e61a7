#include "chain/gl/program.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <sstream>

#include "chain/gl/debug.h"
#include "chain/parameter.h"
#include "shaders/embedded.h"

namespace postchain::gl {
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
    auto source = read_source(file, folder);
    if (!source.ok()) return source.status();
    auto known = std::find(files.begin(), files.end(), file);
    const size_t number = size_t(known - files.begin());
    if (known == files.end()) files.push_back(file);
    open.push_back(file);
    if (open.size() > 1) out += concat("#line 1 ", number, "\n");
    std::istringstream lines(*source);
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

// The compiler writes "0:12(3): error" or "0(12) : error": the number is a file.
std::string named(const std::string& log, const std::vector<std::string>& files) {
    std::istringstream lines(log);
    std::string out, line;
    while (std::getline(lines, line)) {
        size_t digits = 0;
        while (digits < line.size() && std::isdigit(static_cast<unsigned char>(line[digits])))
            ++digits;
        if (digits > 0 && digits < 4 && digits < line.size() &&
            (line[digits] == ':' || line[digits] == '(')) {
            const size_t number = size_t(std::stoi(line.substr(0, digits)));
            if (number < files.size()) line = files[number] + line.substr(digits);
        }
        out += "\n  " + line;
    }
    return out;
}

std::string with_defines(const std::string& source, const ProgramKey& key) {
    const size_t end = source.find('\n');  // #version comes first
    std::string out = source.substr(0, end + 1);
    for (const auto& [name, value] : key.defines) out += "#define " + name + " " + value + "\n";
    return out + "#line 2 0\n" + source.substr(end + 1);
}

Program describe(GLuint name) {
    Program program{.name = name, .uniforms_type = {}};
    program.in_bands = glGetUniformLocation(name, "first_group") == kFirstGroup;
    GLint blocks = 0;
    glGetProgramiv(name, GL_ACTIVE_UNIFORM_BLOCKS, &blocks);
    for (GLuint i = 0; i < GLuint(blocks); ++i) {
        GLint binding = 0, bytes = 0;
        glGetActiveUniformBlockiv(name, i, GL_UNIFORM_BLOCK_BINDING, &binding);
        if (binding != 0) continue;
        char type[256] = {};
        glGetActiveUniformBlockName(name, i, sizeof(type), nullptr, type);
        glGetActiveUniformBlockiv(name, i, GL_UNIFORM_BLOCK_DATA_SIZE, &bytes);
        program.uniforms_type = type;
        program.uniforms_bytes = (size_t(bytes) + 15) / 16 * 16;
    }
    return program;
}

}  // namespace

Result<std::string> resolve_includes(const std::string& file, const std::string& folder,
                                     std::vector<std::string>* files) {
    std::vector<std::string> open, own;
    std::string out;
    Status status = append(file, folder, open, files ? *files : own, out);
    if (!status.ok()) return status;
    return out;
}

Result<std::string> program_source(const ProgramKey& key, const std::string& folder) {
    auto source = resolve_includes(key.file, folder);
    if (!source.ok()) return source.status();
    return with_defines(*source, key);
}

std::string shader_folder_of_environment() {
    const char* folder = std::getenv("POSTCHAIN_SHADER_DIR");
    return folder ? folder : "";
}

ProgramCache::~ProgramCache() {
    for (const auto& [text, entry] : entries_) glDeleteProgram(entry.program.name);
    for (const auto& [text, begun] : begun_) {
        glDeleteShader(begun.shader);
        glDeleteProgram(begun.program);
    }
}

// Asks for no status, which would wait.
ProgramCache::Begun ProgramCache::compile(const ProgramKey& key, const std::string& source,
                                          std::vector<std::string> files) {
    const std::string whole = with_defines(source, key);
    const char* text = whole.c_str();
    const Begun begun{glCreateShader(GL_COMPUTE_SHADER), glCreateProgram(), std::move(files),
                      hash_text(source)};
    glShaderSource(begun.shader, 1, &text, nullptr);
    glCompileShader(begun.shader);
    glAttachShader(begun.program, begun.shader);
    glLinkProgram(begun.program);
    return begun;
}

Result<unsigned> ProgramCache::finish(const ProgramKey& key, const Begun& begun) {
    GLint linked = 0;
    glGetProgramiv(begun.program, GL_LINK_STATUS, &linked);
    std::string log(16384, '\0');
    GLsizei length = 0;
    if (!linked) {
        GLint good = 0;
        glGetShaderiv(begun.shader, GL_COMPILE_STATUS, &good);
        if (good)
            glGetProgramInfoLog(begun.program, GLsizei(log.size()), &length, log.data());
        else
            glGetShaderInfoLog(begun.shader, GLsizei(log.size()), &length, log.data());
    }
    glDeleteShader(begun.shader);
    if (linked) {
        label_program(begun.program, key.text());
        return begun.program;
    }
    glDeleteProgram(begun.program);
    log.resize(size_t(length));
    return Status(StatusCode::gl,
                  "shader " + key.text() + " does not compile:" + named(log, begun.files));
}

void ProgramCache::begin(const ProgramKey& key) {
    const std::string text = key.text();
    if (!folder_.empty() || entries_.contains(text) || begun_.contains(text)) return;
    std::vector<std::string> files;
    if (auto source = resolve_includes(key.file, folder_, &files); source.ok())
        begun_.emplace(text, compile(key, *source, std::move(files)));
}

Result<Program> ProgramCache::get(const ProgramKey& key) {
    const std::string text = key.text();
    const auto known = entries_.find(text);
    if (known != entries_.end() && folder_.empty()) return known->second.program;

    std::optional<Begun> begun;
    Status status;
    if (auto node = begun_.extract(text)) {
        begun = std::move(node.mapped());
    } else {
        std::vector<std::string> files;
        const auto source = resolve_includes(key.file, folder_, &files);
        status = source.status();
        if (source.ok() && known != entries_.end() &&
            known->second.source_hash == hash_text(*source))
            return known->second.program;
        if (source.ok()) begun = compile(key, *source, std::move(files));
    }
    if (begun) {
        const auto program = finish(key, *begun);
        if (program.ok()) {
            if (known != entries_.end()) glDeleteProgram(known->second.program.name);
            ++compiled_;
            return (entries_[text] = {describe(*program), begun->source_hash}).program;
        }
        status = program.status();
    }
    if (known == entries_.end()) return status;
    if (log_) log_(status.message() + "\n(the last good version stays in use)");
    known->second.source_hash = begun ? begun->source_hash : 0;  // said once
    return known->second.program;
}

}  // namespace postchain::gl
