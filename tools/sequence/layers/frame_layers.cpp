#include "tools/sequence/layers/frame_layers.h"

#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "chain/base/parameter.h"
#include "chain/base/text.h"
#include "chain/frame/layers.h"
#include "config/layer_match.h"
#include "tools/sequence/layers/fill_mask.h"

namespace postchain::sequence {
namespace {

// Ids whose name is `word` or matches it as a pattern.
std::vector<io::CryptoId> ids_named(const io::Cryptomatte& cryptomatte, const std::string& word) {
    std::vector<io::CryptoId> ids;
    for (const auto& [name, id] : cryptomatte.manifest)
        if (name == word || (is_pattern(word) && ::fnmatch(word.c_str(), name.c_str(), 0) == 0))
            ids.push_back(id);
    return ids;
}

void sort_without_repetition(std::vector<io::CryptoId>& ids) {
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
}

// Says that no id is called `word`, with the closest of the known names, or all of them.
std::string unknown_id_text(const std::string& word, std::vector<std::string> known) {
    const std::string near = nearest_word(word, known);
    if (!near.empty())
        return concat("no '", word, "' in the cryptomatte (did you mean '", near, "'?)");
    if (known.empty()) return concat("no '", word, "': the file has no cryptomatte with names");
    constexpr size_t kShown = 40;
    const size_t all = known.size();
    if (all > kShown) known.resize(kShown);
    return concat("no '", word, "' in the cryptomatte; it has ", joined(known),
                  all > kShown ? ", ..." : "");
}

// The ids with these names or patterns in each cryptomatte, sorted. Without a manifest a name is
// found by its hash, and `warnings` says so. Errors (input): a word that no cryptomatte knows.
Result<std::vector<std::vector<io::CryptoId>>> ids_of_names(
    const std::vector<std::string>& words, const std::vector<io::Cryptomatte>& cryptomattes,
    std::vector<std::string>& warnings) {
    std::vector<std::vector<io::CryptoId>> found(cryptomattes.size());
    for (const std::string& word : words) {
        bool any = false;
        std::vector<std::string> known;
        for (size_t i = 0; i < cryptomattes.size(); ++i) {
            const io::Cryptomatte& one = cryptomattes[i];
            auto ids = ids_named(one, word);
            if (one.manifest.empty() && !is_pattern(word)) {
                ids.push_back(io::id_of_name(word));
                warnings.push_back(concat("cryptomatte ", one.name, ": ", one.no_manifest, ": '",
                                          word, "' is found by the hash of its name"));
            }
            any = any || !ids.empty();
            found[i].insert(found[i].end(), ids.begin(), ids.end());
            for (const auto& [name, id] : one.manifest) known.push_back(name);
        }
        if (!any) return Status(StatusCode::input, unknown_id_text(word, std::move(known)));
    }
    for (auto& ids : found) sort_without_repetition(ids);
    return found;
}

// Prefix of id names that are searched in all cryptomattes.
constexpr const char* kAnyCryptomatte = "cryptomatte";

bool ends_with_word(const std::string& name, const std::string& word) {
    return name == word || name.ends_with("." + word);
}

// Why the channels cannot be filtered with color; empty = they can.
std::string obstacle(const io::PixelFile& file, const RoleChannels& channels,
                     const ProfileMatch& match) {
    const io::ExrPart& part = file.parts()[size_t(channels.part)];
    const io::ExrPart& color = file.parts()[size_t(match.roles.at(Role::color).part)];
    if (part.data_window != color.data_window)
        return concat("has another size: its data window is ", part.data_window.text(),
                      ", that of color ", color.data_window.text());
    for (const std::string& name : channels.channels) {
        const io::ExrChannel* channel = part.find(name);
        if (channel->x_sampling != 1 || channel->y_sampling != 1)
            return concat("has a subsampled channel (", name, ")");
        if (channel->type == io::PixelType::uint32)
            return concat("has an integer channel (", name, ")");
    }
    return "";
}

class MatteFinder {
  public:
    // `faulty`: cryptomattes that cannot be used.
    MatteFinder(const io::PixelFile& file, const ProfileMatch& match,
                const std::vector<io::Cryptomatte>& faulty, FrameLayers& layers)
        : file_(file), match_(match), faulty_(faulty), layers_(layers) {}

