#include "tools/sequence/planes/cryptomatte.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <filesystem>
#include <optional>

#include "chain/base/readable_file.h"
#include "chain/base/text.h"
#include "tools/sequence/files/json.h"

namespace postchain::io {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "cryptomatte/";
constexpr uint64_t kMaxManifest = uint64_t(1) << 26;  // bytes of a file

Status fault(const PixelFile& file, const Cryptomatte& cryptomatte, const std::string& what) {
    return Status(StatusCode::input,
                  concat(file.path(), ": cryptomatte ", quoted(cryptomatte.name), ": ", what));
}

// Parses "13851a76"; empty if it is not a hexadecimal number of 32 bits.
std::optional<uint32_t> hex_number(const std::string& text) {
    uint32_t value = 0;
    const char* end = text.data() + text.size();
    const auto read = std::from_chars(text.data(), end, value, 16);
    if (read.ec != std::errc() || read.ptr != end) return {};
    return value;
}

// Parses a manifest; returns why it is invalid, or empty.
std::string take_manifest(const std::string& text, Cryptomatte& to) {
    // A manifest may name any number of objects: read_json() limits them, and io::Json looks each
    // up among all.
    const auto json = nlohmann::json::parse(text, nullptr, false);
    if (!json.is_object()) return "its manifest is not a JSON object";
    for (const auto& [name, value] : json.items()) {
        const auto hash = value.is_string() ? hex_number(value.get<std::string>()) : std::nullopt;
        if (!hash) {
            to.manifest.clear();
            return concat("its manifest has no hash of 8 digits for ", quoted(name));
        }
        to.manifest[name] = id_of_hash(*hash);
    }
    return to.manifest.empty() ? "its manifest is empty" : "";
}

// Path of a file in or below the frame's folder, as the specification demands: a frame must not
// make the program read elsewhere. Empty if the name leads outside.
std::string manifest_file(const std::string& frame, const std::string& name) {
    const fs::path relative(name);
    const bool leaves = std::any_of(relative.begin(), relative.end(),
                                    [](const fs::path& word) { return word == ".."; });
    if (relative.is_absolute() || leaves || name.empty()) return "";
    return (fs::path(frame).parent_path() / relative).string();
}

std::string take_manifest_file(const std::string& name, const PathCheck& check, Cryptomatte& to) {
    fs::path path = to.manifest_file;
    if (path.empty())
        return concat("its manifest file ", quoted(name), " is not in the frame's folder");
    if (check) {
        auto allowed = check(path.string());
        if (!allowed.ok()) return concat("its manifest file: ", allowed.status().message());
        path = std::move(*allowed);
    }
    const ReadableFile file(path.string());
    if (!file.ok() && (file.error() == ENOENT || file.error() == ENOTDIR))
        return concat("its manifest file ", path.string(), " does not exist");
    if (!file.ok()) return concat("its manifest file ", path.string(), " ", file.fault());
    if (file.bytes() > kMaxManifest)
        return concat("its manifest file ", path.string(), " is larger than 64 MiB");
    const auto text = file.text(kMaxManifest);
    if (!text) return concat("its manifest file ", path.string(), " cannot be read");
    const std::string why = take_manifest(*text, to);
    return why.empty() ? why : concat(path.string(), ": ", why);
}

// Reads the manifest from a cryptomatte's attributes, or from the file that they name.
std::string find_manifest(const std::map<std::string, std::string>& attributes,
                          const PathCheck& check, Cryptomatte& to) {
    if (const auto text = attributes.find("manifest"); text != attributes.end())
        return take_manifest(text->second, to);
    if (const auto name = attributes.find("manif_file"); name != attributes.end())
        return take_manifest_file(name->second, check, to);
    return "it has no manifest";
}

bool is_in(const ExrPart& part, const CryptoView& view) {
    return view.name.empty() || part.view.empty() || part.view == view.name;
}

// The four channels of a level, which is a layer of a part or a separate part.
std::optional<CryptoLevel> level_of(const std::vector<ExrPart>& parts, const std::string& name,
                                    int number, const CryptoView& view) {
    const std::string layer = concat(name, number < 10 ? "0" : "", number);
    constexpr std::array<std::array<const char*, 4>, 3> kWords = {
        {{"r", "g", "b", "a"}, {"R", "G", "B", "A"}, {"red", "green", "blue", "alpha"}}};
    for (size_t part = 0; part < parts.size(); ++part) {
        const ExrPart& info = parts[part];
        if (!is_in(info, view)) continue;
        const std::string in_view = layer + "." + view.name;
        std::vector<std::string> prefixes;
        if (!view.name.empty()) prefixes.push_back(in_view + ".");
        if (view.name.empty() || view.is_default || info.view == view.name) {
            prefixes.push_back(layer + ".");
            if (info.name == layer || info.name == in_view) prefixes.push_back("");
        }
        for (const std::string& prefix : prefixes) {
            for (const auto& words : kWords) {
                CryptoLevel level{int(part), {}};
                bool all = true;
                for (size_t c = 0; c < words.size(); ++c) {
                    level.channels[c] = prefix + words[c];
                    all = all && info.find(level.channels[c]) != nullptr;
                }
                if (all) return level;
            }
        }
    }
    return {};
}

void find_levels(const PixelFile& file, const CryptoView& view, Cryptomatte& cryptomatte) {
    for (int number = 0; number < 100; ++number) {
        auto level = level_of(file.parts(), cryptomatte.name, number, view);
        if (!level) break;
        cryptomatte.levels.push_back(std::move(*level));
    }
}

Status check_levels(const PixelFile& file, const Cryptomatte& cryptomatte) {
    for (const CryptoLevel& level : cryptomatte.levels) {
        const std::vector<std::string> names(level.channels.begin(), level.channels.end());
        RETURN_IF_ERROR(file.check_channels(level.part, names));
        for (const std::string& name : names)
            if (const auto type = file.parts()[size_t(level.part)].find(name)->type;
                type != PixelType::float32)
                return fault(file, cryptomatte,
                             concat("channel ", name, " is ", name_of(type),
                                    ", and ids are the bits of floats; write it as float"));
    }
    if (cryptomatte.levels.empty())
        return fault(file, cryptomatte,
                     concat("its channels ", cryptomatte.name, "00.r, .g, .b, .a are missing"));
    const auto window = [&](const CryptoLevel& level) {
        return file.parts()[size_t(level.part)].data_window;
    };
    for (const CryptoLevel& level : cryptomatte.levels)
        if (window(level) != window(cryptomatte.levels[0]))
            return fault(file, cryptomatte, "its ranks are of parts of different size");
    return Status();
}

// "1234567" of "cryptomatte/1234567/name"; empty for other attributes.
std::string key_of(const std::string& attribute) {
    const size_t slash = attribute.rfind('/');
    if (!attribute.starts_with(kPrefix) || slash < kPrefix.size()) return "";
    return attribute.substr(kPrefix.size(), slash - kPrefix.size());
}

}  // namespace

