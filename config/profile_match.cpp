#include "config/profile_match.h"

#include <algorithm>
#include <array>
#include <optional>
#include <set>

#include "chain/base/printable.h"
#include "config/reporter.h"

namespace postchain {
namespace {

// Channels of one part in one view: name without view -> name in the file. Each channel also has
// the name part.channel, for files with one part per layer.
using PartNames = std::map<std::string, std::string>;

struct Names {
    std::vector<PartNames> parts;
    std::vector<std::string> views;  // the file's views; the first is the default
};

// "layer.view.channel" -> view and "layer.channel", if `view` is one of `views`.
std::optional<std::string> split_view(std::string& name, const std::vector<std::string>& views) {
    const size_t last = name.rfind('.');
    if (last == std::string::npos) return std::nullopt;
    const size_t before = last == 0 ? std::string::npos : name.rfind('.', last - 1);
    const size_t from = before == std::string::npos ? 0 : before + 1;
    const std::string word = name.substr(from, last - from);
    if (std::find(views.begin(), views.end(), word) == views.end()) return std::nullopt;
    name.erase(from, last + 1 - from);
    return word;
}

std::vector<std::string> views_of(const FileChannels& file) {
    std::vector<std::string> views = file.views;
    for (const auto& part : file.parts)
        if (!part.view.empty() && std::find(views.begin(), views.end(), part.view) == views.end())
            views.push_back(part.view);
    return views;
}

// Calls `take(part, name without view, prefix of the part's name, channel)`.
template <class Take>
void each_in_view(const FileChannels& file, const std::string& view, const Take& take) {
    const std::vector<std::string> views = views_of(file);
    for (size_t part = 0; part < file.parts.size(); ++part) {
        const PartChannels& own = file.parts[part];
        std::string prefix = own.name;
        // The name of a view's part is "layer.view".
        if (!own.view.empty() && prefix.ends_with("." + own.view))
            prefix.resize(prefix.size() - own.view.size() - 1);
        for (const auto& channel : own.channels) {
            std::string name = channel;
            const std::optional<std::string> split = split_view(name, views);
            std::string in = split ? *split : own.view;
            if (in.empty() && !views.empty()) in = views[0];
            if (in == view) take(int(part), name, prefix, channel);
        }
    }
}

Names names_in_view(const FileChannels& file, const std::string& view) {
    Names names;
    names.views = views_of(file);
    names.parts.resize(file.parts.size());
    std::vector<PartNames> prefixed(file.parts.size());
    each_in_view(file, view,
                 [&](int part, const std::string& name, const std::string& prefix,
                     const std::string& channel) {
                     names.parts[size_t(part)].emplace(name, channel);
                     if (!prefix.empty() && !name.starts_with(prefix + "."))
                         prefixed[size_t(part)].emplace(prefix + "." + name, channel);
                 });
    for (size_t part = 0; part < prefixed.size(); ++part) names.parts[part].merge(prefixed[part]);
    return names;
}

std::vector<std::string> views_with_channels(const FileChannels& file) {
    std::vector<std::string> views = views_of(file);
    std::erase_if(views, [&](const std::string& view) {
        bool any = false;
        each_in_view(file, view, [&](int, const auto&, const auto&, const auto&) { any = true; });
        return !any;
    });
    return views;
}

bool is_all(const std::string& view, const FileChannels& file) {
    const std::vector<std::string> views = views_of(file);
    return view == kAllViews && std::find(views.begin(), views.end(), view) == views.end();
}

// The view that is meant; empty = the only one.
std::string view_of(const std::string& view, const FileChannels& file) {
    const std::vector<std::string> with = views_with_channels(file), views = views_of(file);
    // Independent of the order in which a file has them.
    if (is_all(view, file))
        return with.empty() ? std::string() : *std::min_element(with.begin(), with.end());
    return view.empty() && !views.empty() ? views[0] : view;
}

bool has_layer(const ChannelPattern& pattern) {
    return !pattern.empty() && pattern[0].starts_with(kLayer);
}

// The channels of `pattern` in `layer`, if one part has all of them.
std::optional<RoleChannels> complete(const ChannelPattern& pattern, const std::string& layer,
                                     const Names& names) {
    for (size_t part = 0; part < names.parts.size(); ++part) {
        RoleChannels found{int(part), {}};
        for (const auto& name : pattern) {
            const std::string wanted =
                has_layer(pattern) ? layer + name.substr(kLayer.size()) : name;
            const auto it = names.parts[part].find(wanted);
            if (it == names.parts[part].end()) break;
            found.channels.push_back(it->second);
        }
        if (!pattern.empty() && found.channels.size() == pattern.size()) return found;
    }
    return std::nullopt;
}

// Layers with all channels of `pattern`; "" for a pattern without <layer>.
std::set<std::string> layers_of(const ChannelPattern& pattern, const Names& names) {
    std::set<std::string> layers;
    if (!has_layer(pattern)) {
        if (complete(pattern, "", names)) layers.insert("");
        return layers;
    }
    const std::string suffix = pattern[0].substr(kLayer.size());
    for (const auto& part : names.parts) {
        for (const auto& [name, channel] : part) {
            if (name.size() <= suffix.size() || !name.ends_with(suffix)) continue;
            const std::string layer = name.substr(0, name.size() - suffix.size());
            if (complete(pattern, layer, names)) layers.insert(layer);
        }
    }
    return layers;
}

struct Found {
    const RoleSource* source = nullptr;
    RoleChannels channels;
};

// The first complete pattern of a role: first in the layer, then outside all layers (one depth for
// all of them). If any layer has color, only layers with color are candidates.
std::optional<Found> find_role(const std::vector<RoleSource>& sources, const std::string& layer,
                               const Names& names) {
    for (const bool layered : {true, false}) {
        if (layered && layer.empty()) continue;
        for (const auto& source : sources)
            for (const auto& pattern : source.channels)
                if (has_layer(pattern) == layered)
                    if (auto channels = complete(pattern, layer, names))
                        return Found{&source, *channels};
    }
    return std::nullopt;
}

std::map<Role, Found> find_roles(const Profile& profile, const std::string& layer,
                                 const Names& names) {
    std::map<Role, Found> found;
    for (const auto& [role, sources] : profile.roles)
        if (auto one = find_role(sources, layer, names)) found.emplace(role, *one);
    return found;
}

bool same_channels(const std::map<Role, Found>& a, const std::map<Role, Found>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& one, const auto& two) {
        return one.first == two.first && one.second.channels == two.second.channels;
    });
}

