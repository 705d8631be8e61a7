#include "tests/bench/visit_marks.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "chain/base/status.h"
#include "shaders/embedded.h"
#include "tests/bench/arguments.h"

namespace postchain::bench {
namespace {

// The functions that marks call. A path names the rounds of all loops in which an invocation is;
// invocations that meet again have equal paths.
std::string declarations() {
    return concat(
        "#ifdef VULKAN\n"
        "layout(std430, binding = ",
        kVisitsUnit,
        ") volatile buffer Visits { uint visit_marks[]; };\n"
        "#define VISIT_BEGIN\n"
        "#define VISIT_PATH 0u\n"
        "#define VISIT(id, outer, round) visit_marks[",
        kFirstMarkOffset / 4,
        " + id] = 0u;\n"
        "#define VISIT_REST(id) VISIT(id, 0, 0)\n"
        "#define VISIT_LEAVE(id, outer)\n"
        "#else\n"
        "layout(std430, binding = ",
        kVisitsUnit, ") buffer Visits { uint visit_counts[", kMostMarks, "], visit_ns[", kMostMarks,
        "], visit_slots[", kVisitSlots, "], visit_set[", kVisitSetWords,
        "]; };\n"
        "uint visit_path = 0u, visit_group = 0u;\n"
        "uint visit_hash(uint a, uint b) {\n"
        "    a = (a ^ b * 0x9e3779b1u) * 0x85ebca77u;\n"
        "    a ^= a >> 15;\n"
        "    a *= 0xc2b2ae3du;\n"
        "    return a ^ a >> 13;\n"
        "}\n"
        "void visit_once(uint id) {\n"
        "    const uint key = visit_hash(visit_hash(visit_path, visit_group), id);\n"
        "    const uint word = key % ",
        kVisitSetWords, "u, bit = 1u << (key / ", kVisitSetWords,
        "u % 32u);\n"
        "    if ((visit_set[word] & bit) != 0u || (atomicOr(visit_set[word], bit) & bit) != 0u) "
        "return;\n"
        "    atomicAdd(visit_counts[id], 1u);\n"
        "    atomicAdd(visit_slots[visit_group % ",
        kVisitSlots,
        "u], visit_ns[id]);\n"
        "}\n"
        "void visit_begin(uvec2 first) {\n"
        "    const uvec3 at = gl_WorkGroupID + uvec3(first, 0u);\n"
        "    visit_group = visit_hash(at.x | at.y << 16, at.z << 16 | gl_LocalInvocationIndex / "
        "32u);\n"
        "}\n"
        "#define VISIT_PATH visit_path\n"
        "#define VISIT_BEGIN visit_begin(VISIT_FIRST_GROUP);\n"
        "#define VISIT(id, outer, round) visit_path = visit_hash(outer, id * 4096u + (round)); "
        "visit_once(id);\n"
        "#define VISIT_REST(id) visit_once(id);\n"
        "#define VISIT_LEAVE(id, outer) visit_path = visit_hash(outer, id * 4096u + 4095u);\n"
        "#endif\n");
}

bool is_word(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
}

class Marker {
  public:
    Marker(const std::string& file, const std::string& text, std::vector<Mark>& marks)
        : file_(file), text_(text), marks_(marks) {}

    std::string run() {
        while (at_ < text_.size()) {
            copy_trivia();
            if (at_ >= text_.size()) break;
            if (text_[at_] == '{') {
                if (is_function())
                    function();
                else
                    copy_bracketed();
                declaration_ = out_.size();
            } else {
                if (text_[at_] == ';') declaration_ = out_.size() + 1;
                out_ += text_[at_++];
            }
        }
        return std::move(out_);
    }

  private:
    [[noreturn]] void wrong(const char* what) const {
        fail(concat(file_, ":", line_at(at_), ": ", what), 1);
    }
    size_t line_at(size_t at) const {
        return 1 + size_t(std::count(text_.begin(), text_.begin() + ptrdiff_t(at), '\n'));
    }
    int add_mark(Mark::Kind kind) {
        if (next_mark_ == marks_.size()) marks_.push_back({concat(file_, ":", line_at(at_)), kind});
        if (marks_.size() > size_t(kMostMarks)) wrong("too many marks");
        return int(next_mark_++);
    }