    Result<MatteSource> find(const std::string& name) {
        MatteSource source;
        source.name = name;
        const size_t colon = name.find(':');
        if (colon != std::string::npos) {
            const std::string of = name.substr(0, colon);
            const auto is_meant = [&](const io::Cryptomatte& one) {
                return of == kAnyCryptomatte || of == one.name || of == one.short_name();
            };
            std::vector<size_t> candidates;
            for (size_t i = 0; i < layers_.cryptomattes.size(); ++i)
                if (is_meant(layers_.cryptomattes[i])) candidates.push_back(i);
            const auto faulty = std::find_if(faulty_.begin(), faulty_.end(), is_meant);
            if (candidates.empty() && faulty != faulty_.end()) return faulty->fault;
            if (!candidates.empty() || of == kAnyCryptomatte) {
                Status status = find_ids(name, name.substr(colon + 1), candidates, source);
                if (status.ok()) return source;
                if (faulty == faulty_.end()) return status;
                return Status(status.code(),
                              concat(status.message(), "; and ", faulty->fault.message()));
            }
        }
        RETURN_IF_ERROR(find_channel(source));
        return source;
    }

  private:
    Status fault(const std::string& matte, const std::string& what) const {
        return Status(StatusCode::input,
                      concat(file_.path(), ": matte ", quoted(matte), ": ", what));
    }

    Status find_channel(MatteSource& source) const {
        std::vector<std::string> known;
        std::vector<RoleChannels> whole, last;
        for (const ViewChannel& channel : channels_in_view(io::channels_of(file_), match_.view)) {
            known.push_back(channel.name);
            known.push_back(channel.name.substr(channel.name.find('.') + 1));
            const RoleChannels here{channel.part, {channel.channel}};
            if (channel.name == source.name || channel.channel == source.name)
                whole.push_back(here);
            if (ends_with_word(channel.name, source.name)) last.push_back(here);
        }
        const auto& found = whole.empty() ? last : whole;
        if (found.empty()) {
            std::vector<std::string> all;
            for (size_t i = 0; i < known.size(); i += 2) all.push_back(known[i]);
            for (const auto& one : layers_.cryptomattes)
                for (const auto& [name, id] : one.manifest) known.push_back("cryptomatte:" + name);
            const std::string near = nearest_word(source.name, known);
            return fault(source.name, near.empty()
                                          ? concat("unknown channel; give a channel, or "
                                                   "cryptomatte:NAME; channels are ",
                                                   joined(all))
                                          : concat("unknown channel (did you mean '", near, "'?)"));
        }
        if (found.size() > 1)
            return fault(source.name, concat("the name matches ", found.size(),
                                             " channels; give the whole name"));
        source.channel = found[0];
        if (const std::string why = obstacle(file_, source.channel, match_); !why.empty())
            return fault(source.name, why);
        return Status();
    }

    Status find_ids(const std::string& matte, const std::string& names,
                    const std::vector<size_t>& candidates, MatteSource& source) const {
        if (candidates.empty()) return fault(matte, "the file has no cryptomatte");
        const std::vector<std::string> words = words_of_list(names);
        if (words.empty()) return fault(matte, "give a name after the colon");
        for (const std::string& word : words)
            RETURN_IF_ERROR(find_id(matte, word, candidates, source));
        for (auto& [cryptomatte, ids] : source.ids) {
            RoleChannels channels{layers_.cryptomattes[cryptomatte].levels[0].part, {}};
            if (const std::string why = obstacle(file_, channels, match_); !why.empty())
                return fault(matte, why);
            sort_without_repetition(ids);
        }
        return Status();
    }

    Status find_id(const std::string& matte, const std::string& word,
                   const std::vector<size_t>& candidates, MatteSource& source) const {
        const bool pattern = is_pattern(word);
        std::vector<std::string> known, with;
        std::vector<size_t> without;
        for (size_t i : candidates) {
            const io::Cryptomatte& one = layers_.cryptomattes[i];
            if (one.manifest.empty()) without.push_back(i);
            for (const auto& [name, id] : one.manifest) known.push_back(name);
            const auto ids = ids_named(one, word);
            if (ids.empty()) continue;
            source.ids[i].insert(source.ids[i].end(), ids.begin(), ids.end());
            with.push_back(one.short_name());
        }
        if (with.size() > 1)
            return fault(matte, concat("'", word, "' is in several cryptomattes; choose one: ",
                                       joined(with, concat(":", word, " or ")), ":", word));
        if (with.size() == 1) return Status();
        if (without.size() == 1 && !pattern) {
            const io::Cryptomatte& one = layers_.cryptomattes[without[0]];
            source.ids[without[0]].push_back(io::id_of_name(word));
            layers_.warnings.push_back(concat(file_.path(), ": cryptomatte ", one.name, ": ",
                                              one.no_manifest, ": '", word,
                                              "' is found by the hash of its name"));
            return Status();
        }
        if (!without.empty())
            return fault(matte, pattern ? "patterns need a manifest, and " +
                                              layers_.cryptomattes[without[0]].no_manifest
                                        : "several cryptomattes have no manifest; choose one, as "
                                          "CryptoObject:NAME");
        return fault(matte, unknown_id_text(word, std::move(known)));
    }