std::string shown(const std::string& layer) {
    return layer.empty() ? "(unnamed)" : layer;
}

std::string shown(const std::vector<std::string>& layers) {
    std::vector<std::string> words;
    for (const auto& layer : layers) words.push_back(shown(layer));
    return joined(words);
}

// "<layer>.Depth.Z or <layer>.Depth.V"
std::string looked_for(const std::vector<RoleSource>& sources) {
    std::string text;
    for (const auto& source : sources)
        for (const auto& pattern : source.channels)
            text += (text.empty() ? "" : " or ") + joined(pattern);
    return text;
}

std::string channels_found(const FileChannels& file) {
    constexpr size_t kShown = 40;
    std::vector<std::string> all;
    for (const auto& part : file.parts)
        for (const auto& channel : part.channels)
            all.push_back(file.parts.size() > 1 && !part.name.empty() ? part.name + ":" + channel
                                                                      : channel);
    const size_t more = all.size() > kShown ? all.size() - kShown : 0;
    if (more > 0) all.resize(kShown);
    if (all.empty()) return "no channels";
    return joined(all) + (more > 0 ? concat(" and ", more, " more") : std::string());
}

// The channels of layers that may be motion vectors: of two channels, or named so, and of no role.
// At most three layers.
std::string unassigned_pairs(const FileChannels& file, const ProfileMatch& match) {
    constexpr size_t kShown = 3;
    std::vector<std::string> found;
    for (size_t part = 0; part < file.parts.size(); ++part) {
        std::map<std::string, std::vector<std::string>> layers;
        for (const std::string& name : file.parts[part].channels) {
            const bool assigned =
                std::any_of(match.roles.begin(), match.roles.end(), [&](const auto& role) {
                    return role.second.part == int(part) &&
                           std::ranges::find(role.second.channels, name) !=
                               role.second.channels.end();
                });
            const size_t dot = name.rfind('.');
            if (!assigned)
                layers[dot == std::string::npos ? file.parts[part].name : name.substr(0, dot)]
                    .push_back(name);
        }
        for (const auto& [layer, channels] : layers) {
            const std::string word = lower_case(layer);
            const bool named = std::ranges::any_of(
                std::array{"motion", "vector", "velocity", "flow"},
                [&](const char* one) { return word.find(one) != std::string::npos; });
            if (!layer.empty() && (channels.size() == 2 || (named && channels.size() > 2)))
                found.push_back(joined(channels));
        }
    }
    if (found.size() > kShown) found.resize(kShown);
    return joined(found);
}

