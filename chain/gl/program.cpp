#include "chain/gl/program.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <sstream>

#include "chain/base/parameter.h"
#include "chain/gl/debug.h"
#include "chain/gl/image_reads.h"
#include "chain/plan/program_source.h"

namespace postchain::gl {
namespace {

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

// Before the driver's bytes.
struct BinaryHeader {
    uint64_t hash = 0;  // of those bytes
    uint32_t format = 0;
    uint32_t pad = 0;
};

// A format that the driver does not know would be a GL error.
bool is_binary_format(uint32_t format) {
    GLint count = 0;
    glGetIntegerv(GL_NUM_PROGRAM_BINARY_FORMATS, &count);
    std::vector<GLint> formats(size_t(std::max(count, 1)));
    glGetIntegerv(GL_PROGRAM_BINARY_FORMATS, formats.data());
    return std::find(formats.begin(), formats.end(), GLint(format)) != formats.end();
}

}  // namespace

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
    const std::string whole =
        with_defines(has_image_reads(key) ? with_image_reads(source, key) : source, key);
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
        label(GL_PROGRAM, begun.program, key.text());
        return begun.program;
    }
    glDeleteProgram(begun.program);
    log.resize(size_t(length));
    return Status(StatusCode::gl,
                  "shader " + key.text() + " does not compile:" + named(log, begun.files));
}

void ProgramCache::use_binaries(ProgramStore store, std::string device) {
    GLint formats = 0;
    glGetIntegerv(GL_NUM_PROGRAM_BINARY_FORMATS, &formats);
    if (formats == 0) return;
    binaries_ = std::move(store);
    binaries_of_ = std::move(device);
}

std::string ProgramCache::binary_key(const ProgramKey& key, uint64_t source_hash) const {
    return hex_of(hash_text(concat(key.text(), "\n", binaries_of_), source_hash));
}

bool ProgramCache::load(const ProgramKey& key, const std::string& source) {
    if (!binaries_.load || !folder_.empty()) return false;
    const uint64_t hash = hash_text(source);
    const std::vector<std::byte> bytes = binaries_.load(binary_key(key, hash));
    BinaryHeader header;
    if (bytes.size() <= sizeof(header)) return false;
    std::memcpy(&header, bytes.data(), sizeof(header));
    const auto binary = std::span(bytes).subspan(sizeof(header));
    if (header.hash != hash_bytes(binary) || !is_binary_format(header.format)) return false;
    const GLuint program = glCreateProgram();
    glProgramBinary(program, header.format, binary.data(), GLsizei(binary.size()));
    GLint linked = 0;
    glGetProgramiv(program, GL_LINK_STATUS, &linked);
    if (!linked) {
        glDeleteProgram(program);
        return false;
    }
    label(GL_PROGRAM, program, key.text());
    entries_[key.text()] = {describe(program), hash};
    ++compiled_;
    ++loaded_;
    return true;
}

void ProgramCache::store(const ProgramKey& key, uint64_t source_hash, unsigned program) const {
    if (!binaries_.store || !folder_.empty()) return;
    GLint size = 0;
    glGetProgramiv(program, GL_PROGRAM_BINARY_LENGTH, &size);
    if (size <= 0) return;
    BinaryHeader header;
    std::vector<std::byte> bytes(sizeof(header) + size_t(size));
    GLenum format = 0;
    GLsizei written = 0;
    glGetProgramBinary(program, size, &written, &format, bytes.data() + sizeof(header));
    if (written <= 0) return;
    bytes.resize(sizeof(header) + size_t(written));
    header.format = format;
    header.hash = hash_bytes(std::span(bytes).subspan(sizeof(header)));
    std::memcpy(bytes.data(), &header, sizeof(header));
    binaries_.store(binary_key(key, source_hash), bytes);
}

void ProgramCache::begin(const ProgramKey& key) {
    const std::string text = key.text();
    if (!folder_.empty() || entries_.contains(text) || begun_.contains(text)) return;
    std::vector<std::string> files;
    const auto source = resolve_includes(key.file, folder_, &files);
    if (source.ok() && !load(key, *source))
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
        if (source.ok() && known == entries_.end() && load(key, *source))
            return entries_.at(text).program;
        if (source.ok()) begun = compile(key, *source, std::move(files));
    }
    if (begun) {
        const auto program = finish(key, *begun);
        if (program.ok()) {
            if (known != entries_.end()) glDeleteProgram(known->second.program.name);
            ++compiled_;
            store(key, begun->source_hash, *program);
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
