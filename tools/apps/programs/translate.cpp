#include "tools/apps/programs/translate.h"

#include <memory>

#ifdef POSTCHAIN_SPIRV_CROSS
#include <spirv_cross_c.h>
#endif

namespace postchain::programs {
namespace {

#ifdef POSTCHAIN_SPIRV_CROSS
constexpr bool kHasSpirvCross = true;
#else
constexpr bool kHasSpirvCross = false;
#endif

constexpr uint32_t kFirstListRegister = 16;  // HLSL
constexpr uint32_t kFirstImageTexture = 16;  // MSL
constexpr uint32_t kFirstListBuffer = 2;     // MSL
constexpr uint32_t kFirstGroupPlace = 1;     // b1, buffer(1)

}  // namespace

const LanguageFacts& facts_of(Language language) {
    static constexpr LanguageFacts kFacts[] = {{"spirv", ".spv", "main"},
                                               {"hlsl", ".hlsl", "main"},
                                               {"msl", ".metal", "main0"},
                                               {"glsl", ".comp", "main"}};
    return kFacts[size_t(language)];
}

bool is_built(Language language) {
    return kHasSpirvCross || language == Language::spirv || language == Language::glsl;
}

std::string without_samplers(const std::string& source) {
    const size_t end = source.find('\n');  // #version comes first
    std::string out =
        source.substr(0, end + 1) + "#extension GL_EXT_samplerless_texture_functions : require\n";
    for (const char* type : {"2D", "2DArray"})
        for (const char* component : {"", "u"})
            out += concat("#define ", component, "sampler", type, " ", component, "texture", type,
                          "\n");
    return out + source.substr(end + 1);
}

Place place_of(const ProgramUnit& unit, Language language) {
    const uint32_t n = unit.unit.number;
    const bool list = unit.unit.kind == vk::Kind::list;
    const bool image = unit.unit.kind == vk::Kind::image;
    if (language == Language::hlsl) {
        const uint32_t number = list ? kFirstListRegister + n : n;
        return {concat(unit.writes || image ? "u" : "t", number), number};
    }
    if (language == Language::msl) {
        const uint32_t number = list ? kFirstListBuffer + n : image ? kFirstImageTexture + n : n;
        return {concat(list ? "buffer(" : "texture(", number, ")"), number};
    }
    return {"", language == Language::spirv ? vk::binding_of(unit.unit.kind, n) : n};
}

#ifdef POSTCHAIN_SPIRV_CROSS
namespace {

struct Destroy {
    void operator()(spvc_context context) const { spvc_context_destroy(context); }
};

// `version` is of the language, as SPIRV-Cross counts it.
Result<std::string> translate(const std::vector<uint32_t>& words, const Interface& interface,
                              Language language, unsigned version) {
    const bool metal = language == Language::msl;
    spvc_context made = nullptr;
    if (spvc_context_create(&made) != SPVC_SUCCESS) return out_of_memory("SPIRV-Cross");
    const std::unique_ptr<spvc_context_s, Destroy> context(made);
    const auto fault = [&] {
        return Status(StatusCode::internal,
                      concat("SPIRV-Cross: ", spvc_context_get_last_error_string(context.get())));
    };
#define CHECK(call) \
    if ((call) != SPVC_SUCCESS) return fault()
    spvc_parsed_ir parsed = nullptr;
    CHECK(spvc_context_parse_spirv(context.get(), words.data(), words.size(), &parsed));
    spvc_compiler compiler = nullptr;
    CHECK(spvc_context_create_compiler(context.get(), metal ? SPVC_BACKEND_MSL : SPVC_BACKEND_HLSL,
                                       parsed, SPVC_CAPTURE_MODE_TAKE_OWNERSHIP, &compiler));
    spvc_set used = nullptr;
    CHECK(spvc_compiler_get_active_interface_variables(compiler, &used));
    CHECK(spvc_compiler_set_enabled_interface_variables(compiler, used));

    const auto bind = [&](unsigned set, unsigned binding, uint32_t number, bool is_texture) {
        spvc_msl_resource_binding place;
        spvc_msl_resource_binding_init(&place);
        place.stage = SpvExecutionModelGLCompute;
        place.desc_set = set;
        place.binding = binding;
        (is_texture ? place.msl_texture : place.msl_buffer) = number;
        return spvc_compiler_msl_add_resource_binding(compiler, &place);
    };
    std::vector<std::pair<uint32_t, Place>> places;  // by variable
    for (const ProgramUnit& unit : interface.units)
        places.emplace_back(unit.id, place_of(unit, language));
    if (interface.uniforms.id != 0) places.push_back({interface.uniforms.id, {}});
    for (const auto& [id, place] : places) {
        const bool is_texture = place.text.starts_with("texture");
        if (metal) {
            CHECK(bind(0, spvc_compiler_get_decoration(compiler, id, SpvDecorationBinding),
                       place.number, is_texture));
        } else {  // a variable's binding is its register
            spvc_compiler_set_decoration(compiler, id, SpvDecorationBinding, place.number);
        }
    }
    spvc_compiler_options options = nullptr;
    CHECK(spvc_compiler_create_compiler_options(compiler, &options));
    if (metal) {
        CHECK(bind(SPVC_MSL_PUSH_CONSTANT_DESC_SET, SPVC_MSL_PUSH_CONSTANT_BINDING,
                   kFirstGroupPlace, false));
    } else {
        constexpr spvc_hlsl_root_constants kFirstGroup = {0, 8, kFirstGroupPlace, 0};
        CHECK(spvc_compiler_hlsl_set_root_constants_layout(compiler, &kFirstGroup, 1));
    }
    CHECK(spvc_compiler_options_set_uint(
        options, metal ? SPVC_COMPILER_OPTION_MSL_VERSION : SPVC_COMPILER_OPTION_HLSL_SHADER_MODEL,
        version));
    CHECK(spvc_compiler_install_compiler_options(compiler, options));
    const char* text = nullptr;
    CHECK(spvc_compiler_compile(compiler, &text));
#undef CHECK
    return std::string(text);
}

}  // namespace

Result<Translation> translate(const vk::Spirv& spirv, const Interface& interface,
                              Language language) {
    if (language == Language::msl) {
        ASSIGN_OR_RETURN(auto text, translate(with_loads_before_atomics(spirv.words), interface,
                                              language, SPVC_MAKE_MSL_VERSION(2, 1, 0)));
        return Translation{std::move(text)};
    }
    if (auto text = translate(spirv.words, interface, language, 51); text.ok())
        return Translation{std::move(*text), "5.1"};
    ASSIGN_OR_RETURN(auto text, translate(spirv.words, interface, language, 60));
    return Translation{std::move(text), "6.0"};
}
#else
Result<Translation> translate(const vk::Spirv&, const Interface&, Language language) {
    return Status(StatusCode::internal,
                  concat("this build has no ", facts_of(language).name, ": it lacks SPIRV-Cross"));
}
#endif

}  // namespace postchain::programs
