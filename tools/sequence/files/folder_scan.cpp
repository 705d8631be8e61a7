#include "tools/sequence/files/folder_scan.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <functional>
#include <map>

#include "chain/base/parameter.h"
#include "chain/base/readable_file.h"
#include "chain/base/stop.h"
#include "chain/base/text.h"

namespace postchain::io {
namespace {

namespace fs = std::filesystem;

// "shot.-0012.exr" is "shot." -0012 ".exr".
struct NameParts {
    std::string before, digits, after;
    bool negative = false;

    std::string number() const { return (negative ? "-" : "") + digits; }
    // Padding to a width may count the sign or not.
    size_t width() const { return digits.size() + (negative ? 1 : 0); }
    bool is_padded() const { return digits.size() > 1 && digits[0] == '0'; }
};

NameParts parts_of(const std::string& name) {
    const NumberPlace at = number_place(name);
    return {name.substr(0, at.begin), name.substr(at.digits, at.end - at.digits),
            name.substr(at.end), at.negative()};
}

bool is_exr(const std::string& name) {
    return name.size() > 4 && name[0] != '.' && lower_case(name).ends_with(".exr");
}

// Groups names by the form of their number: "f.9.exr" and "f.10.exr" have no padding and belong
// together, "f.09.exr" and "f.9.exr" do not.
// `gaps`: how many missing numbers may still be listed.
void add_sequences(const std::string& folder, const std::vector<NameParts>& names, size_t& gaps,
                   std::vector<FoundSequence>& found) {
    std::map<size_t, std::vector<NameParts>> by_width;
    // Padded to its width, or wider than any padding: the width of the shortest without a zero.
    for (const NameParts& name : names)
        if (!name.negative || !name.is_padded())
            by_width[name.is_padded() ? name.digits.size() : 0].push_back(name);
    for (const NameParts& name : names) {
        if (!name.negative || !name.is_padded()) continue;
        const bool counts_sign =
            !by_width.contains(name.digits.size()) && by_width.contains(name.width());
        by_width[counts_sign ? name.width() : name.digits.size()].push_back(name);
    }
    // A number without a leading zero belongs to the padded ones of its width or less.
    if (auto plain = by_width.find(0); plain != by_width.end() && by_width.size() > 1) {
        std::vector<NameParts> stay;
        for (const NameParts& name : plain->second) {
            auto home = by_width.upper_bound(name.width());
            --home;  // the widest padding that is not wider
            (home->first == 0 ? stay : home->second).push_back(name);
        }
        plain->second = std::move(stay);
        if (plain->second.empty()) by_width.erase(plain);
    }
    for (const auto& [width, members] : by_width) {
        FoundSequence sequence;
        size_t least = members[0].digits.size();
        for (const NameParts& name : members) {
            int frame = 0;
            const std::string number = name.number();
            std::from_chars(number.data(), number.data() + number.size(), frame);
            sequence.frames.push_back(frame);
            least = std::min(least, name.digits.size());
        }
        std::sort(sequence.frames.begin(), sequence.frames.end());
        for (size_t i = 1; i < sequence.frames.size(); ++i)
            for (int hole = sequence.frames[i - 1] + 1; hole < sequence.frames[i] && gaps > 0;
                 ++hole, --gaps)
                sequence.gaps.push_back(hole);
        const NameParts& one = members[0];
        sequence.pattern =
            folder + one.before +
            (members.size() == 1 ? one.number() : std::string(width ? width : least, '#')) +
            one.after;
        found.push_back(std::move(sequence));
    }
}

// Sequences of the files whose name is `wanted`, in no order. Errors (input): the folder cannot be
// read.
Result<std::vector<FoundSequence>> sequences_of(
    const std::string& folder, const std::function<bool(const std::string& name)>& wanted) {
    std::map<std::pair<std::string, std::string>, std::vector<NameParts>> groups;
    std::vector<FoundSequence> found;
    const std::string prefix = folder.ends_with('/') ? folder : folder + "/";
    const OpenFolder in(folder);
    std::error_code error;
    for (fs::directory_iterator it(in.path(), error), end; !error && it != end;
         it.increment(error)) {
        if (is_stopped()) return stopped_status();
        const std::string name = it->path().filename().string();
        std::error_code of_type;
        if (!wanted(name) || !it->is_regular_file(of_type)) continue;
        const NameParts parts = parts_of(name);
        // More than nine digits are a date, not a frame number.
        const bool numbered = !parts.digits.empty() && parts.digits.size() <= 9;
        if (numbered) groups[{parts.before, parts.after}].push_back(parts);
        // --input cannot name a file such as "a#b#.exr".
        const auto one = PathPattern::parse(name);
        if (!numbered && one.ok()) found.push_back({prefix + name, {one->literal_frame()}, {}});
    }
    if (error)
        return Status(StatusCode::input,
                      folder + ": cannot be read: " + error.message() + "; check its permissions");
    size_t gaps = kMaxFrames;
    for (const auto& [name, members] : groups) add_sequences(prefix, members, gaps, found);
    return found;
}

// "shot.#.exr", whether the number is a token or digits; "*" stays, one letter away from it.
std::string form_of(const PathPattern& pattern) {
    const std::string name = fs::path(pattern.format(0)).filename().string();
    const NameParts parts = parts_of(name);
    return parts.digits.empty() ? name : parts.before + "#" + parts.after;
}

}  // namespace

Result<std::vector<FoundSequence>> scan_folder(const std::string& folder) {
    ASSIGN_OR_RETURN(auto found, sequences_of(folder, is_exr));
    if (found.empty())
        return Status(StatusCode::input,
                      folder + ": has no EXR file; give the folder of a sequence");
    std::sort(found.begin(), found.end(),
              [](const FoundSequence& a, const FoundSequence& b) { return a.pattern < b.pattern; });
    return found;
}

std::string nearest_input(const PathPattern& pattern) {
    const std::string extension = lower_case(fs::path(pattern.text()).extension().string());
    const auto found = sequences_of(pattern.folder(), [&](const std::string& name) {
        return name[0] != '.' && lower_case(name).ends_with(extension);
    });
    if (!found.ok() || extension.empty()) return "";
    std::vector<std::string> forms;
    for (const FoundSequence& sequence : *found) {
        const auto parsed = PathPattern::parse(sequence.pattern);
        forms.push_back(parsed.ok() ? form_of(*parsed) : "");
    }
    const std::string form = form_of(pattern);
    const std::string nearest =
        std::ranges::find(forms, form) != forms.end() ? form : nearest_word(form, forms);
    if (nearest.empty()) return "";
    const FoundSequence& meant =
        (*found)[size_t(std::ranges::find(forms, nearest) - forms.begin())];
    const bool names_a_frame =
        !pattern.has_token() && pattern.text().find('*') == std::string::npos &&
        std::ranges::find(meant.frames, pattern.literal_frame()) != meant.frames.end();
    const std::string path =
        names_a_frame ? PathPattern::parse(meant.pattern)->format(pattern.literal_frame())
                      : meant.pattern;
    // The folder as it was typed.
    const size_t slash = pattern.text().rfind('/');
    return pattern.text().substr(0, slash == std::string::npos ? 0 : slash + 1) +
           fs::path(path).filename().string();
}

}  // namespace postchain::io
