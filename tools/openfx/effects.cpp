#include "tools/openfx/effects.h"

#include <algorithm>
#include <cmath>

#include "chain/base/text.h"
#include "config/chain_file.h"
#include "config/chain_find.h"
#include "passes/registry.h"
#include "tools/openfx/conventions.h"

namespace postchain::openfx {
namespace {

// The name of the switch of an optional row.
std::string switch_of(const std::string& key) {
    return "use_" + key;
}

// An integer that only some values may have is a choice between them.
bool is_choice(const Parameter& row) {
    return row.type == ParameterType::choice || !row.allowed.empty();
}
// So is an optional choice, which begins with "unset".
bool has_switch(const Parameter& row) {
    return row.optional && !is_choice(row) && row.type != ParameterType::text;
}

std::vector<std::string> options_of(const Parameter& row) {
    std::vector<std::string> options;
    if (row.optional) options.push_back("unset");
    for (const int64_t value : row.allowed) options.push_back(std::to_string(value));
    options.insert(options.end(), row.choices.begin(), row.choices.end());
    return options;
}

std::string label_of(const Parameter& row) {
    std::string label = row.key;
    std::replace(label.begin(), label.end(), '_', ' ');
    return label;
}

std::string hint_of(const Parameter& row) {
    std::string hint = row.full_help();
    if (!row.unit.empty()) hint += " [" + row.unit + "]";
    if (row.odd) hint += "; an even value counts as the next odd one";
    if (row.optional)
        hint += row.unset_means.empty() ? "; may be unset" : "; unset: " + row.unset_means;
    // A node has no options, and its clips no metadata.
    for (const std::string& from : {"{camera} or the file's metadata"_keyed, setting("camera")})
        if (const size_t at = hint.find(from); at != hint.npos)
            hint.replace(at, from.size(), kCameraFile);
    return hint;
}

// Defines parameters, in the group that was begun last, and lists them for the page.
class Definer {
  public:
    explicit Definer(Effect effect) {
        suites().effects->get_parameter_set(effect, &set_);
        const Properties host(suites().host);
        animates_booleans_ = host.integer(kHostAnimatesBooleans, 0, 0) != 0;
        animates_choices_ = host.integer(kHostAnimatesChoices, 0, 0) != 0;
    }
    void group(const char* name, const char* label, bool open) {
        group_.clear();
        const Properties properties = define(kTypeGroup, name, label, "");
        properties.set(kParamGroupOpen, int(open));
        group_ = name;
    }
    Properties boolean(const std::string& name, const std::string& label, const std::string& hint,
                       bool value) {
        const Properties properties = define(kTypeBoolean, name, label, hint);
        properties.set(kParamDefault, int(value));
        properties.set(kParamAnimates, int(animates_booleans_));
        return properties;
    }
    void choice(const std::string& name, const std::string& label, const std::string& hint,
                const std::vector<std::string>& options, int value) {
        const Properties properties = define(kTypeChoice, name, label, hint);
        for (size_t i = 0; i < options.size(); ++i)
            properties.set(kParamChoiceOption, options[i], int(i));
        properties.set(kParamDefault, value);
        properties.set(kParamAnimates, int(animates_choices_));
    }
    Properties text(const std::string& name, const std::string& label, const std::string& hint,
                    const char* mode) {
        const Properties properties = define(kTypeString, name, label, hint);
        properties.set(kParamDefault, "");
        if (mode) properties.set(kParamStringMode, mode);
        properties.set(kParamAnimates, 0);
        return properties;
    }
    void pair(const std::string& name, const std::string& label, const std::string& hint,
              double value) {
        const Properties properties = define(kTypeDouble2D, name, label, hint);
        properties.set(kParamDefault, {value, value});
    }
    // Hosts show it as a point on the picture.
    void position(const std::string& name, const std::string& label, const std::string& hint) {
        const Properties properties = define(kTypeDouble2D, name, label, hint);
        properties.set(kParamDoubleType, kDoubleTypePosition);
        properties.set(kParamCoordinates, kCoordinatesNormalized);
        properties.set(kParamDefault, {0.5, 0.5});
    }
    void button(const std::string& name, const std::string& label, const std::string& hint) {
        define(kTypePushButton, name, label, hint);
    }
    void row(const Parameter& row) {
        if (has_switch(row))
            boolean(switch_of(row.key), "set " + label_of(row), hint_of(row), false);
        if (is_choice(row)) return choice_row(row);
        switch (row.type) {
            case ParameterType::boolean:
                boolean(row.key, label_of(row), hint_of(row), std::get<bool>(row.default_value));
                break;
            case ParameterType::integer:
                integer_row(row);
                break;
            case ParameterType::number:
                number_row(row);
                break;
            case ParameterType::point:
                position(row.key, label_of(row), hint_of(row));
                break;
            default:
                text(row.key, label_of(row), hint_of(row), nullptr);
        }
    }
    void page() {
        const std::vector<std::string> children = std::move(names_);
        group_.clear();
        const Properties properties = define(kTypePage, "page", "postchain", "");
        for (size_t i = 0; i < children.size(); ++i)
            properties.set(kParamPageChild, children[i], int(i));
    }

