#include "tools/apps/programs/program_files.h"

#include <algorithm>
#include <filesystem>
#include <string_view>

#include "chain/base/json.h"
#include "chain/vk/compiler.h"
#include "tools/sequence/files/output_files.h"

namespace postchain::programs {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMark = ".postchain-programs";
constexpr const char* kIndex = "index.json";
constexpr uint32_t kLeastSharedBytes = 16384;  // of a work group that every device with Metal has

// One with its text and what the index says of it.
struct Translated {
    std::string text;
    std::string shader_model;  // of HLSL: the least
    Interface interface;
};

Result<Translated> translated(const Program& program, Language language) {
    Translated out;
    auto words = program.words;
    if (language == Language::hlsl || language == Language::msl) {
        ASSIGN_OR_RETURN(words, vk::compile(without_samplers(program.source), program.key.text()));
    }
    ASSIGN_OR_RETURN(const auto spirv, vk::with_units(std::move(words)));
    ASSIGN_OR_RETURN(out.interface, interface_of(spirv));
    if (language == Language::spirv)
        out.text.assign(reinterpret_cast<const char*>(spirv.words.data()), 4 * spirv.words.size());
    else if (language == Language::glsl)
        out.text = program.source;
    else {
        ASSIGN_OR_RETURN(auto text, translate(spirv, out.interface, language));
        out.text = std::move(text.text);
        out.shader_model = text.shader_model;
    }
    return out;
}

std::string type_of(const ProgramUnit& unit, Language language) {
    const bool list = unit.unit.kind == vk::Kind::list;
    const bool image = unit.unit.kind == vk::Kind::image;
    const char* array = unit.array ? "Array" : "";
    if (language == Language::hlsl) {
        if (list) return unit.writes ? "RWByteAddressBuffer" : "ByteAddressBuffer";
        return concat(image ? "RW" : "", "Texture2D", array, unit.integer ? "<uint4>" : "<float4>");
    }
    if (language == Language::msl) {
        if (list) return unit.writes ? "device" : "const device";
        return concat("texture2d", unit.array ? "_array" : "", unit.integer ? "<uint" : "<float",
                      !image        ? ""
                      : unit.writes ? ", access::write"
                                    : ", access::read",
                      ">");
    }
    if (list) return "buffer";
    return concat(unit.integer ? "u" : "", image ? "image2D" : "sampler2D", array);
}

const char* access_of(const ProgramUnit& unit) {
    return !unit.writes ? "read" : !unit.reads ? "write" : "read_write";
}

// Adds where a host binds it.
void add_place(JsonObject& json, Language language, const Place& place) {
    switch (language) {
        case Language::hlsl:
            json.push_back({"register", place.text});
            json.push_back({"space", 0});
            break;
        case Language::msl:
            json.push_back({"argument", place.text});
            break;
        case Language::spirv:
            json.push_back({"set", 0});
            [[fallthrough]];
        case Language::glsl:
            json.push_back({"binding", place.number});
    }
}

JsonArray units_json(const Interface& interface, Language language) {
    static constexpr const char* kKinds[] = {"texture", "image", "list"};
    JsonArray units;
    for (const ProgramUnit& unit : interface.units) {
        JsonObject json = {{"kind", kKinds[size_t(unit.unit.kind)]},
                           {"unit", unit.unit.number},
                           {"name", unit.name},
                           {"type", type_of(unit, language)},
                           {"access", access_of(unit)}};
        add_place(json, language, place_of(unit, language));
        units.push_back(std::move(json));
    }
    return units;
}

JsonValue uniforms_json(const Block& block, Language language) {
    if (block.id == 0) return {};
    JsonArray members;
    for (const BlockMember& member : block.members) {
        JsonObject json = {{"name", member.name}, {"type", member.type}, {"offset", member.offset}};
        if (member.count != 0) {
            json.push_back({"count", member.count});
            json.push_back({"stride", member.stride});
        }
        members.push_back(std::move(json));
    }
    JsonObject json = {{"name", block.name}, {"bytes", block.bytes}};
    const Place place = {language == Language::hlsl ? "b0" : "buffer(0)",
                         language == Language::spirv ? vk::binding_of(vk::Kind::uniforms, 0) : 0};
    add_place(json, language, place);
    json.push_back({"members", std::move(members)});
    return json;
}

// The first work group of a band, two uint.
JsonValue first_group_json(const Interface& interface, Language language) {
    if (!interface.first_group) return {};
    JsonObject json = {{"type", "uvec2"}, {"bytes", 8}};
    if (language == Language::hlsl || language == Language::msl)
        add_place(json, language, {language == Language::hlsl ? "b1" : "buffer(1)"});
    else
        json.push_back({"push_constant_offset", 0});
    // Without VULKAN, which compilers for it define.
    if (language == Language::glsl) json.push_back({"uniform_location", 0});
    return json;
}

// Needs of this program beyond the least that its interface promises, and what the
// language says otherwise than GLSL.
std::vector<std::string> notes_of(const Interface& interface, Language language) {
    std::vector<std::string> notes;
    for (const ProgramUnit& unit : interface.units)
        if (language == Language::hlsl && unit.unit.kind == vk::Kind::image && unit.reads)
            notes.push_back(concat("typed load of one uint from ", place_of(unit, language).text));
    if (language == Language::msl) {
        if (interface.precise != 0)
            notes.push_back(concat(interface.precise,
                                   " precise operations are calls of fma(), in which a product of "
                                   "-0 is +0"));
        if (interface.shared_bytes > kLeastSharedBytes)
            notes.push_back("more than 16384 bytes of threadgroup memory");
    }
    return notes;
}

JsonObject entry_of(uint64_t number, const Program& program, const Translated& translated,
                    Language language) {
    const LanguageFacts& facts = facts_of(language);
    const Interface& interface = translated.interface;
    JsonObject defines;
    for (const auto& [name, value] : program.key.defines) defines.push_back({name, value});
    const auto& group = interface.group_size;
    JsonObject json = {{"key", hex_of(number)},
                       {"file", concat(hex_of(number), facts.ending)},
                       {"name", program.key.text()},
                       {"shader", program.key.file},
                       {"defines", std::move(defines)},
                       {"entry", std::string(facts.entry)},
                       {"group_size", JsonArray{group[0], group[1], group[2]}},
                       {"shared_bytes", interface.shared_bytes},
                       {"precise", interface.precise},
                       {"units", units_json(interface, language)},
                       {"uniforms", uniforms_json(interface.uniforms, language)},
                       {"first_group", first_group_json(interface, language)}};
    if (!translated.shader_model.empty()) json.push_back({"shader_model", translated.shader_model});
    json.push_back({"notes", notes_of(interface, language)});
    return json;
}

// Whether a file of this name is one of a program, in any language.
bool is_program(const std::string& name) {
    constexpr size_t kDigits = 16;
    if (name.find_first_not_of("0123456789abcdef") != kDigits) return false;
    const std::string_view ending = std::string_view(name).substr(kDigits);
    for (const Language language : {Language::spirv, Language::hlsl, Language::msl, Language::glsl})
        if (ending == facts_of(language).ending) return true;
    return false;
}

}  // namespace