uint32_t murmur_hash(std::string_view text) {
    const auto byte = [&](size_t at) { return uint32_t(uint8_t(text[at])); };
    const auto mixed = [](uint32_t block) {
        return std::rotl(block * 0xcc9e2d51u, 15) * 0x1b873593u;
    };
    uint32_t hash = 0;
    const size_t whole = text.size() / 4 * 4;
    for (size_t at = 0; at < whole; at += 4) {
        const uint32_t block =
            byte(at) | byte(at + 1) << 8 | byte(at + 2) << 16 | byte(at + 3) << 24;
        hash = std::rotl(hash ^ mixed(block), 13) * 5 + 0xe6546b64u;
    }
    uint32_t rest = 0;
    for (size_t at = text.size(); at > whole; --at) rest = rest << 8 | byte(at - 1);
    if (text.size() > whole) hash ^= mixed(rest);
    hash ^= uint32_t(text.size());
    hash = (hash ^ hash >> 16) * 0x85ebca6bu;
    hash = (hash ^ hash >> 13) * 0xc2b2ae35u;
    return hash ^ hash >> 16;
}

CryptoId id_of_hash(uint32_t hash) {
    const uint32_t exponent = hash >> 23 & 255;
    return exponent == 0 || exponent == 255 ? hash ^ 1u << 23 : hash;
}

CryptoId id_of_name(std::string_view name) {
    return id_of_hash(murmur_hash(name));
}

std::string Cryptomatte::short_name() const {
    return name.substr(name.rfind('.') + 1);
}

bool Cryptomatte::holds(int part, std::string_view channel) const {
    return std::any_of(levels.begin(), levels.end(), [&](const CryptoLevel& level) {
        return level.part == part && std::find(level.channels.begin(), level.channels.end(),
                                               channel) != level.channels.end();
    });
}

Result<std::vector<Cryptomatte>> find_cryptomattes(const PixelFile& file, Manifests manifests,
                                                   const PathCheck& check,
                                                   const CryptoView& view) try {
    // By name, since each part of a file may repeat the attributes.
    std::map<std::string, std::map<std::string, std::string>> found;
    for (const ExrPart& part : file.parts()) {
        if (!is_in(part, view)) continue;
        std::map<std::string, std::map<std::string, std::string>> keys;
        for (const auto& [name, value] : part.attributes) {
            const std::string key = key_of(name);
            if (!key.empty()) keys[key][name.substr(name.rfind('/') + 1)] = value;
        }
        for (auto& [key, own] : keys)
            if (own.contains("name")) {
                own["key"] = key;
                found[own.at("name")].merge(own);
            }
    }
    std::vector<Cryptomatte> all;
    for (const auto& entry : found) {
        const auto& own = entry.second;
        Cryptomatte cryptomatte;
        cryptomatte.key = own.at("key");
        cryptomatte.name = entry.first;
        const auto stated = [&](const char* what, const char* only) {
            const auto it = own.find(what);
            if (it == own.end() || it->second == only) return Status();
            return fault(
                file, cryptomatte,
                concat("its ", what, " is ", quoted(it->second), ", and only ", only, " is known"));
        };
        find_levels(file, view, cryptomatte);
        cryptomatte.fault = stated("hash", "MurmurHash3_32");
        if (cryptomatte.fault.ok()) cryptomatte.fault = stated("conversion", "uint32_to_float32");
        if (cryptomatte.fault.ok()) cryptomatte.fault = check_levels(file, cryptomatte);
        if (const auto named = own.find("manif_file"); named != own.end() && !own.count("manifest"))
            cryptomatte.manifest_file = manifest_file(file.path(), named->second);
        if (manifests == Manifests::read)
            cryptomatte.no_manifest = find_manifest(own, check, cryptomatte);
        all.push_back(std::move(cryptomatte));
    }
    return all;
} catch (...) {
    return status_of_exception(file.path());
}