// Layers of the profile in the file: with color, or if none has color, with any role.
std::vector<std::string> find_view_layers(const Profile& profile, const Names& names) {
    std::set<std::string> with_color, with_any;
    for (const auto& [role, sources] : profile.roles)
        for (const auto& source : sources)
            for (const auto& pattern : source.channels)
                for (const auto& layer : layers_of(pattern, names)) {
                    with_any.insert(layer);
                    if (role == Role::color) with_color.insert(layer);
                }
    const std::set<std::string>& layers = with_color.empty() ? with_any : with_color;
    return {layers.begin(), layers.end()};
}

// The layer to use; `note` gets the reason.
Result<std::string> choose_view_layer(const Profile& profile, const Names& names,
                                      const std::vector<std::string>& layers,
                                      const std::string& wanted, std::string& note) {
    if (!wanted.empty()) {
        if (std::find(layers.begin(), layers.end(), wanted) != layers.end()) return wanted;
        return Status(StatusCode::usage,
                      "view layer '" + wanted + "' is not in the file; found are " + shown(layers));
    }
    if (layers.size() == 1) return layers[0];
    if (layers[0].empty()) {
        // With one part per layer, a layer's channels alone make an unnamed one too, without the
        // other parts.
        std::string chosen;
        auto most = find_roles(profile, chosen, names);
        for (const auto& layer : layers) {
            auto roles = find_roles(profile, layer, names);
            const auto its = roles.find(Role::color), own = most.find(Role::color);
            if (its == roles.end() || own == most.end() ||
                its->second.channels != own->second.channels || roles.size() <= most.size())
                continue;
            chosen = layer;
            most = std::move(roles);
        }
        return chosen;
    }
    std::vector<std::string> best;
    size_t most = 0;
    for (const auto& layer : layers) {
        const size_t roles = find_roles(profile, layer, names).size();
        if (roles > most) {
            most = roles;
            best.clear();
        }
        if (roles == most) best.push_back(layer);
    }
    // One layer may have two names, with and without that of its part.
    const std::vector<std::string> equal = best;
    std::erase_if(best, [&](const std::string& name) {
        return std::any_of(equal.begin(), equal.end(), [&](const std::string& other) {
            return name.ends_with("." + other) && same_channels(find_roles(profile, name, names),
                                                                find_roles(profile, other, names));
        });
    });
    if (best.size() > 1)
        return Status(StatusCode::input, "several view layers: " + shown(layers) +
                                             "; choose one with {view_layer}"_keyed);
    note = "view layer " + best[0] + " of " + shown(layers) + ", because it has the most planes";
    return best[0];
}

}  // namespace

Result<ProfileMatch> match_profile(const Profile& profile, const FileChannels& file,
                                   const std::string& view_layer, const std::string& view) {
    ProfileMatch match;
    match.profile = profile.name;
    match.why = "named";
    match.views = views_of(file);
    match.view = view_of(view, file);
    const std::vector<std::string> with_channels = views_with_channels(file);
    if (is_all(view, file)) {
        match.other_views = with_channels;
        std::erase(match.other_views, match.view);
    }
    if (!view.empty() && !is_all(view, file) &&
        std::find(match.views.begin(), match.views.end(), view) == match.views.end())
        return Status(
            StatusCode::usage,
            "view '" + view + "' is not in the file; " +
                (match.views.empty() ? "it has no views" : "found are " + joined(match.views)));
    // Neither view is more likely meant than the other.
    if (view.empty() && with_channels.size() > 1)
        return Status(StatusCode::usage,
                      "several views: " + joined(match.views) + "; choose one with {view}"_keyed);
    const Names names = names_in_view(file, match.view);
    match.view_layers = find_view_layers(profile, names);
    for (const auto& [role, sources] : profile.roles) match.missing[role] = looked_for(sources);
    if (match.view_layers.empty()) {
        std::string text =
            "profile " + profile.name + " matches no channels of this file; it looked for";
        for (const auto& [role, wanted] : match.missing)
            text += concat(" ", name_of(role), ": ", wanted, ";");
        return Status(StatusCode::input, text + " found: " + channels_found(file) +
                                             "; name them in a profile of your own");
    }
    std::string note;
    ASSIGN_OR_RETURN(match.view_layer,
                     choose_view_layer(profile, names, match.view_layers, view_layer, note));
    if (!note.empty()) match.notes.push_back(note);

    for (const auto& [role, found] : find_roles(profile, match.view_layer, names)) {
        match.roles[role] = found.channels;
        match.missing.erase(role);
        switch (role) {
            case Role::color:
                match.options.unpremultiplied = found.source->unpremultiplied;
                break;
            case Role::inverse_depth:
                match.options.depth = found.source->depth;
                break;
            case Role::motion:
                match.options.motion = found.source->motion;
                break;
            case Role::motion_back:
                match.options.motion_back = found.source->motion;
                break;
            default:  // not stored in files
                break;
        }
    }
    match.notes.insert(match.notes.end(), profile.notes.begin(), profile.notes.end());
    if (const auto motion = match.missing.find(Role::motion); motion != match.missing.end())
        if (const std::string pairs = unassigned_pairs(file, match); !pairs.empty())
            motion->second +=
                concat(" (", pairs, " may be motion vectors; name them in a profile of your own)");
    return match;
}

