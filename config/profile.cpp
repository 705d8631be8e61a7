// Reading profiles: text -> Profile.
#include "config/profile.h"

#include <algorithm>
#include <new>

#include "config/embedded.h"
#include "config/reporter.h"
#include "config/scalar.h"
#include "config/text_tree.h"

namespace postchain {
namespace {

constexpr int kProfileVersion = 1;

// The key of each role in a profile. `depth` is the stored value, in the file's encoding.
struct RoleKey {
    const char* key;
    Role role;
};
constexpr RoleKey kRoleKeys[] = {{"color", Role::color},
                                 {"depth", Role::inverse_depth},
                                 {"motion", Role::motion},
                                 {"motion_back", Role::motion_back}};

class ProfileParser {
  public:
    explicit ProfileParser(ProfileFile& file, const std::string& file_name)
        : profile_(file.profile), reporter_(file_name, StatusCode::usage, file.diagnostics) {}

    void parse(const TextNode& root) {
        if (!root.is_map())
            return reporter_.error(root, "", "a profile is a map, not " + root.describe());
        for (const auto& [key, value] : root.entries) entry(key, value);
        if (!root.find("profile"))
            reporter_.error(root, "profile",
                            concat("missing; a profile begins with profile: ", kProfileVersion));
        if (!root.find("name")) reporter_.error(root, "name", "missing");
        if (!has_role_key(root))
            reporter_.error(root, "", "missing roles; give color, depth, motion or motion_back");
    }

  private:
    static bool has_role_key(const TextNode& root) {
        for (const auto& role : kRoleKeys)
            if (root.find(role.key)) return true;
        return false;
    }

    void entry(const TextNode& key, const TextNode& value) {
        const std::string& name = key.text;
        for (const auto& role : kRoleKeys)
            if (name == role.key) return sources(value, name, role.role);
        if (name == "profile")
            reporter_.check_version(value, "profile", kProfileVersion);
        else if (name == "name")
            text(value, name, profile_.name);
        else if (name == "title")
            text(value, name, profile_.title);
        else if (name == "verified")
            text(value, name, profile_.verified);
        else if (name == "priority")
            priority(value);
        else if (name == "detect")
            profile_.detect_channels = patterns(value, name, 1, 16);
        else if (name == "notes")
            texts(value, name, profile_.notes);
        else if (name == "data")
            texts(value, name, profile_.data);
        else
            reporter_.error(
                key, name,
                unknown_word("key", name,
                             {"profile", "name", "title", "verified", "priority", "detect", "notes",
                              "data", "color", "depth", "motion", "motion_back"}));
    }

    void text(const TextNode& node, const std::string& path, std::string& member) {
        if (!node.is_scalar())
            return reporter_.error(node, path, node.describe() + " is not a string");
        member = node.text;
    }

    void priority(const TextNode& node) {
        const Result<int> value = integer_of(node, 0, 1000);
        if (!value.ok()) return reporter_.error(node, "priority", value.status().message());
        profile_.priority = *value;
    }

    void texts(const TextNode& node, const std::string& path, std::vector<std::string>& member) {
        if (!node.is_list()) return reporter_.error(node, path, path + " is a list of strings");
        for (size_t i = 0; i < node.items.size(); ++i) {
            std::string one;
            text(node.items[i], concat(path, "[", i, "]"), one);
            member.push_back(one);
        }
    }

    // A list of patterns, each a list of `least` to `most` channel names.
    std::vector<ChannelPattern> patterns(const TextNode& node, const std::string& path,
                                         size_t least, size_t most) {
        std::vector<ChannelPattern> result;
        if (!node.is_list() || node.items.empty()) {
            reporter_.error(node, path,
                            node.describe() + " is not a list of lists of channel names");
            return result;
        }
        for (size_t i = 0; i < node.items.size(); ++i) {
            const TextNode& item = node.items[i];
            const std::string at = concat(path, "[", i, "]");
            if (!item.is_list() || item.items.size() < least || item.items.size() > most) {
                reporter_.error(
                    item, at,
                    concat("a list of ", least, most > least ? concat(" to ", most) : std::string(),
                           " channel names"));
                continue;
            }
            ChannelPattern pattern;
            for (const TextNode& name : item.items) {
                if (!name.is_scalar() || name.text.empty() ||
                    name.text.rfind(kLayer) != name.text.find(kLayer) ||
                    (name.text.find(kLayer) != std::string::npos &&
                     (!name.text.starts_with(kLayer) || name.text.size() == kLayer.size())))
                    reporter_.error(
                        name, at,
                        name.describe() +
                            " is not a channel name, with or without a leading <layer>");
                else
                    pattern.push_back(name.text);
            }
            const auto has_layer = [](const std::string& n) { return n.starts_with(kLayer); };
            const auto layered = std::count_if(pattern.begin(), pattern.end(), has_layer);
            if (layered != 0 && layered != std::ptrdiff_t(pattern.size()))
                reporter_.error(item, at, "use <layer> in every name of a pattern or in no name");
            result.push_back(pattern);
        }
        return result;
    }

    void sources(const TextNode& node, const std::string& path, Role role) {
        if (!node.is_list() || node.items.empty())
            return reporter_.error(node, path,
                                   node.describe() +
                                       "; a list of sources, each a map with "
                                       "channels");
        for (size_t i = 0; i < node.items.size(); ++i)
            source(node.items[i], concat(path, "[", i, "]"), role);
    }