  private:
    Properties define(const char* type, const std::string& name, const std::string& label,
                      const std::string& hint) {
        PropertySet set = nullptr;
        suites().parameters->define(set_, type, name.c_str(), &set);
        const Properties properties(set);
        properties.set(kPropLabel, label);
        if (!hint.empty()) properties.set(kParamHint, hint);
        if (!group_.empty()) properties.set(kParamParent, group_);
        names_.push_back(name);
        return properties;
    }
    void choice_row(const Parameter& row) {
        const std::vector<std::string> options = options_of(row);
        const auto value = std::find(options.begin(), options.end(), text_of(row.default_value));
        choice(row.key, label_of(row), hint_of(row), options,
               value == options.end() ? 0 : int(value - options.begin()));
    }
    // A row without a default shows this until it is switched on.
    static double first_value(const Parameter& row) {
        return std::clamp(1.0, row.soft_min, row.soft_max);
    }
    void integer_row(const Parameter& row) {
        const Properties properties = define(kTypeInteger, row.key, label_of(row), hint_of(row));
        const auto* value = std::get_if<int64_t>(&row.default_value);
        properties.set(kParamDefault, value ? int(*value) : int(first_value(row)));
        if (std::isfinite(row.min)) properties.set(kParamMin, int(row.min));
        if (std::isfinite(row.max)) properties.set(kParamMax, int(row.max));
        if (std::isfinite(row.soft_min)) properties.set(kParamDisplayMin, int(row.soft_min));
        if (std::isfinite(row.soft_max)) properties.set(kParamDisplayMax, int(row.soft_max));
    }
    void number_row(const Parameter& row) {
        const Properties properties = define(kTypeDouble, row.key, label_of(row), hint_of(row));
        const auto* value = std::get_if<double>(&row.default_value);
        properties.set(kParamDefault, value ? *value : first_value(row));
        if (std::isfinite(row.min)) properties.set(kParamMin, row.min);
        if (std::isfinite(row.max)) properties.set(kParamMax, row.max);
        if (std::isfinite(row.soft_min)) properties.set(kParamDisplayMin, row.soft_min);
        if (std::isfinite(row.soft_max)) properties.set(kParamDisplayMax, row.soft_max);
    }

