// postchain-programs: writes the programs of chains, as one set for pc_vk_create_info.programs
// (docs/vulkan.md), or as files for an engine's own device (docs/programs.md).
#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "chain/guest/chain_handle.h"
#include "chain/guest/frame_check.h"
#include "chain/guest/host_plan.h"
#include "chain/guest/presets.h"
#include "chain/plan/program_source.h"
#include "chain/vk/compiler.h"
#include "chain/vk/format.h"
#include "chain/vk/program_set.h"
#ifdef POSTCHAIN_CHAIN_FILES
#include "config/chain_find.h"
#endif
#include "tools/apps/programs/program_files.h"

namespace {

using namespace postchain;
using namespace programs;

constexpr const char* kUsage =
    R"(postchain-programs [OPTIONS] [CHAIN...] >FILE
postchain-programs --format FORMAT --output FOLDER [OPTIONS] [CHAIN...]

Writes the programs of the chains: to the standard output as one set of SPIR-V,
for pc_vk_create_info.programs, or to the folder, a file for each program, and
index.json, which says how to run them. FORMAT: spirv, hlsl, msl or glsl.
CHAIN: tier:NAME, a list of passes as for pc_chain_create(), a shipped chain or a
chain file; default: every tier.
Programs of frames with and without PC_HALF_PLANES are written; options add:
  --mask             frames with a mask
  --exposure         frames with an exposure
  --before           frames with the frame before
  --after            frames with the frame after
  --half-resolution  frames with PC_HALF_RESOLUTION
  --fast-math        frames with PC_FAST_MATH
)";

constexpr std::string_view kTier = "tier:";

// A kind of frame: the flags and optional members that it has.
struct Kind {
    uint32_t flags = 0;
    bool mask = false, exposure = false, before = false, after = false;
};

Status add(const Chain& chain, const Kind& kind, Programs& programs) {
    pc_frame values = {};
    values.struct_size = sizeof(values);
    values.flags = PC_TOP_LEFT | kind.flags;
    values.near_clip = 0.1f;
    values.depth_encoding = PC_DEPTH_REVERSE_INFINITE;
    values.focal_length_mm = 50;
    values.sensor_width_mm = 36;
    values.f_stop = 2;
    values.focus_distance = 4;
    constexpr int kWidth = 1920, kHeight = 1080;
    values.color = {1, VK_FORMAT_R16G16B16A16_SFLOAT, kWidth, kHeight, 0, 0};
    values.depth = {2, VK_FORMAT_D32_SFLOAT, kWidth, kHeight, 0, 0};
    values.motion = {3, VK_FORMAT_R16G16_SFLOAT, kWidth, kHeight, 0, 0};
    if (kind.mask) values.mask = {4, VK_FORMAT_R8_UNORM, kWidth, kHeight, 0, 0};
    if (kind.exposure) values.exposure = {5, VK_FORMAT_R32_SFLOAT, 1, 1, 0, 0};
    const pc_frame neighbor = values;
    std::array<pc_frame, kNeighbors.size()> neighbors;
    guest::set_neighbors(
        values, {kind.before ? &neighbor : nullptr, kind.after ? &neighbor : nullptr}, neighbors);
    values.output = {6, VK_FORMAT_R16G16B16A16_SFLOAT, kWidth, kHeight, 0, 0};
    guest::HostFrame frame;
    if (const auto failure = guest::check_frame(&values, frame, vk::find_format); !failure.ok())
        return Status(StatusCode::internal, failure.text);
    // A chain that can focus at a place may do so.
    if (std::ranges::any_of(chain.links, [](const ChainLink& link) {
            return link.type->parameters->find("focus_at") != nullptr;
        }))
        frame.focus_slot = 0;
    ASSIGN_OR_RETURN(const auto host, guest::make_host_plan(chain, frame, DeviceClass::gpu));
    for (const ProgramKey& key : guest::host_programs(chain, frame, host.plan, DeviceClass::gpu)) {
        ASSIGN_OR_RETURN(auto source, program_source(key));
        Program& program = programs[program_key(source)];
        if (!program.words.empty()) continue;
        ASSIGN_OR_RETURN(program.words, vk::compile(source, key.text()));
        program.key = key;
        program.source = std::move(source);
    }
    return Status();
}

Result<Chain> chain_of(const std::string& name) {
    if (name.starts_with(kTier))
        return guest::make_tier(name.substr(kTier.size()), guest::passes());
#ifdef POSTCHAIN_CHAIN_FILES
    if (embedded_chain(name) || name.find_first_of("./") != std::string::npos) {
        ASSIGN_OR_RETURN(auto file, load_chain(name, guest::passes()));
        RETURN_IF_ERROR(file.status());
        return std::move(file.chain);
    }
#endif
    return guest::ChainHandle::parse(name);
}