Result<ProfileMatch> detect_profile(const std::vector<Profile>& profiles, const FileChannels& file,
                                    const std::string& view_layer, const std::string& view) {
    const Names names = names_in_view(file, view_of(view, file));
    for (const auto& profile : profiles) {
        std::string why = "no other profile matches";
        bool is_it = profile.detect_channels.empty();
        for (const auto& pattern : profile.detect_channels) {
            const std::set<std::string> layers = layers_of(pattern, names);
            if (is_it || layers.empty()) continue;
            is_it = true;
            why = "channels " + joined(complete(pattern, *layers.begin(), names)->channels);
        }
        if (!is_it) continue;
        Result<ProfileMatch> match = match_profile(profile, file, view_layer, view);
        if (match.ok()) {
            match->detected = true;
            match->why = why;
        }
        return match;
    }
    return Status(StatusCode::input, "no profile matches; found: " + channels_found(file) +
                                         "; choose one with {profile}"_keyed);
}

std::vector<ViewChannel> channels_in_view(const FileChannels& file, const std::string& view) {
    const std::vector<std::string> views = views_of(file);
    const std::string chosen = view.empty() && !views.empty() ? views[0] : view;
    std::vector<ViewChannel> channels;
    each_in_view(file, chosen,
                 [&](int part, const std::string& name, const std::string& prefix,
                     const std::string& channel) {
                     const bool whole = prefix.empty() || name.starts_with(prefix + ".");
                     channels.push_back({part, whole ? name : prefix + "." + name, channel});
                 });
    return channels;
}

std::string ProfileMatch::text() const {
    std::string text;
    const auto add = [&](const std::string& line) { text += printable(line) + "\n"; };
    add(concat("profile ", profile, detected ? " (detected: " : " (", why, ")"));
    if (!view_layers.empty() && !(view_layers.size() == 1 && view_layers[0].empty()))
        add("view layer " + shown(view_layer) +
            (view_layers.size() > 1 ? " of " + shown(view_layers) : std::string()));
    if (!views.empty()) add("view " + view + " of " + joined(views));
    for (const auto& [role, found] : roles) {
        std::string line = concat(name_of(role), ": ", joined(found.channels));
        if (found.part > 0) line += concat(" (part ", found.part, ")");
        if (role == Role::inverse_depth)
            line += ", stored as " + depth_encoding_names()[size_t(options.depth)];
        if (role == Role::color && found.channels.size() == 3) line += ", alpha 1";
        if (role == Role::color && options.unpremultiplied) line += ", not premultiplied";
        if (role == Role::motion || role == Role::motion_back) {
            const MotionConvention& m = role == Role::motion ? options.motion : options.motion_back;
            line += concat(" times (", text_of(ParameterValue(m.scale_x)), ", ",
                           text_of(ParameterValue(m.scale_y)), ")",
                           m.unit == MotionUnit::pixels ? " pixels" : " of the image's size");
            if (m.bias != 0) line += ", bias " + text_of(ParameterValue(m.bias));
        }
        add(line);
    }
    for (const auto& [role, wanted] : missing)
        add(concat(name_of(role), ": none; looked for ", wanted));
    for (const auto& note : notes) add("note: " + note);
    return text;
}

}  // namespace postchain