    const io::PixelFile& file_;
    const ProfileMatch& match_;
    const std::vector<io::Cryptomatte>& faulty_;
    FrameLayers& layers_;
};

// The named channels in the window of `read`, taken from the planes that were kept.
Result<ImageF> pixels_of(io::PixelFile& file, const io::StoredFrame& read,
                         const RoleChannels& source, int channels) {
    if (read.kept && read.kept->part == source.part)
        return read.kept->interleaved(source.channels, read.window, channels, 0);
    ASSIGN_OR_RETURN(const auto pixels, file.read_part(source.part, source.channels, read.window));
    return pixels.interleaved(source.channels, read.window, channels, 0);
}

// The attributes, not the names, mark cryptomattes as data.
void mark_cryptomattes(const std::vector<io::Cryptomatte>& cryptomattes,
                       std::vector<FileLayer>& layers) {
    for (FileLayer& layer : layers)
        for (const io::Cryptomatte& one : cryptomattes) {
            const bool holds = std::any_of(
                layer.channels.channels.begin(), layer.channels.channels.end(),
                [&](const std::string& name) { return one.holds(layer.channels.part, name); });
            if (holds)
                layer.data = "is a cryptomatte";
            else if (layer.name == one.name)
                layer.data = "is the preview of a cryptomatte";
        }
}

bool is_written(const std::vector<std::string>& channels, const io::ExrSettings& written) {
    return std::any_of(channels.begin(), channels.end(),
                       [&](const std::string& name) { return written.takes(name); });
}

bool is_written(const io::Cryptomatte& cryptomatte, const io::ExrSettings& written) {
    return std::any_of(
        cryptomatte.levels.begin(), cryptomatte.levels.end(), [&](const io::CryptoLevel& level) {
            return is_written({level.channels.begin(), level.channels.end()}, written);
        });
}

bool is_of_filtered(const FileLayer& layer, const FrameLayers& layers) {
    const auto end = layers.cryptomattes.begin() + std::ptrdiff_t(layers.filtered_cryptomattes);
    return std::any_of(layers.cryptomattes.begin(), end, [&](const io::Cryptomatte& one) {
        return one.holds(layer.channels.part, layer.channels.channels[0]);
    });
}

}  // namespace

std::vector<std::string> mattes_of(const Chain& chain) {
    std::vector<std::string> names;
    for (const ChainLink& link : chain.links)
        if (!link.matte.empty() && std::find(names.begin(), names.end(), link.matte) == names.end())
            names.push_back(link.matte);
    return names;
}

bool is_matte_of_ids(const std::string& matte) {
    return matte.find(':') != std::string::npos;
}

std::vector<int> matte_indices(const Chain& chain, const std::vector<std::string>& mattes) {
    std::vector<int> indices;
    for (const ChainLink& link : chain.links) {
        const auto found = std::find(mattes.begin(), mattes.end(), link.matte);
        indices.push_back(found == mattes.end() ? -1 : int(found - mattes.begin()));
    }
    return indices;
}

std::string FrameLayers::text() const {
    std::string text;
    const auto channels = [&](const RoleChannels& where) {
        text += concat(" ", where.part);
        for (const std::string& name : where.channels) text += " " + name;
    };
    for (const FileLayer& layer : filtered) {
        text += "layer";
        channels(layer.channels);
        text += "\n";
    }
    for (size_t i = 0; i < filtered_cryptomattes; ++i) {
        text += "cryptomatte " + cryptomattes[i].name;
        if (const auto ids = filtered_ids.find(i); ids != filtered_ids.end())
            for (const io::CryptoId id : ids->second) text += concat(" ", id);
        text += "\n";
    }
    for (const MatteSource& matte : mattes) {
        text += "matte";
        channels(matte.channel);
        for (const auto& [cryptomatte, ids] : matte.ids) {
            text += " " + cryptomattes[cryptomatte].name;
            for (io::CryptoId id : ids) text += concat(" ", id);
        }
        text += "\n";
    }
    if (!fill_mask.empty()) text += "fill mask " + fill_mask + "\n";
    return text;
}

Result<FrameLayers> find_frame_layers(const LayerSettings& settings,
                                      const std::vector<std::string>& data,
                                      const io::PixelFile& file, const ProfileMatch& match) try {
    FrameLayers result;
    std::vector<FileLayer> layers = find_layers(io::channels_of(file), match, data);
    ASSIGN_OR_RETURN(auto cryptomattes,
                     io::find_cryptomattes(
                         file,
                         settings.mattes.empty() && settings.ids.empty() ? io::Manifests::not_read
                                                                         : io::Manifests::read,
                         settings.manifest_check,
                         {match.view, !match.views.empty() && match.view == match.views[0]}));
    mark_cryptomattes(cryptomattes, layers);
    std::vector<std::string> notes;
    ASSIGN_OR_RETURN(
        const auto ids,
        ids_of_names(settings.ids, cryptomattes, notes).at(file.path() + ": {cryptomatte}"_keyed));
    for (const std::string& note : notes) result.warnings.push_back(file.path() + ": " + note);
    std::vector<io::Cryptomatte> kept, faulty;
    for (size_t i = 0; i < cryptomattes.size(); ++i) {
        io::Cryptomatte& one = cryptomattes[i];
        const bool asked = settings.cryptomatte == CryptomatteChoice::filter &&
                           (settings.ids.empty() || !ids[i].empty());
        const bool filtered = asked && is_written(one, settings.written);
        if (filtered && !settings.ids.empty())
            result.filtered_ids[result.cryptomattes.size()] = ids[i];
        if (filtered && !one.fault.ok()) return one.fault;
        if (asked && one.levels.empty())
            result.warnings.push_back(one.fault.message() + ": nothing is filtered");
        (!one.fault.ok() ? faulty
         : filtered      ? result.cryptomattes
                         : kept)
            .push_back(std::move(one));
    }
    result.filtered_cryptomattes = result.cryptomattes.size();
    std::move(kept.begin(), kept.end(), std::back_inserter(result.cryptomattes));

    std::vector<std::string> words = words_of_list(settings.aovs);
    if (settings.only_present)
        std::erase_if(words, [&](const std::string& word) {
            return !choose_layers(layers, word, match.view_layer).ok();
        });
    ASSIGN_OR_RETURN(
        const auto chosen,
        choose_layers(layers, joined(words), match.view_layer).at(file.path() + ": {aovs}"_keyed));
    const bool all = std::find(words.begin(), words.end(), "all") != words.end();
    for (size_t i = 0; i < layers.size(); ++i) {
        FileLayer& layer = layers[i];
        if (!is_written(layer.channels.channels, settings.written)) {
            result.left.push_back({layer.name, "is excluded by {channels}"_keyed});
            continue;
        }
        if (!std::binary_search(chosen.begin(), chosen.end(), i)) {
            if (!is_of_filtered(layer, result))
                result.left.push_back({layer.name, !layer.is_color() ? layer.data
                                                   : all
                                                       ? "is not of view layer " + match.view_layer
                                                       : "not requested"});
            continue;
        }
        const std::string why = obstacle(file, layer.channels, match);
        if (why.empty())
            result.filtered.push_back(std::move(layer));
        else if (all || settings.only_present)
            result.left.push_back({layer.name, why});
        else
            return Status(StatusCode::input,
                          concat(file.path(), ": {aovs}: layer "_keyed, layer.name, " ", why));
    }
    for (size_t i = 0; i < result.cryptomattes.size(); ++i) {
        const io::Cryptomatte& one = result.cryptomattes[i];
        const RoleChannels where{one.levels[0].part, {}};
        const std::string why = obstacle(file, where, match);
        const bool filtered = i < result.filtered_cryptomattes;
        if (filtered && !why.empty())
            return Status(StatusCode::input,
                          concat(file.path(), ": {cryptomatte}: "_keyed, one.name, " ", why));
        if (!filtered && !result.filtered.empty() && is_written(one, settings.written))
            result.warnings.push_back(
                concat(file.path(), ": cryptomatte ", one.name,
                       " stays as rendered and is sharper than the layers beside it "
                       "({cryptomatte=filter})"_keyed));
    }
    MatteFinder finder(file, match, faulty, result);
    for (const std::string& name : settings.mattes) {
        ASSIGN_OR_RETURN(auto matte, finder.find(name));
        result.mattes.push_back(std::move(matte));
    }
    result.fill_mask = settings.fill_mask;
    const io::ExrPart& color_part = file.parts()[size_t(match.roles.at(Role::color).part)];
    // As the other channels of a part with several views.
    const bool named_by_view =
        color_part.view.empty() && !match.views.empty() && match.view != match.views[0];
    if (!result.fill_mask.empty() && named_by_view) result.fill_mask += "." + match.view;
    if (!result.fill_mask.empty())
        for (const std::string& name : fill_mask_channels(result.fill_mask))
            if (color_part.find(name))
                return Status(StatusCode::input,
                              concat(file.path(), ": {fill_mask}: the file has a channel "_keyed,
                                     name, "; give the mask another name"));
    return result;
} catch (...) {
    return status_of_exception(file.path());
}

Result<ImageF> read_layers(const FrameLayers& layers, io::PixelFile& file,
                           const io::StoredFrame& read) {
    std::vector<ImageF> planes;
    for (const FileLayer& layer : layers.filtered) {
        ASSIGN_OR_RETURN(auto plane, pixels_of(file, read, layer.channels, 4));
        planes.push_back(std::move(plane));
    }
    return stack_planes(planes);
}

void MatteFindings::add(uint64_t values, const std::string& warning) {
    if (std::ranges::find(warnings, warning) != warnings.end()) return;
    faulty += values;
    warnings.push_back(warning);
}

void MatteFindings::add_cryptomatte(const std::string& path, const io::Cryptomatte& cryptomatte,
                                    const io::RankedCoverage& ranks) {
    if (ranks.faulty > 0)
        add(ranks.faulty, concat(path, ": cryptomatte ", cryptomatte.name, ": ", ranks.faulty,
                                 " ids or coverages are not finite, or coverages are beyond 1.5; "
                                 "they count as none"));
}

Result<ImageF> read_mattes(const FrameLayers& layers, io::PixelFile& file,
                           const io::StoredFrame& read, MatteFindings& findings) {
    const std::string path = file.path();
    const io::Window& area = read.window;
    std::map<size_t, io::RankedCoverage> ranks;
    std::vector<ImageF> planes;
    for (const MatteSource& matte : layers.mattes) {
        ImageF plane(area.width(), area.height(), 1);
        if (!matte.channel.channels.empty()) {
            ASSIGN_OR_RETURN(plane, pixels_of(file, read, matte.channel, 1));
            const auto bad = std::ranges::count_if(
                plane.data, [](float value) { return !std::isfinite(value); });
            if (bad > 0)
                findings.add(uint64_t(bad), concat(path, ": matte ", quoted(matte.name), ": ", bad,
                                                   " pixels are not finite: NaN counts as 0, Inf "
                                                   "as 1"));
            // Above what filters overshoot.
            constexpr float kMost = 1.5f;
            const auto finite_above = [](float value) {
                return std::isfinite(value) && value > kMost;
            };
            if (const auto above = std::ranges::count_if(plane.data, finite_above); above > 0)
                findings.warnings.push_back(concat(
                    path, ": matte ", quoted(matte.name), ": ", above,
                    " pixels are above 1 and count as 1; is it stored as 0..255? Write 0..1"));
        }
        for (const auto& [cryptomatte, ids] : matte.ids) {
            const io::Cryptomatte& source = layers.cryptomattes[cryptomatte];
            if (!ranks.contains(cryptomatte)) {
                ASSIGN_OR_RETURN(auto stored, io::read_ranks(file, source, area));
                findings.add_cryptomatte(path, source, stored);
                ranks[cryptomatte] = std::move(stored);
            }
            const ImageF coverage = io::coverage_of(ranks.at(cryptomatte), ids);
            for (size_t i = 0; i < plane.data.size(); ++i) plane.data[i] += coverage.data[i];
            const bool empty = std::all_of(coverage.data.begin(), coverage.data.end(),
                                           [](float value) { return value == 0; });
            if (empty && source.manifest.empty())
                findings.warnings.push_back(concat(path, ": matte ", quoted(matte.name),
                                                   ": no pixel of cryptomatte ", source.name,
                                                   " has such an id, and ", source.no_manifest));
        }
        for (float& value : plane.data) value = value > 0 ? std::min(value, 1.0f) : 0.0f;
        planes.push_back(std::move(plane));
    }
    return stack_planes(planes);
}

}  // namespace postchain::sequence