    // The end of blanks, comments and preprocessor lines from `at` on.
    size_t after_trivia(size_t at) const {
        while (at < text_.size()) {
            if (std::isspace(static_cast<unsigned char>(text_[at]))) {
                ++at;
            } else if (text_.compare(at, 2, "//") == 0) {
                at = std::min(text_.find('\n', at), text_.size());
            } else if (text_[at] == '#') {
                size_t end = text_.find('\n', at);
                while (end != text_.npos && text_[end - 1] == '\\') end = text_.find('\n', end + 1);
                at = std::min(end, text_.size());
            } else {
                break;
            }
        }
        return at;
    }
    void copy_to(size_t end) {
        out_.append(text_, at_, end - at_);
        at_ = end;
    }
    void copy_trivia() {
        const size_t end = after_trivia(at_);
        for (size_t line = text_.find('#', at_); line < end; line = text_.find('#', line + 1))
            note_condition(std::string_view(text_).substr(line, end - line));
        copy_to(end);
    }
    // The loops of Vulkan's text and those of GL's text in its place have the same marks.
    void note_condition(std::string_view line) {
        if (line.starts_with("#if"))
            conditions_.push_back(line.starts_with("#ifdef VULKAN\n") ? next_mark_ : kNoMark);
        else if (line.starts_with("#else") && !conditions_.empty() && conditions_.back() != kNoMark)
            next_mark_ = conditions_.back();
        else if (line.starts_with("#endif") && !conditions_.empty())
            conditions_.pop_back();
    }
    bool is_next(std::string_view word) const {
        const size_t end = at_ + word.size();
        return text_.compare(at_, word.size(), word) == 0 &&
               (end >= text_.size() || !is_word(text_[end]));
    }
    // The end of a bracketed part that begins at `at`.
    size_t after_bracketed(size_t at) const {
        int depth = 0;
        while (at < text_.size()) {
            const size_t next = after_trivia(at);
            if (next != at) {
                at = next;
                continue;
            }
            const char c = text_[at++];
            if (c == '(' || c == '{' || c == '[') ++depth;
            if ((c == ')' || c == '}' || c == ']') && --depth == 0) return at;
        }
        wrong("a bracket is not closed");
    }
    void copy_bracketed() { copy_to(after_bracketed(at_)); }

    // Does a declaration with parameters stand before this brace?
    bool is_function() const {
        size_t end = out_.size();
        while (end > declaration_ && std::isspace(static_cast<unsigned char>(out_[end - 1]))) --end;
        return end > declaration_ && out_[end - 1] == ')' &&
               out_.compare(declaration_, out_.npos, "layout") != 0;
    }

    // Its type: the second word before the parameters.
    std::string type_of_function() {
        int depth = 0;
        size_t at = out_.rfind(')');
        for (; at > 0; --at) {
            if (out_[at] == ')') ++depth;
            if (out_[at] == '(' && --depth == 0) break;
        }
        const auto word_before = [&](size_t end) {
            while (end > 0 && !is_word(out_[end - 1])) --end;
            size_t begin = end;
            while (begin > 0 && is_word(out_[begin - 1])) --begin;
            return std::pair(begin, end);
        };
        const auto name = word_before(at);
        is_main_ = out_.substr(name.first, name.second - name.first) == "main";
        const auto type = word_before(name.first);
        return out_.substr(type.first, type.second - type.first);
    }

    void function() {
        type_ = type_of_function();
        function_ = kMostMarks + at_;  // of its paths
        out_ += "{ ";
        ++at_;
        if (is_main_)
            out_ +=
                "\n#ifndef VISIT_FIRST_GROUP\n#define VISIT_FIRST_GROUP uvec2(0u)\n#endif\n"
                "VISIT_BEGIN ";
        out_ += "const uint visit_f = VISIT_PATH; ";
        if (is_main_) out_ += concat("VISIT_REST(", add_mark(Mark::program), "u) ");
        copy_trivia();
        while (text_[at_] != '}') {
            statement();
            copy_trivia();
        }
        out_ += leave() + "}";
        ++at_;
    }
    std::string leave() const { return concat("VISIT_LEAVE(", function_, "u, visit_f) "); }