std::vector<std::string> attributes_without_ranks(const ExrPart& part,
                                                  const std::vector<ExrPart>& parts,
                                                  const ExrSettings& written) {
    std::vector<ExrPart> left;
    for (const ExrPart& one : parts) {
        ExrPart& to = left.emplace_back();
        to.name = one.name;
        for (const ExrChannel& channel : one.channels)
            if (written.takes(channel.name)) to.channels.push_back(channel);
    }
    std::vector<std::string> lost;
    for (const auto& [attribute, value] : part.attributes) {
        const std::string key = key_of(attribute);
        const auto name = part.attributes.find(concat(kPrefix, key, "/name"));
        if (key.empty() || name == part.attributes.end()) continue;
        if (level_of(parts, name->second, 0, {}) && !level_of(left, name->second, 0, {}))
            lost.push_back(attribute);
    }
    return lost;
}

// Filters of renderers overshoot a little; more is no coverage.
constexpr float kMaxCoverage = 1.5f;

RankedCoverage::RankedCoverage(int w, int h, int r)
    : width(w),
      height(h),
      ranks(r),
      ids(size_t(w) * size_t(h) * size_t(r)),
      coverages(ids.size()) {}

Result<RankedCoverage> read_ranks(PixelFile& file, const Cryptomatte& cryptomatte,
                                  const Window& area) try {
    RankedCoverage all(area.width(), area.height(), cryptomatte.ranks());
    for (size_t level = 0; level < cryptomatte.levels.size(); ++level) {
        const auto& source = cryptomatte.levels[level];
        const std::vector<std::string> names(source.channels.begin(), source.channels.end());
        ASSIGN_OR_RETURN(const auto pixels, file.read_part(source.part, names, area));
        const ImageF values = pixels.interleaved(names, area);
        for (size_t pixel = 0; pixel < values.pixels(); ++pixel) {
            const float* value = values.data.data() + 4 * pixel;
            const size_t to = pixel * size_t(all.ranks) + 2 * level;
            for (size_t i = 0; i < 2; ++i) {
                const float id = value[2 * i], coverage = value[2 * i + 1];
                if (!std::isfinite(id) || !(std::abs(coverage) <= kMaxCoverage)) {
                    ++all.faulty;
                    continue;
                }
                all.ids[to + i] = std::bit_cast<CryptoId>(id);
                all.coverages[to + i] = coverage;
            }
        }
    }
    return all;
} catch (...) {
    return status_of_exception(file.path());
}

ImageF coverage_of(const RankedCoverage& ranks, const std::vector<CryptoId>& ids) {
    ImageF matte(ranks.width, ranks.height, 1);
    const size_t count = size_t(ranks.ranks);
    for (size_t i = 0; i < ranks.ids.size(); ++i)
        if (ranks.coverages[i] > 0 && std::binary_search(ids.begin(), ids.end(), ranks.ids[i]))
            matte.data[i / count] += ranks.coverages[i];
    return matte;
}

void Reranking::add(CryptoId id, const ImageF& coverage, int channel, const Window& area,
                    int first_row) {
    for (int y = area.min_y; y <= area.max_y; ++y)
        for (int x = area.min_x; x <= area.max_x; ++x)
            if (const float value = coverage.at(x, first_row + y, channel); value > 0)
                insert(size_t(y) * size_t(result_.width) + size_t(x), id, value);
}

void Reranking::insert(size_t pixel, CryptoId id, float value) {
    const size_t ranks = size_t(result_.ranks);
    CryptoId* ids = result_.ids.data() + pixel * ranks;
    float* values = result_.coverages.data() + pixel * ranks;
    size_t place = 0;
    while (place < ranks && (values[place] > value || (values[place] == value && ids[place] < id)))
        ++place;
    // The last one loses its rank.
    float lost = value;
    if (place < ranks) {
        lost = values[ranks - 1];
        std::move_backward(ids + place, ids + ranks - 1, ids + ranks);
        std::move_backward(values + place, values + ranks - 1, values + ranks);
        ids[place] = id;
        values[place] = value;
    }
    if (lost <= 0) return;
    if (short_.empty()) short_.resize(result_.pixels());
    short_[pixel] = true;
    largest_lost_ = std::max(largest_lost_, lost);
}

uint64_t Reranking::pixels_short() const {
    return uint64_t(std::count(short_.begin(), short_.end(), true));
}

}  // namespace postchain::io