// Adds each kind once more, changed.
template <class Change>
void add_kinds(std::vector<Kind>& kinds, Change change) {
    for (size_t i = 0, count = kinds.size(); i < count; ++i) {
        Kind kind = kinds[i];
        change(kind);
        kinds.push_back(kind);
    }
}

int fail(const std::string& text, int code) {
    std::fprintf(stderr, "postchain-programs: %s\n", as_options(text).c_str());
    return code;
}

// The names of languages that this build writes, or of all.
std::string names_of_languages(bool built) {
    std::string names;
    for (const Language language : {Language::spirv, Language::hlsl, Language::msl, Language::glsl})
        if (!built || is_built(language))
            names += concat(names.empty() ? "" : ", ", facts_of(language).name);
    return names;
}

std::optional<Language> language_of(std::string_view name) {
    for (const Language language : {Language::spirv, Language::hlsl, Language::msl, Language::glsl})
        if (facts_of(language).name == name) return language;
    return std::nullopt;
}

int write_set(const Programs& programs) {
    std::map<uint64_t, std::vector<uint32_t>> words;
    for (const auto& [number, program] : programs) words[number] = program.words;
    const std::vector<std::byte> bytes = vk::ProgramSet::write(words);
    if (std::fwrite(bytes.data(), 1, bytes.size(), stdout) != bytes.size() ||
        std::fflush(stdout) != 0)
        return fail("the standard output cannot be written", 5);
    std::fprintf(stderr, "%zu programs, %zu bytes\n", programs.size(), bytes.size());
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    std::vector<Kind> kinds = {{}, {PC_HALF_PLANES}};
    std::vector<std::string> names;
    std::string folder;
    std::optional<Language> language;
    for (int i = 1; i < argc; ++i) {
        const std::string_view word = argv[i];
        if (word == "--help" || word == "-h") return std::fputs(kUsage, stdout), 0;
        if (word == "--mask")
            add_kinds(kinds, [](Kind& kind) { kind.mask = true; });
        else if (word == "--exposure")
            add_kinds(kinds, [](Kind& kind) { kind.exposure = true; });
        else if (word == "--before")
            add_kinds(kinds, [](Kind& kind) { kind.before = true; });
        else if (word == "--after")
            add_kinds(kinds, [](Kind& kind) { kind.after = true; });
        else if (word == "--half-resolution")
            add_kinds(kinds, [](Kind& kind) { kind.flags |= PC_HALF_RESOLUTION; });
        else if (word == "--fast-math")
            add_kinds(kinds, [](Kind& kind) { kind.flags |= PC_FAST_MATH; });
        else if (word == "--format" || word == "--output") {
            const std::string_view value = i + 1 < argc ? argv[++i] : "";
            if (value.empty()) return fail(concat(word, " needs a value"), 2);
            if (word == "--output") {
                folder = value;
                continue;
            }
            language = language_of(value);
            if (!language)
                return fail(
                    concat("unknown format ", value, "; known are ", names_of_languages(false)), 2);
            if (!is_built(*language))
                return fail(
                    concat("this build has no ", value, ": SPIRV-Cross was not found; it has ",
                           names_of_languages(true)),
                    2);
        } else if (word.starts_with("-"))
            return fail(concat("unknown option ", word, "; --help lists them"), 2);
        else
            names.emplace_back(word);
    }
    if (language.has_value() == folder.empty())
        return fail("--format and --output go together; without both, a set is written", 2);
    if (names.empty())
        for (const guest::Tier& tier : guest::tiers()) names.push_back(concat(kTier, tier.name));
    Programs programs;
    for (const std::string& name : names) {
        const auto chain = chain_of(name);
        if (!chain.ok()) return fail(chain.status().message(), 2);
        // As pc_chain_create() does: passes without a matte have the mask.
        const guest::ChainHandle handle(chain->clone());
        for (const Kind& kind : kinds)
            if (const Status s = add(*handle.version().chain, kind, programs); !s.ok())
                return fail(concat(name, ": ", s.message()), 1);
    }
    if (!language) return write_set(programs);
    std::signal(SIGXFSZ, SIG_IGN);  // as AtomicFile demands
    const auto written = write_files(programs, *language, folder);
    if (!written.ok())
        return fail(written.status().message(),
                    written.status().code() == StatusCode::output ? 5 : 1);
    std::fprintf(stderr, "%zu programs, %zu bytes\n", written->files, written->bytes);
    return 0;
}