    // The end of the statement at `at`, apart from an `else`.
    size_t after_simple(size_t at) const {
        // A macro that is a block, after which a semicolon may be missing.
        if (text_.compare(at, 6, "ADD_TO") == 0) {
            at = after_bracketed(text_.find('(', at));
            return text_[at] == ';' ? at + 1 : at;
        }
        while (at < text_.size() && text_[at] != ';') {
            const size_t next = after_trivia(at);
            if (next != at)
                at = next;
            else if (text_[at] == '(' || text_[at] == '{' || text_[at] == '[')
                at = after_bracketed(at);
            else if (text_[at] == '}')
                wrong("a statement has no end");
            else
                ++at;
        }
        return at + 1;
    }

    void statement() {
        if (is_next("SOFTWARE_LOOP")) {
            copy_to(at_ + std::string_view("SOFTWARE_LOOP").size());
            copy_trivia();
        }
        if (text_[at_] == '{') {
            out_ += text_[at_++];
            copy_trivia();
            while (text_[at_] != '}') {
                statement();
                copy_trivia();
            }
            out_ += text_[at_++];
        } else if (is_next("for") || is_next("while")) {
            loop();
        } else if (is_next("do")) {
            do_loop();
        } else if (is_next("if")) {
            branch();
        } else if (is_next("return")) {
            leave_function();
        } else {
            copy_to(after_simple(at_));
        }
    }

    void marked_body(int id, const std::string& round) {
        out_ += concat("{ VISIT(", id, "u, visit_o", id, ", ", round, ") ");
        copy_trivia();
        statement();
        out_ += " }";
    }
    void open(int id, bool rounds) {
        out_ += concat("{ const uint visit_o", id, " = VISIT_PATH; ");
        if (rounds) out_ += concat("uint visit_r", id, " = 0u; ");
    }
    void close(int id) { out_ += concat(" VISIT_LEAVE(", id, "u, visit_o", id, ") }"); }

    void loop() {
        const int id = add_mark(Mark::loop);
        open(id, true);
        copy_to(text_.find('(', at_));
        copy_bracketed();
        copy_trivia();
        marked_body(id, concat("visit_r", id, "++"));
        close(id);
    }
    void do_loop() {
        const int id = add_mark(Mark::loop);
        open(id, true);
        copy_to(at_ + 2);
        copy_trivia();
        marked_body(id, concat("visit_r", id, "++"));
        copy_trivia();
        if (!is_next("while")) wrong("a loop has no end");
        copy_to(after_simple(at_));
        close(id);
    }

    // Worth a mark: a part that loads, stores, loops or is long.
    bool is_large(size_t begin, size_t end) const {
        const std::string_view part = std::string_view(text_).substr(begin, end - begin);
        for (const char* word : {"etch", "imageStore", "imageLoad", "for (", "while (", "atomic",
                                 "barrier", "STORE", "ADD_TO"})
            if (part.find(word) != part.npos) return true;
        return part.size() > 160;
    }
    static bool jumps(std::string_view part) {
        for (const char* word : {"return", "continue", "break"})
            if (part.find(word) != part.npos) return true;
        return false;
    }
    // A condition that the compiler knows: constants only, kLens or !kShutter.
    static bool is_constant(std::string_view condition) {
        for (size_t i = 0; i < condition.size(); ++i)
            if (is_word(condition[i]) && (i == 0 || !is_word(condition[i - 1])) &&
                (condition[i] != 'k' || i + 1 == condition.size() ||
                 !std::isupper(static_cast<unsigned char>(condition[i + 1]))))
                return false;
        return true;
    }
    // The end of any statement at `at`.
    size_t after_statement(size_t at) {
        const size_t at_before = at_;
        const std::string out_before = out_;
        const std::vector<Mark> marks_before = marks_;
        const std::vector<size_t> conditions_before = conditions_;
        const size_t next_before = next_mark_;
        at_ = at;
        statement();
        const size_t end = at_;
        at_ = at_before;
        out_ = out_before;
        marks_ = marks_before;
        conditions_ = conditions_before;
        next_mark_ = next_before;
        return end;
    }

