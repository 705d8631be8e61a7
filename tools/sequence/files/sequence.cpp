#include "tools/sequence/files/sequence.h"

#include <dirent.h>
#include <sys/stat.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <climits>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <set>
#include <unordered_set>

#include "chain/base/readable_file.h"
#include "chain/base/stop.h"
#include "tools/sequence/files/folder_scan.h"

namespace postchain::io {

namespace {

Status usage_error(std::string message) {
    return Status(StatusCode::usage, std::move(message));
}

size_t count_digits(std::string_view text) {
    size_t n = 0;
    while (n < text.size() && is_digit(text[n])) ++n;
    return n;
}

// Removes an integer with an optional minus from the front of `text`.
std::optional<int> take_number(std::string_view& text) {
    const size_t sign = !text.empty() && text[0] == '-' ? 1 : 0;
    const size_t digits = count_digits(text.substr(sign));
    int value = 0;
    const char* end = text.data() + sign + digits;
    if (digits == 0 || std::from_chars(text.data(), end, value).ec != std::errc()) return {};
    if (value > kMaxFrameNumber || value < -kMaxFrameNumber) return {};
    text.remove_prefix(sign + digits);
    return value;
}

std::string padded(int frame, int digits) {
    char text[32];
    // %0*d with a width that parse() has limited.
    std::snprintf(text, sizeof text, "%0*d", std::min(digits, 20), frame);
    return text;
}

struct Token {
    size_t begin = 0;
    size_t length = 0;
    int digits = 1;
};

constexpr int kMaxDigits = 20;

// The token that starts at name[at], if any; `blank_padded` is set for "%4d".
std::optional<Token> token_at(std::string_view name, size_t at, bool& blank_padded) {
    const char c = name[at];
    if (c == '#' || c == '@') {
        size_t n = 1;
        while (at + n < name.size() && name[at + n] == c) ++n;
        return Token{at, n, int(std::min<size_t>(n, kMaxDigits + 1))};
    }
    const bool percent = c == '%';
    if (!percent && !(c == '$' && at + 1 < name.size() && name[at + 1] == 'F')) return {};
    const size_t first = at + (percent ? 1 : 2);
    const size_t n = count_digits(name.substr(first));
    const std::string_view width = name.substr(first, n);
    size_t end = first + n;
    if (percent) {
        if (end >= name.size() || name[end] != 'd') return {};
        ++end;
        blank_padded = n > 0 && width[0] != '0';
    }
    int digits = 1;
    if (n > 0 && std::from_chars(width.data(), width.data() + n, digits).ec != std::errc())
        digits = kMaxDigits + 1;
    return Token{at, end - at, std::max(digits, 1)};
}

struct Listed {
    int first, last, step;
};

// Whether a frame may be in two items.
bool overlap(std::vector<Listed> items) {
    std::ranges::sort(items, {}, &Listed::first);
    for (size_t i = 1; i < items.size(); ++i)
        if (items[i].first <= items[i - 1].last) return true;
    return false;
}

}  // namespace

bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

Result<FrameRange> FrameRange::parse(std::string_view text, size_t max_frames) {
    if (text.find(':') != std::string_view::npos) {
        return usage_error(
            concat("frames '", text,
                   "': a colon means two things (a range here, a step there); write 1-10 for a "
                   "range and 1-10x2 for every second frame"));
    }
    std::vector<Listed> items;
    uint64_t listed = 0;
    std::string_view rest = text;
    while (true) {
        const size_t comma = rest.find(',');
        const std::string_view item = rest.substr(0, comma);
        std::string_view left = item;
        const std::optional<int> first = take_number(left);
        std::optional<int> last = first;
        std::optional<int> step = 1;
        if (first && !left.empty() && left[0] == '-') {
            left.remove_prefix(1);
            last = take_number(left);
            if (last && !left.empty() && left[0] == 'x') {
                left.remove_prefix(1);
                step = take_number(left);
            }
        }
        if (!first || !last || !step || !left.empty()) {
            return usage_error(concat("frames '", text, "': '", item,
                                      "' is not N, A-B or A-BxSTEP (numbers up to ",
                                      std::to_string(kMaxFrameNumber), ")"));
        }
        if (*step < 1)
            return usage_error(
                concat("frames '", text, "': '", item, "': the step must be >= 1, as in 1-9x2"));
        if (*last < *first) {
            return usage_error(concat("frames '", text, "': '", item,
                                      "' runs backwards; write the smaller number first"));
        }
        items.push_back({*first, *last, *step});
        // A frame counts as often as it is listed, since each time costs the same.
        listed += uint64_t((int64_t(*last) - *first) / *step + 1);
        if (listed > max_frames) {
            return usage_error(concat("frames '", text, "': more than ", std::to_string(max_frames),
                                      " frames; split the range"));
        }
        if (comma == std::string_view::npos) break;
        rest.remove_prefix(comma + 1);
    }
    FrameRange range;
    range.frames.reserve(listed);
    std::unordered_set<int> seen;
    const bool may_repeat = overlap(items);
    for (const Listed& item : items)
        for (int64_t frame = item.first; frame <= item.last; frame += item.step)
            if (!may_repeat || seen.insert(int(frame)).second) range.frames.push_back(int(frame));
    return range;
}

std::string range_text(std::span<const int> frames) {
    std::string text;
    for (size_t at = 0; at < frames.size();) {
        const int first = frames[at];
        const int step = at + 1 < frames.size() ? frames[at + 1] - first : 0;
        size_t last = at;
        while (step > 0 && last + 1 < frames.size() && frames[last + 1] - frames[last] == step)
            ++last;
        if (step > 1 && last == at + 1) last = at;
        text += concat(text.empty() ? "" : ",", first);
        if (last > at) text += concat("-", frames[last]);
        if (last > at && step > 1) text += concat("x", step);
        at = last + 1;
    }
    return text;
}

Result<Chunk> Chunk::parse(std::string_view text) {
    std::string_view rest = text;
    const std::optional<int> index = take_number(rest);
    std::optional<int> count;
    if (index && !rest.empty() && rest[0] == '/') {
        rest.remove_prefix(1);
        count = take_number(rest);
    }
    if (!index || !count || !rest.empty() || *index < 1 || *index > *count ||
        size_t(*count) > kMaxFrames)
        return usage_error(concat("'", text, "' is not I/N with I from 1 to N and N up to ",
                                  std::to_string(kMaxFrames), ", as 3/8"));
    return Chunk{*index, *count};
}

std::pair<size_t, size_t> Chunk::of(size_t size) const {
    // size * count does not overflow: both are limited.
    return {size * size_t(index - 1) / size_t(count), size * size_t(index) / size_t(count)};
}

NumberPlace number_place(std::string_view name) {
    const size_t dot = name.rfind('.');
    size_t end = dot == std::string_view::npos ? name.size() : dot;
    while (end > 0 && !is_digit(name[end - 1])) --end;
    size_t digits = end;
    while (digits > 0 && is_digit(name[digits - 1])) --digits;
    const bool minus = digits < end && digits > 0 && name[digits - 1] == '-';
    const bool separator = minus && digits > 1 && std::isalnum(uint8_t(name[digits - 2]));
    return {minus && !separator ? digits - 1 : digits, digits, end};
}

Result<PathPattern> PathPattern::parse(std::string_view path) {
    PathPattern pattern;
    pattern.text_ = path;
    const size_t slash = path.rfind('/');
    const std::string_view name = slash == std::string_view::npos ? path : path.substr(slash + 1);
    if (path.size() >= PATH_MAX)
        return usage_error(concat("path '", path.substr(0, 60), "...': longer than ", PATH_MAX - 1,
                                  " bytes, which no system call takes; shorten it"));
    if (name.empty())
        return usage_error(concat("path '", path, "': no file name; add one, as shot.####.exr"));
    if (path.find('\0') != std::string_view::npos) return usage_error("path: has a zero byte");
    pattern.folder_ = slash == std::string_view::npos ? "."
                      : slash == 0                    ? "/"
                                                      : std::string(path.substr(0, slash));
    Token token;
    for (size_t at = 0; at < name.size(); ++at) {
        bool blank_padded = false;
        const std::optional<Token> found = token_at(name, at, blank_padded);
        if (!found) continue;
        if (blank_padded) {
            return usage_error(concat("path '", path, "': '", name.substr(at, found->length),
                                      "' pads with blanks; write %0Nd"));
        }
        if (found->digits > kMaxDigits) {
            return usage_error(concat("path '", path, "': a frame number of more than ", kMaxDigits,
                                      " digits; shorten it"));
        }
        if (pattern.has_token_) {
            return usage_error(concat("path '", path, "': two places for the frame number, '",
                                      name.substr(token.begin, token.length), "' and '",
                                      name.substr(at, found->length), "'; keep one"));
        }
        pattern.has_token_ = true;
        token = *found;
        at += found->length - 1;
    }
    pattern.prefix_ = pattern.has_token_ ? name.substr(0, token.begin) : name;
    if (pattern.has_token_) pattern.suffix_ = name.substr(token.begin + token.length);
    pattern.digits_ = token.digits;
    return pattern;
}

std::string PathPattern::format(int frame) const {
    return has_token_ ? path_of(padded(frame, digits_)) : text_;
}

std::string PathPattern::format_wide(int frame) const {
    return has_token_ ? path_of("-" + padded(-frame, digits_)) : text_;
}

std::string PathPattern::path_of(const std::string& number) const {
    const size_t slash = text_.rfind('/');
    const std::string folder = slash == std::string::npos ? "" : text_.substr(0, slash + 1);
    return folder + prefix_ + number + suffix_;
}

std::optional<int> PathPattern::match(std::string_view file_name) const {
    if (!has_token_) {
        if (file_name == prefix_) return literal_frame();
        return {};
    }
    if (file_name.size() <= prefix_.size() + suffix_.size() || !file_name.starts_with(prefix_) ||
        !file_name.ends_with(suffix_))
        return {};
    const std::string_view number =
        file_name.substr(prefix_.size(), file_name.size() - prefix_.size() - suffix_.size());
    std::string_view rest = number;
    const std::optional<int> frame = take_number(rest);
    if (!frame || !rest.empty()) return {};
    if (number == padded(*frame, digits_)) return frame;
    if (*frame < 0 && number == "-" + padded(-*frame, digits_)) return frame;
    return {};
}

int PathPattern::literal_frame() const {
    const NumberPlace at = number_place(prefix_);
    if (at.digits == at.end || at.end - at.digits > 9) return 0;
    int frame = 0;
    std::from_chars(prefix_.data() + at.begin, prefix_.data() + at.end, frame);
    return frame;
}

std::map<int, std::string> PathPattern::discover() const {
    namespace fs = std::filesystem;
    std::map<int, std::string> found;
    std::error_code error;
    if (!has_token_) {
        if (fs::exists(text_, error)) found[literal_frame()] = text_;
        return found;
    }
    const size_t slash = text_.rfind('/');
    const std::string folder = slash == std::string::npos ? "" : text_.substr(0, slash + 1);
    const OpenFolder in(folder_);
    for (fs::directory_iterator it(in.path(), error), end; !error && it != end;
         it.increment(error)) {
        if (is_stopped()) break;
        const std::string name = it->path().filename().string();
        const std::optional<int> frame = match(name);
        if (!frame) continue;
        // Prefer the name that format() returns: "-005" over "-0005".
        const std::string path = folder + name;
        if (!found.contains(*frame) || path == format(*frame)) found[*frame] = path;
    }
    return found;
}

namespace {

const std::map<std::string_view, Role>& roles_of_words() {
    static const std::map<std::string_view, Role> kRoles = {{"color", Role::color},
                                                            {"depth", Role::inverse_depth},
                                                            {"motion", Role::motion},
                                                            {"motion_back", Role::motion_back},
                                                            {"behind", Role::behind}};
    return kRoles;
}

}  // namespace

std::string InputSpec::word_of(Role role) {
    for (const auto& [word, of] : roles_of_words())
        if (of == role) return std::string(word);
    return {};
}

Result<InputSpec> InputSpec::parse(std::string_view text) {
    const auto key_of = [](std::string_view item) -> std::optional<std::string_view> {
        // No word is longer, and a text of commas is not searched to its end from each of them.
        const size_t equals = item.substr(0, 64).find_first_of("=/.");
        if (equals == std::string_view::npos || equals == 0 || item[equals] != '=') return {};
        return item.substr(0, equals);
    };
    constexpr size_t kLongest = 5 * (PATH_MAX + 16);  // a word and a path for each plane
    if (text.size() > kLongest)
        return usage_error(
            concat("input '", text.substr(0, 60), "...': longer than five paths; shorten it"));
    InputSpec spec;
    if (!key_of(text)) {
        ASSIGN_OR_RETURN(PathPattern pattern, PathPattern::parse(text));
        spec.patterns.emplace(Role::color, std::move(pattern));
        return spec;
    }
    std::string_view rest = text;
    while (true) {
        const std::optional<std::string_view> key = key_of(rest);
        if (!key || !roles_of_words().contains(*key)) {
            return usage_error(
                concat("input '", text, "': '", key.value_or(rest),
                       "' is none of color=, depth=, motion=, motion_back=, behind= (a file name "
                       "with '=' can be written ./NAME)"));
        }
        rest.remove_prefix(key->size() + 1);
        // A comma ends the path only if another plane follows: names may contain commas.
        size_t end = rest.find(',');
        while (end != std::string_view::npos && !key_of(rest.substr(end + 1)))
            end = rest.find(',', end + 1);
        ASSIGN_OR_RETURN(auto pattern,
                         PathPattern::parse(rest.substr(0, end)).at(concat("input ", *key)));
        if (!spec.patterns.emplace(roles_of_words().at(*key), std::move(pattern)).second)
            return usage_error(concat("input '", text, "': ", *key, "= is given twice; keep one"));
        if (end == std::string_view::npos) break;
        rest.remove_prefix(end + 1);
    }
    if (!spec.patterns.contains(Role::color))
        return usage_error(concat("input '", text, "': color= is missing; add color=FILE"));
    return spec;
}

namespace {

// Why a pattern has no file, and whether the folder could be read.
struct Absence {
    std::string why;
    bool looked = true;
};

std::string suggestion_of(const PathPattern& pattern) {
    const std::string nearest = nearest_input(pattern);
    return nearest.empty() ? "" : concat(" (did you mean '", nearest, "'?)");
}

Absence absence_of(const PathPattern& pattern) {
    struct stat info;
    if (!pattern.has_token()) {
        if (::stat(pattern.text().c_str(), &info) == 0 || errno == ENOENT) {
            if (::lstat(pattern.text().c_str(), &info) == 0)
                return {"is a link to a file that does not exist"};
            return {"no such file" + suggestion_of(pattern)};
        }
        return {concat("cannot be opened: ", std::strerror(errno)), false};
    }
    const std::string folder = pattern.folder();
    if (OpenFolder(folder).error() == EXDEV)
        return {concat("the folder ", folder, " ", reason_of_open(EXDEV)), false};
    if (DIR* opened = ::opendir(folder.c_str())) {
        ::closedir(opened);
        if (::stat(pattern.text().c_str(), &info) == 0)
            return {
                "is a pattern for frame numbers, which matches no file; the file of this very "
                "name must be renamed"};
        return {"no file matches this pattern" + suggestion_of(pattern)};
    }
    if (errno == ENOENT) return {concat("the folder ", folder, " does not exist")};
    return {concat("the folder ", folder, " cannot be read: ", std::strerror(errno)), false};
}

}  // namespace

std::string why_none(const PathPattern& pattern) {
    return absence_of(pattern).why;
}

void FrameList::keep(const Chunk& chunk) {
    const auto [first, end] = chunk.of(frames.size());
    frames = std::vector<int>(frames.begin() + long(first), frames.begin() + long(end));
    const std::set<int> kept(frames.begin(), frames.end());
    std::erase_if(missing, [&](int frame) { return !kept.contains(frame); });
    std::erase_if(
        gaps, [&](int gap) { return kept.empty() || gap < *kept.begin() || gap > *kept.rbegin(); });
    std::erase_if(files, [&](const auto& entry) { return !kept.contains(entry.first); });
}

FilesOnDisk files_on_disk(const InputSpec& input) {
    FilesOnDisk on_disk;
    for (const auto& [role, pattern] : input.patterns) on_disk[role] = pattern.discover();
    return on_disk;
}

std::map<Role, std::string> files_of(int frame, const InputSpec& input,
                                     const FilesOnDisk& on_disk) {
    std::map<Role, std::string> files;
    for (const auto& [role, pattern] : input.patterns) {
        const std::map<int, std::string>& found = on_disk.at(role);
        const bool still = role != Role::color && !pattern.has_token();
        const auto it = still ? found.begin() : found.find(frame);
        if (it != found.end()) files[role] = it->second;
    }
    return files;
}

namespace {

// The other file of a negative frame, "a.-0005" beside "a.-005"; empty if there is none.
std::string twin_of(const PathPattern& pattern, int frame, const std::string& path) {
    if (frame >= 0 || !pattern.has_token()) return "";
    const std::string twin = pattern.format_wide(frame);
    std::error_code error;
    return twin != path && std::filesystem::exists(twin, error) ? twin : "";
}

}  // namespace

Result<FrameList> find_frames(const InputSpec& input, const std::optional<FrameRange>& range) {
    const FilesOnDisk on_disk = files_on_disk(input);
    const std::map<int, std::string>& color = on_disk.at(Role::color);

    FrameList list;
    for (const auto& [role, pattern] : input.patterns) {
        if (!on_disk.at(role).empty()) continue;
        const Absence absence = absence_of(pattern);
        if (!absence.looked || (role == Role::color && !range))
            return Status(StatusCode::input, concat(pattern.text(), ": ", absence.why));
    }
    if (range) {
        list.frames = range->frames;
    } else {
        for (const auto& [frame, path] : color) {
            if (!list.frames.empty()) {
                // Listed up to a limit: two files may be a billion frames apart.
                for (int64_t hole = int64_t(list.frames.back()) + 1;
                     hole < frame && list.gaps.size() < kMaxFrames; ++hole)
                    list.gaps.push_back(int(hole));
            }
            list.frames.push_back(frame);
        }
    }
    for (const int frame : list.frames) {
        std::map<Role, std::string> files = files_of(frame, input, on_disk);
        if (files.size() == input.patterns.size()) {
            for (const auto& [role, path] : files)
                if (const std::string twin = twin_of(input.patterns.at(role), frame, path);
                    !twin.empty())
                    return Status(StatusCode::input, concat(path, ": ", twin,
                                                            " has the same frame number; move one "
                                                            "of them away"));
            list.files[frame] = std::move(files);
        } else {
            list.missing.push_back(frame);
        }
    }
    return list;
}

}  // namespace postchain::io