    void source(const TextNode& node, const std::string& path, Role role) {
        if (!node.is_map())
            return reporter_.error(node, path, node.describe() + " is not a map with channels");
        const bool is_color = role == Role::color, is_depth = role == Role::inverse_depth;
        const size_t most = size_t(channels_of(role));
        std::vector<std::string> known = {"channels"};
        if (is_color)
            known.push_back("unpremultiplied");
        else if (is_depth)
            known.push_back("encoding");
        else
            known.insert(known.end(), {"unit", "scale", "bias", "sentinel"});

        RoleSource result;
        MotionConvention& motion = result.motion;
        for (const auto& [key, value] : node.entries) {
            const std::string at = path + "." + key.text;
            if (std::find(known.begin(), known.end(), key.text) == known.end())
                reporter_.error(key, at, unknown_word("key", key.text, known));
            else if (key.text == "channels")
                result.channels = patterns(value, at, is_color ? 3 : most, most);
            else if (key.text == "unpremultiplied")
                boolean(value, at, result.unpremultiplied);
            else if (key.text == "encoding")
                result.depth = DepthEncoding(choice(value, at, depth_encoding_names()));
            else if (key.text == "unit")
                motion.unit = MotionUnit(choice(value, at, {"pixels", "fraction"}));
            else if (key.text == "scale")
                scale(value, at, motion);
            else if (key.text == "bias")
                number(value, at, motion.bias);
            else if (number(value, at, motion.sentinel) && !(motion.sentinel > 0))
                reporter_.error(value, at, value.describe() + " is not a number > 0");
        }
        if (!node.find("channels")) reporter_.error(node, path, "channels are missing");
        profile_.roles[role].push_back(std::move(result));
    }

    void boolean(const TextNode& node, const std::string& path, bool& member) {
        const Result<ParameterValue> value = value_of(node);
        const bool* read = value.ok() ? std::get_if<bool>(&*value) : nullptr;
        if (!read) return reporter_.error(node, path, node.describe() + " is not true or false");
        member = *read;
    }

    bool number(const TextNode& node, const std::string& path, double& member) {
        const Result<double> value = number_of(node);
        if (value.ok())
            member = *value;
        else
            reporter_.error(node, path, value.status().message());
        return value.ok();
    }

    // Index into `names`; 0 after an error.
    int choice(const TextNode& node, const std::string& path,
               const std::vector<std::string>& names) {
        const auto found = std::find(names.begin(), names.end(), node.text);
        if (node.is_scalar() && found != names.end()) return int(found - names.begin());
        reporter_.error(node, path, node.describe() + " is not one of " + joined(names));
        return 0;
    }

    void scale(const TextNode& node, const std::string& path, MotionConvention& motion) {
        if (!node.is_list() || node.items.size() != 2)
            return reporter_.error(node, path, "not a list of two numbers, for x and y");
        const bool good = number(node.items[0], path + "[0]", motion.scale_x) &&
                          number(node.items[1], path + "[1]", motion.scale_y);
        if (good && (motion.scale_x == 0 || motion.scale_y == 0))
            reporter_.error(node, path, "a scale of 0 would remove all motion");
    }

    Profile& profile_;
    Reporter reporter_;
};

}  // namespace

namespace {

// As parse_profile(), but throws if memory runs out.
ProfileFile read_profile(std::string_view text, const std::string& file_name) {
    ProfileFile file;
    TextTree tree = read_text_tree(text, file_name, StatusCode::usage);
    file.diagnostics = std::move(tree.diagnostics);
    if (!tree.root.is_null()) ProfileParser(file, file_name).parse(tree.root);
    sort_by_place(file.diagnostics);
    return file;
}

}  // namespace

ProfileFile parse_profile(std::string_view text, const std::string& file_name) {
    try {
        return read_profile(text, file_name);
    } catch (const std::bad_alloc&) {
        ProfileFile file;
        file.diagnostics = out_of_memory_in(file_name);
        return file;
    }
}

const std::vector<Profile>& builtin_profiles() {
    static const std::vector<Profile> profiles = [] {
        std::vector<Profile> all;
        for (const auto& file : embedded_config())
            if (file.path.starts_with("profiles/"))
                all.push_back(read_profile(file.text, std::string(file.path)).profile);
        std::stable_sort(all.begin(), all.end(), [](const Profile& a, const Profile& b) {
            return a.priority > b.priority;
        });
        return all;
    }();
    return profiles;
}

Result<Profile> find_profile(const std::string& name_or_path) try {
    std::vector<std::string> names;
    for (const auto& profile : builtin_profiles()) {
        if (profile.name == name_or_path) return profile;
        names.push_back(profile.name);
    }
    if (name_or_path.find_first_of("/.") == std::string::npos)
        return Status(StatusCode::usage, unknown_word("profile", name_or_path, names));
    ASSIGN_OR_RETURN(const std::string text, read_text_file(name_or_path, StatusCode::usage));
    ProfileFile file = parse_profile(text, name_or_path);
    if (const Status status = file.status(); !status.ok()) {
        std::string faults;  // on one line, as it gets a place before it
        for (const char c : status.message()) faults += c == '\n' ? "; " : std::string(1, c);
        return Status(status.code(), faults);
    }
    return std::move(file.profile);
} catch (...) {
    return status_of_exception(name_or_path);
}

}  // namespace postchain