    void branch() {
        const size_t begin = at_;
        const size_t condition = after_bracketed(text_.find('(', at_));
        const size_t body = after_trivia(condition), body_end = after_statement(body);
        const size_t opened = text_.find('(', begin);
        const bool constant =
            is_constant(std::string_view(text_).substr(opened, condition - opened));
        const bool is_marked = !constant && is_large(body, body_end);
        size_t next = after_trivia(body_end);
        const bool has_else = text_.compare(next, 4, "else") == 0 && !is_word(text_[next + 4]);
        const int id = is_marked || (has_else && !constant) ? add_mark(Mark::branch) : -1;
        if (id >= 0) open(id, false);
        copy_to(body);
        if (is_marked)
            marked_body(id, "0u");
        else
            statement();
        if (has_else) {
            copy_trivia();
            copy_to(at_ + 4);
            copy_trivia();
            const size_t other = at_, other_end = after_statement(other);
            if (!constant && is_large(other, other_end) && text_.compare(other, 2, "if") != 0) {
                const int other_id = add_mark(Mark::branch);
                out_ += concat("{ const uint visit_o", other_id, " = visit_o", id, "; ");
                marked_body(other_id, "0u");
                out_ += " }";
            } else {
                statement();
            }
        }
        if (id >= 0) close(id);
        // Only invocations that have not jumped do the rest.
        if (!constant && jumps(std::string_view(text_).substr(begin, at_ - begin)))
            out_ += concat(" VISIT_REST(", add_mark(Mark::branch), "u) ");
    }

    void leave_function() {
        const size_t value = after_trivia(at_ + 6);
        if (text_[value] == ';') {
            out_ += "{ " + leave() + "return; }";
            at_ = value + 1;
            return;
        }
        out_ += "{ const " + type_ + " visit_v = ";
        at_ = value;
        copy_to(after_simple(at_));
        out_ += " " + leave() + "return visit_v; }";
    }

    static constexpr size_t kNoMark = size_t(-1);
    const std::string file_;
    const std::string& text_;
    std::vector<Mark>& marks_;
    size_t next_mark_ = marks_.size();
    std::vector<size_t> conditions_;  // open ones of the preprocessor: the first mark in them
    std::string out_, type_;
    size_t at_ = 0, declaration_ = 0, function_ = 0;
    bool is_main_ = false;
};

}  // namespace

VisitCounters::VisitCounters() {
    glCreateBuffers(1, &buffer_);
    glNamedBufferStorage(buffer_, kVisitsBytes, nullptr, GL_DYNAMIC_STORAGE_BIT);
}

VisitCounters::~VisitCounters() {
    glDeleteBuffers(1, &buffer_);
}

void VisitCounters::clear(const std::vector<uint32_t>& latencies) {
    glClearNamedBufferData(buffer_, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
    glNamedBufferSubData(buffer_, 4 * kMostMarks, 4 * kMostMarks, latencies.data());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, kVisitsUnit, buffer_);
    glMemoryBarrier(GL_ALL_BARRIER_BITS);
}

std::vector<double> VisitCounters::counts() const {
    const auto words = read(0, kMostMarks);
    return {words.begin(), words.end()};
}

double VisitCounters::longest_ms() const {
    const auto words = read(2 * kMostMarks, kVisitSlots);
    return 1e-6 * double(*std::max_element(words.begin(), words.end()));
}

std::vector<uint32_t> VisitCounters::read(int64_t first, int count) const {
    glMemoryBarrier(GL_ALL_BARRIER_BITS);
    std::vector<uint32_t> words(size_t(count), 0);
    glGetNamedBufferSubData(buffer_, 4 * first, 4 * count, words.data());
    return words;
}

std::string mark_visits(const std::string& file, const std::string& text,
                        std::vector<Mark>& marks) {
    std::string out = Marker(file, text, marks).run();
    if (file == "common/first_group.glsl") out += "#define VISIT_FIRST_GROUP first_group\n";
    if (text.starts_with("#version")) out.insert(out.find('\n') + 1, declarations());
    return out;
}

std::vector<Mark> write_marked_shaders(const std::string& folder) {
    std::vector<Mark> marks;
    for (const EmbeddedFile& file : embedded_shaders()) {
        const std::string name(file.path), text(file.text);
        const bool is_code = !name.ends_with(".h") && !name.starts_with("scenes/");
        const std::filesystem::path path = std::filesystem::path(folder) / name;
        std::filesystem::create_directories(path.parent_path());
        std::ofstream(path) << (is_code ? mark_visits(name, text, marks) : text);
    }
    return marks;
}

}  // namespace postchain::bench