Result<FilesWritten> write_files(const Programs& programs, Language language,
                                 const std::string& folder) {
    std::map<std::string, std::string> texts;  // by name
    JsonArray entries;
    for (const auto& [number, program] : programs) {
        auto one = translated(program, language);
        if (!one.ok()) return one.status().at(program.key.text());
        entries.push_back(entry_of(number, program, *one, language));
        texts[concat(hex_of(number), facts_of(language).ending)] = std::move(one->text);
    }
    const JsonObject index = {{"postchain", POSTCHAIN_VERSION},
                              {"language", std::string(facts_of(language).name)},
                              {"programs", std::move(entries)}};

    io::OutputFiles files(io::OnExisting::overwrite);
    files.write(io::OutputFolder{folder, "a folder of programs", kMark,
                                 "This folder has programs of postchain.\n",
                                 "name another with --output"});
    const auto path_of = [&](const std::string& name) { return folder + "/" + name; };
    const std::string remedy = "name another folder with --output";
    for (const auto& [name, text] : texts)
        files.write(io::OutputFile{path_of(name), "a program", remedy});
    files.write(io::OutputFile{path_of(kIndex), "the index", remedy});
    RETURN_IF_ERROR(files.check());
    files.remove_left_temporaries();
    RETURN_IF_ERROR(files.make_folders());
    FilesWritten written;
    for (const auto& [name, text] : texts) {
        RETURN_IF_ERROR(files.put(path_of(name), text));
        ++written.files;
        written.bytes += text.size();
    }
    RETURN_IF_ERROR(files.put(path_of(kIndex), json_text(index, true) + "\n"));
    std::error_code error;
    for (const auto& left : fs::directory_iterator(folder, error)) {
        const std::string name = left.path().filename();
        if (is_program(name) && !texts.contains(name)) fs::remove(left.path(), error);
    }
    return written;
}

}  // namespace postchain::programs