    ParameterSet set_ = nullptr;
    std::string group_;
    std::vector<std::string> names_;
    bool animates_booleans_ = false, animates_choices_ = false;
};

const Parameter& matte_effect_row() {
    return *link_parameters().find(kMatteEffect);
}

void define_conventions(Definer& define, const EffectType& type) {
    define.group("conventions", "Channels", true);
    if (type.has(Clip::motion)) {
        std::vector<std::string> names;
        std::string help;
        for (const MotionMeaning& meaning : motion_meanings()) {
            names.push_back(meaning.name);
            help += (help.empty() ? "" : "; ") + meaning.name + ": " + meaning.help;
        }
        define.choice(kMotionMeaning, "motion meaning", "what the motion vectors are: " + help,
                      names, 0);
        define.choice(kMotionChannels, "motion channels",
                      "which channels of Motion hold the vectors to the next and to the previous "
                      "frame",
                      motion_channel_names(), 0);
        define.pair(kMotionScale, "motion scale",
                    "factors of the vectors; -1 turns the sign of an axis", 1);
    }
    if (type.has(Clip::depth)) {
        define.choice(kDepthMeaning, "depth meaning",
                      "linear: a distance in scene units; inverse: 1/distance, as Nuke's "
                      "ScanlineRender writes it; normalized: 0 at near_clip, 1 at far_clip, or "
                      "inverted; ray_distance: along the pixel's ray; others: values of a depth "
                      "buffer",
                      depth_meaning_names(), 0);
        define.choice(kDepthChannel, "depth channel", "the channel of Depth", channel_names(), 0);
    }
    if (type.has(Clip::matte)) {
        define.choice(kMatteChannel, "matte channel", "the channel of Matte", channel_names(), 3);
        define.row(matte_effect_row());
    }
    define.choice(kFrameSize, "frame size",
                  "the frame, to which lens and limits refer: the project's, also where Source is "
                  "cropped or has overscan, or all of Source",
                  {"project", "source"}, 0);
    define.boolean(kCut, "camera cut", "a camera cut follows this frame", false)
        .set(kParamCacheInvalidation, kInvalidateAll);
}

void define_camera(Definer& define, const EffectType& type) {
    define.group("camera", "Camera", type.pass == nullptr);
    define
        .text(kCameraFile, "camera file",
              "camera.json or YAML with lens, focus, shutter and matrices by frame, as for the "
              "command's --camera; the values below replace its own",
              kStringIsFilePath)
        .set(kParamCacheInvalidation, kInvalidateAll);
    for (const Parameter* row : camera_rows(type)) define.row(*row);
}

void define_chain(Definer& define) {
    define.group("passes", "Chain", true);
    std::vector<std::string> names = chain_names();
    names.insert(names.begin(), "from chain_file");
    define.choice(kChain, "chain", "a shipped chain, or a chain file", names, 1);
    define.text(kChainFile, "chain file", "a chain file (YAML or JSON)", kStringIsFilePath);
    define.text(kOverrides, "overrides",
                "values that replace those of the chain, one a line: joint_blur.samples=64",
                kStringIsMultiLine);
    define.boolean(switch_of(kFocusAt), "set focus at", "focus at a place in the frame", false);
    define.position(kFocusAt, "focus at",
                    "the place whose surface is in focus, for every pass with a lens");
}

void define_clip(const EffectType& type, Effect effect, Clip clip) {
    PropertySet set = nullptr;
    suites().effects->define_clip(effect, kClipNames[size_t(clip)], &set);
    const Properties properties(set);
    properties.set(kPropSupportedComponents, {kComponentsRgba, kComponentsRgb});
    if (clip != Clip::source && clip != Clip::behind)
        properties.set(kPropSupportedComponents, kComponentsAlpha, 2);
    properties.set(kPropOptional, int(!type.requires_clip(clip)));
    properties.set(kPropIsMask, int(clip == Clip::matte));
    properties.set(kPropTemporalClipAccess,
                   int(type.has(Clip::depth) && role_of_clip(clip) != Role::behind));
    properties.set(kPropSupportsTiles, 0);
}

}  // namespace

Role role_of_clip(Clip clip) {
    constexpr std::array<Role, kClips> kRoles = {Role::color,  Role::inverse_depth, Role::motion,
                                                 Role::mattes, Role::behind,        Role::behind,
                                                 Role::behind};
    return kRoles[size_t(clip)];
}

bool EffectType::has(Clip clip) const {
    return clip == Clip::source || !pass || !required.empty();
}

bool EffectType::requires_clip(Clip clip) const {
    return clip == Clip::source || required.has(role_of_clip(clip));
}

const std::vector<EffectType>& effect_types() {
    static const std::vector<EffectType> types = [] {
        const PassRegistry& passes = builtin_passes();
        return std::vector<EffectType>{
            {"postchain.joint_blur",
             "postchain: Joint Blur",
             passes.find("joint_blur"),
             {Role::inverse_depth, Role::motion}},
            {"postchain.motion_blur",
             "postchain: Motion Blur",
             passes.find("motion_blur"),
             {Role::motion}},
            {"postchain.depth_of_field",
             "postchain: Depth of Field",
             passes.find("depth_of_field"),
             {Role::inverse_depth}},
            {"postchain.fxaa", "postchain: FXAA", passes.find("fxaa"), {}},
            {"postchain.chain", "postchain: Chain", nullptr, {}}};
    }();
    return types;
}

std::vector<const Parameter*> camera_rows(const EffectType& type) {
    std::vector<const Parameter*> rows;
    const ParameterTable* own = type.pass ? type.pass->parameters : nullptr;
    const ParameterTable& lens = *builtin_passes().find("joint_blur")->parameters;
    for (const Parameter& row : camera_parameters().rows()) {
        // Reading an image needs a library that hosts have too.
        if (row.unit == "FILE") continue;
        if (!own || !lens.find(row.key)) rows.push_back(&row);
    }
    return rows;
}

const std::vector<std::string>& chain_names() {
    static const std::vector<std::string> names = embedded_chains();
    return names;
}

void describe(const EffectType& type, Effect effect) {
    const Properties properties = properties_of(effect);
    properties.set(kPropLabel, type.label);
    properties.set(kPropGrouping, "postchain");
    properties.set(kPropDescription,
                   type.pass ? type.pass->help
                             : "A chain of motion blur, depth of field and FXAA: a shipped one, or "
                               "a chain file.");
    const bool filter = !type.has(Clip::depth);
    properties.set(kPropSupportedContexts, kContextGeneral);
    if (filter) properties.set(kPropSupportedContexts, kContextFilter, 1);
    properties.set(kPropSupportedPixelDepths, {kDepthFloat, kDepthHalf});
    properties.set(kPropMultipleClipDepths, 1);
    properties.set(kPropSupportsMultiResolution, 1);
    properties.set(kPropSupportsTiles, 0);
    properties.set(kPropTemporalClipAccess, int(!filter));
    properties.set(kPropThreadSafety, kInstanceSafe);
    properties.set(kPropHostFrameThreading, 0);
    if (!type.pass) {
        int index = 0;
        for (const char* name : {kChain, kChainFile, kOverrides})
            properties.set(kPropClipPreferencesParameters, name, index++);
    } else if (const Parameter* row = type.pass->parameters->find("animate_noise")) {
        properties.set(kPropClipPreferencesParameters, row->key);
    }
}

void describe_in_context(const EffectType& type, Effect effect, bool filter) {
    PropertySet set = nullptr;
    suites().effects->define_clip(effect, kOutputClip, &set);
    Properties(set).set(kPropSupportedComponents, {kComponentsRgba, kComponentsRgb});
    for (size_t i = 0; i < kClips; ++i)
        if (type.has(Clip(i)) && (!filter || Clip(i) == Clip::source))
            define_clip(type, effect, Clip(i));
    Definer define(effect);
    if (type.pass) {
        define.group("passes", type.pass->title.c_str(), true);
        for (const Parameter& row : type.pass->parameters->rows()) define.row(row);
    } else {
        define_chain(define);
    }
    if (type.has(Clip::depth)) {
        define_conventions(define, type);
        define_camera(define, type);
    }
    define.group("report", "Status", true);
    if (type.has(Clip::motion))
        define.boolean(kCheckMotion, "check motion",
                       "compare the motion vectors' signs with the next frame once, and warn if "
                       "others fit better; off dismisses the warning",
                       true);
    define.button(kCheck, "check this frame",
                  "read this frame, and write below what is left out, and why");
    const Properties status =
        define.text(kStatus, "status", "what the last frame did", kStringIsMultiLine);
    status.set(kParamEnabled, 0);
    status.set(kParamEvaluateOnChange, 0);
    status.set(kParamPersistent, 0);
    define.page();
}

Result<ParameterValue> value_of(const Values& values, const Parameter& row, const Region& display) {
    if (has_switch(row) && !values.boolean(switch_of(row.key))) return ParameterValue();
    if (is_choice(row)) {
        const std::vector<std::string> options = options_of(row);
        ASSIGN_OR_RETURN(const size_t index, values.choice(row.key, options.size()));
        if (row.optional && index == 0) return ParameterValue();
        if (row.type == ParameterType::integer)
            return ParameterValue(row.allowed[index - size_t(row.optional)]);
        return ParameterValue(options[index]);
    }
    switch (row.type) {
        case ParameterType::boolean:
            return ParameterValue(values.boolean(row.key));
        case ParameterType::integer:
            return ParameterValue(int64_t(values.integer(row.key)) | int64_t(row.odd));
        case ParameterType::number:
            return ParameterValue(values.number(row.key));
        case ParameterType::point: {
            const auto point = values.point(row.key);
            return ParameterValue(
                std::array<double, 2>{(point[0] - display.x1) / (display.x2 - display.x1),
                                      (display.y2 - point[1]) / (display.y2 - display.y1)});
        }
        default: {
            const std::string text = values.text(row.key);
            return text.empty() ? ParameterValue() : ParameterValue(text);
        }
    }
}

void enable_rows(const Values& values, const ParameterTable& table, ConstParameterRef parameters) {
    for (const Parameter& row : table.rows()) {
        const bool read = table.unread(row, parameters).empty();
        if (has_switch(row)) values.enable(switch_of(row.key), read);
        values.enable(row.key, read && (!has_switch(row) || values.boolean(switch_of(row.key))));
    }
}

}  // namespace postchain::openfx
