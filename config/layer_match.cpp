#include "config/layer_match.h"

#include <fnmatch.h>

#include <algorithm>
#include <array>
#include <set>

#include "chain/base/parameter.h"
#include "chain/base/text.h"

namespace postchain {

bool is_pattern(const std::string& word) {
    return word.find_first_of("*?[") != std::string::npos;
}

namespace {

constexpr std::array<std::array<const char*, 4>, 3> kColorWords = {
    {{"R", "G", "B", "A"}, {"r", "g", "b", "a"}, {"red", "green", "blue", "alpha"}}};

// A channel of a layer: the last word of its name, and its name in the file.
struct Word {
    std::string text;
    std::string channel;
    bool of_role = false;
};
struct Group {
    std::string name;
    int part = 0;
    std::vector<Word> words;
};

const Word* find(const Group& group, const std::string& word) {
    const auto found = std::find_if(group.words.begin(), group.words.end(),
                                    [&](const Word& w) { return w.text == word; });
    return found == group.words.end() ? nullptr : &*found;
}

std::vector<Group> groups_of(const FileChannels& file, const ProfileMatch& match) {
    std::set<std::pair<int, std::string>> of_roles;
    for (const auto& [role, where] : match.roles)
        for (const auto& channel : where.channels) of_roles.emplace(where.part, channel);
    std::vector<Group> groups;
    for (const ViewChannel& channel : channels_in_view(file, match.view)) {
        const size_t dot = channel.name.rfind('.');
        const std::string layer = dot == std::string::npos ? "" : channel.name.substr(0, dot);
        auto group = std::find_if(groups.begin(), groups.end(), [&](const Group& g) {
            return g.part == channel.part && g.name == layer;
        });
        if (group == groups.end()) group = groups.insert(group, {layer, channel.part, {}});
        group->words.push_back({channel.name.substr(dot + 1), channel.channel,
                                of_roles.contains({channel.part, channel.channel})});
    }
    return groups;
}

std::string last_word(const std::string& name) {
    return name.substr(name.rfind('.') + 1);
}

// The pattern by which a layer is data; empty = it is color.
std::string data_pattern(const std::string& layer, const std::vector<std::string>& data) {
    for (const std::string& pattern : data)
        if (::fnmatch(pattern.c_str(), last_word(layer).c_str(), FNM_CASEFOLD) == 0) return pattern;
    return "";
}

void add_layers(const Group& group, const std::vector<std::string>& data,
                std::vector<FileLayer>& layers) {
    std::set<std::string> taken;
    bool of_role = false;
    for (const Word& word : group.words) {
        of_role = of_role || word.of_role;
        if (word.of_role) taken.insert(word.channel);
    }
    // If a role uses some of the channels, as motion does, the others do not form a color.
    for (const auto& words : kColorWords) {
        if (of_role) break;
        FileLayer layer{group.name, {group.part, {}}, {}};
        for (const char* word : words)
            if (const Word* found = find(group, word))
                layer.channels.channels.push_back(found->channel);
        const bool rgb = find(group, words[0]) && find(group, words[1]) && find(group, words[2]);
        if (!rgb) continue;
        if (const std::string pattern = data_pattern(group.name, data); !pattern.empty())
            layer.data = "is named as data (" + pattern + ")";
        taken.insert(layer.channels.channels.begin(), layer.channels.channels.end());
        layers.push_back(std::move(layer));
    }
    FileLayer rest{group.name, {group.part, {}}, "is not R, G, B"};
    for (const Word& word : group.words) {
        if (taken.contains(word.channel)) continue;
        if (group.name.empty())
            layers.push_back({word.text, {group.part, {word.channel}}, rest.data});
        else
            rest.channels.channels.push_back(word.channel);
    }
    if (!rest.channels.channels.empty()) layers.push_back(std::move(rest));
}

// Compares with the whole name and with its last words.
bool fits(const std::string& word, const std::string& name) {
    if (is_pattern(word))
        return ::fnmatch(word.c_str(), name.c_str(), 0) == 0 ||
               ::fnmatch(("*." + word).c_str(), name.c_str(), 0) == 0;
    return name == word || name.ends_with("." + word);
}

// A part's name may come first.
bool is_in(const std::string& name, const std::string& view_layer) {
    return name.starts_with(view_layer + ".") ||
           name.find("." + view_layer + ".") != std::string::npos;
}

std::string place_of(const FileLayer& layer) {
    return concat(quoted(layer.name), " of part ", layer.channels.part, " (",
                  joined(layer.channels.channels), ")");
}

// The only layer of this name.
Result<size_t> find_named(const std::vector<FileLayer>& layers, const std::string& word) {
    std::vector<size_t> whole, last;
    for (size_t i = 0; i < layers.size(); ++i) {
        if (layers[i].name == word) whole.push_back(i);
        if (fits(word, layers[i].name)) last.push_back(i);
    }
    // A color layer goes before data of the same name, such as Z beside R, G and B.
    for (auto* found : {&whole, &last})
        if (std::any_of(found->begin(), found->end(),
                        [&](size_t i) { return layers[i].is_color(); }))
            std::erase_if(*found, [&](size_t i) { return !layers[i].is_color(); });
    const auto& found = whole.empty() ? last : whole;
    if (found.empty()) {
        std::vector<std::string> known;
        for (const FileLayer& layer : layers) {
            if (!layer.is_color()) continue;
            known.push_back(layer.name);
            if (last_word(layer.name) != layer.name) known.push_back(last_word(layer.name));
        }
        const std::string near = nearest_word(word, known);
        if (!near.empty())
            return Status(StatusCode::usage,
                          concat("no layer '", word, "' (did you mean '", near, "'?)"));
        std::erase_if(known, [](const std::string& name) { return name.find('.') != name.npos; });
        return Status(StatusCode::usage,
                      concat("no layer '", word, "'; ",
                             known.empty() ? "the file has no extra color layers"
                                           : "color layers are " + joined(known)));
    }
    if (found.size() > 1) {
        std::vector<std::string> places;
        for (size_t i : found) places.push_back(place_of(layers[i]));
        return Status(StatusCode::usage,
                      concat("several layers are named '", word, "': ", joined(places, " and "),
                             "; give the whole name, or rename one"));
    }
    const FileLayer& one = layers[found[0]];
    if (!one.is_color())
        return Status(StatusCode::usage,
                      concat("layer ", one.name, " ", one.data,
                             ", and data is never averaged; if it is color, write a profile "
                             "that says so (docs/layers.md)"));
    return found[0];
}

}  // namespace

const std::vector<std::string>& data_names(const Profile& profile) {
    if (!profile.data.empty()) return profile.data;
    static const std::vector<std::string> none;
    for (const Profile& one : builtin_profiles())
        if (one.name == "generic") return one.data;
    return none;
}

std::vector<FileLayer> find_layers(const FileChannels& file, const ProfileMatch& match,
                                   const std::vector<std::string>& data) {
    std::vector<FileLayer> layers;
    for (const Group& group : groups_of(file, match)) add_layers(group, data, layers);
    return layers;
}

Result<std::vector<size_t>> choose_layers(const std::vector<FileLayer>& layers,
                                          const std::string& choice, const std::string& color) {
    std::set<size_t> chosen;
    const auto take_all = [&](const std::string& word, const std::string& of) {
        bool any = false;
        for (size_t i = 0; i < layers.size(); ++i) {
            const bool taken = layers[i].is_color() && fits(word, layers[i].name) &&
                               (of.empty() || is_in(layers[i].name, of));
            if (taken) chosen.insert(i);
            any = any || taken;
        }
        return any;
    };
    const std::vector<std::string> words = words_of_list(choice);
    for (const std::string& word : words) {
        if (word == "none") {
            if (words.size() == 1) continue;
            return Status(StatusCode::usage, "'none' contradicts the other names; leave it out");
        }
        if (word == "all") {
            take_all("*", color);
        } else if (is_pattern(word)) {
            if (!take_all(word, ""))
                return Status(StatusCode::usage, concat("no color layer matches '", word,
                                                        "'; `postchain inspect` lists them"));
        } else {
            ASSIGN_OR_RETURN(const auto one, find_named(layers, word));
            chosen.insert(one);
        }
    }
    return std::vector<size_t>(chosen.begin(), chosen.end());
}

std::vector<std::string> words_of_list(const std::string& text) {
    std::vector<std::string> words;
    for (size_t at = 0; at <= text.size();) {
        const size_t end = std::min(text.find(',', at), text.size());
        const size_t first = std::min(text.find_first_not_of(' ', at), end);
        size_t last = end;
        while (last > first && text[last - 1] == ' ') --last;
        if (last > first) words.push_back(text.substr(first, last - first));
        at = end + 1;
    }
    return words;
}

}  // namespace postchain
