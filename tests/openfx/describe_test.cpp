// The plugin tells a host about itself. Checked against the standard, with the order of pointers
// that it expects.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "chain/frame/frame.h"
#include "passes/registry.h"
#include "tests/openfx/test_host.h"
#include "tests/support/transcript.h"
#include "tools/openfx/standard.h"

namespace postchain::openfx::test {
namespace {

using ::testing::HasSubstr;

TEST(Standard, PointersAreInTheOrderOfTheReference) {
#define EXPECT_SAME(ours, theirs) EXPECT_EQ(offsetof ours, offsetof theirs) << #ours
    EXPECT_SAME((HostEntry, properties), (OfxHost, host));
    EXPECT_SAME((HostEntry, fetch_suite), (OfxHost, fetchSuite));
    EXPECT_SAME((PluginEntry, api), (OfxPlugin, pluginApi));
    EXPECT_SAME((PluginEntry, api_version), (OfxPlugin, apiVersion));
    EXPECT_SAME((PluginEntry, identifier), (OfxPlugin, pluginIdentifier));
    EXPECT_SAME((PluginEntry, major_version), (OfxPlugin, pluginVersionMajor));
    EXPECT_SAME((PluginEntry, minor_version), (OfxPlugin, pluginVersionMinor));
    EXPECT_SAME((PluginEntry, set_host), (OfxPlugin, setHost));
    EXPECT_SAME((PluginEntry, main_entry), (OfxPlugin, mainEntry));
    EXPECT_EQ(sizeof(PluginEntry), sizeof(OfxPlugin));
    EXPECT_SAME((PropertySuite, set_pointer), (OfxPropertySuiteV1, propSetPointer));
    EXPECT_SAME((PropertySuite, set_string), (OfxPropertySuiteV1, propSetString));
    EXPECT_SAME((PropertySuite, set_double), (OfxPropertySuiteV1, propSetDouble));
    EXPECT_SAME((PropertySuite, set_int), (OfxPropertySuiteV1, propSetInt));
    EXPECT_SAME((PropertySuite, set_pointers), (OfxPropertySuiteV1, propSetPointerN));
    EXPECT_SAME((PropertySuite, set_strings), (OfxPropertySuiteV1, propSetStringN));
    EXPECT_SAME((PropertySuite, set_doubles), (OfxPropertySuiteV1, propSetDoubleN));
    EXPECT_SAME((PropertySuite, set_ints), (OfxPropertySuiteV1, propSetIntN));
    EXPECT_SAME((PropertySuite, get_pointer), (OfxPropertySuiteV1, propGetPointer));
    EXPECT_SAME((PropertySuite, get_string), (OfxPropertySuiteV1, propGetString));
    EXPECT_SAME((PropertySuite, get_double), (OfxPropertySuiteV1, propGetDouble));
    EXPECT_SAME((PropertySuite, get_int), (OfxPropertySuiteV1, propGetInt));
    EXPECT_SAME((PropertySuite, get_pointers), (OfxPropertySuiteV1, propGetPointerN));
    EXPECT_SAME((PropertySuite, get_strings), (OfxPropertySuiteV1, propGetStringN));
    EXPECT_SAME((PropertySuite, get_doubles), (OfxPropertySuiteV1, propGetDoubleN));
    EXPECT_SAME((PropertySuite, get_ints), (OfxPropertySuiteV1, propGetIntN));
    EXPECT_SAME((PropertySuite, reset), (OfxPropertySuiteV1, propReset));
    EXPECT_SAME((PropertySuite, get_dimension), (OfxPropertySuiteV1, propGetDimension));
    EXPECT_EQ(sizeof(PropertySuite), sizeof(OfxPropertySuiteV1));
    EXPECT_SAME((EffectSuite, get_property_set), (OfxImageEffectSuiteV1, getPropertySet));
    EXPECT_SAME((EffectSuite, get_parameter_set), (OfxImageEffectSuiteV1, getParamSet));
    EXPECT_SAME((EffectSuite, define_clip), (OfxImageEffectSuiteV1, clipDefine));
    EXPECT_SAME((EffectSuite, get_clip), (OfxImageEffectSuiteV1, clipGetHandle));
    EXPECT_SAME((EffectSuite, get_clip_property_set), (OfxImageEffectSuiteV1, clipGetPropertySet));
    EXPECT_SAME((EffectSuite, get_image), (OfxImageEffectSuiteV1, clipGetImage));
    EXPECT_SAME((EffectSuite, release_image), (OfxImageEffectSuiteV1, clipReleaseImage));
    EXPECT_SAME((EffectSuite, get_clip_region), (OfxImageEffectSuiteV1, clipGetRegionOfDefinition));
    EXPECT_SAME((EffectSuite, abort), (OfxImageEffectSuiteV1, abort));
    EXPECT_SAME((ParameterSuite, define), (OfxParameterSuiteV1, paramDefine));
    EXPECT_SAME((ParameterSuite, get_handle), (OfxParameterSuiteV1, paramGetHandle));
    EXPECT_SAME((ParameterSuite, get_set_properties),
                (OfxParameterSuiteV1, paramSetGetPropertySet));
    EXPECT_SAME((ParameterSuite, get_properties), (OfxParameterSuiteV1, paramGetPropertySet));
    EXPECT_SAME((ParameterSuite, get_value), (OfxParameterSuiteV1, paramGetValue));
    EXPECT_SAME((ParameterSuite, get_value_at_time), (OfxParameterSuiteV1, paramGetValueAtTime));
    EXPECT_SAME((ParameterSuite, get_derivative), (OfxParameterSuiteV1, paramGetDerivative));
    EXPECT_SAME((ParameterSuite, get_integral), (OfxParameterSuiteV1, paramGetIntegral));
    EXPECT_SAME((ParameterSuite, set_value), (OfxParameterSuiteV1, paramSetValue));
    EXPECT_SAME((MessageSuite, message), (OfxMessageSuiteV2, message));
    EXPECT_SAME((MessageSuite, set_persistent), (OfxMessageSuiteV2, setPersistentMessage));
    EXPECT_SAME((MessageSuite, clear_persistent), (OfxMessageSuiteV2, clearPersistentMessage));
    EXPECT_EQ(sizeof(MessageSuite), sizeof(OfxMessageSuiteV2));
#undef EXPECT_SAME
}

TEST(Describe, FiveEffectsWithTheirClips) {
    Host host;
    ASSERT_EQ(host.count(), 5);
    EXPECT_EQ(host.plugin(5), nullptr);
    EXPECT_EQ(host.plugin(-1), nullptr);
    for (int i = 0; i < host.count(); ++i) {
        const OfxPlugin& plugin = *host.plugin(i);
        EXPECT_STREQ(plugin.pluginApi, "OfxImageEffectPluginAPI");
        EXPECT_EQ(plugin.apiVersion, 1);
        EXPECT_EQ(plugin.pluginVersionMajor, 1u);
    }
    const auto clips = [&](const char* name) {
        std::string text;
        for (const auto& [clip, set] : host.described(host.plugin(name)).described)
            if (clip != "Output")
                text += clip + (set.integer("OfxImageClipPropOptional") ? "? " : " ");
        return text;
    };
    EXPECT_EQ(clips("postchain.joint_blur"),
              "Behind? BehindDepth? BehindMotion? Depth Matte? Motion Source ");
    EXPECT_EQ(clips("postchain.motion_blur"),
              "Behind? BehindDepth? BehindMotion? Depth? Matte? Motion Source ");
    EXPECT_EQ(clips("postchain.depth_of_field"),
              "Behind? BehindDepth? BehindMotion? Depth Matte? Motion? Source ");
    EXPECT_EQ(clips("postchain.fxaa"), "Source ");
    EXPECT_EQ(clips("postchain.chain"),
              "Behind? BehindDepth? BehindMotion? Depth? Matte? Motion? Source ");
    EXPECT_EQ(host.described(host.plugin("postchain.fxaa"), "OfxImageEffectContextFilter")
                  .described.size(),
              2u);
}

std::string line_of(const PropertyObject& set) {
    std::string line;
    for (const auto& [name, values] : set.values) {
        line += ", " + name + " =";
        for (const Value& value : values)
            std::visit(
                [&](const auto& one) {
                    if constexpr (std::is_same_v<decltype(one), void* const&>)
                        line += one ? " set" : " none";
                    else
                        line += concat(" ", one);
                },
                value);
    }
    return line;
}

// Every property of effects, clips and parameters, in their order: of two passes, and all that is
// no row of a pass. Of parameters that two effects describe alike only the first.
TEST(Describe, EveryProperty) {
    Host host;
    const postchain::test::Transcript whole(POSTCHAIN_SOURCE_DIR "/tests/openfx/expected");
    const auto say = [](const std::string& name, const PropertyObject& set) {
        postchain::test::Transcript::say(name + line_of(set));
    };
    std::set<std::string> known;
    for (int i = 0; i < host.count(); ++i) {
        const EffectObject& effect = host.described(host.plugin(i));
        const std::string identifier = host.plugin(i)->pluginIdentifier;
        const bool short_of_rows =
            identifier == "postchain.joint_blur" || identifier == "postchain.depth_of_field";
        say(identifier, effect.properties);
        for (const auto& [name, set] : effect.described) say("clip " + name, set);
        for (const std::string& name : effect.order) {
            const PropertyObject& set = effect.parameters.at(name).properties;
            if (short_of_rows && set.text("OfxParamPropParent") == "passes") continue;
            const std::string type(set.parameter ? set.parameter->name : "none");
            if (known.insert(name + type + line_of(set)).second) say(name + " " + type, set);
        }
    }
}

// Every row of a table is a parameter, with its range and help.
TEST(Describe, RowsOfTheTables) {
    Host host;
    for (const PassType& pass : builtin_passes().types()) {
        const EffectObject& effect = host.described(host.plugin("postchain." + pass.name));
        for (const Parameter& row : pass.parameters->rows()) {
            const auto found = effect.parameters.find(row.key);
            ASSERT_NE(found, effect.parameters.end()) << pass.name << "." << row.key;
            const PropertyObject& set = found->second.properties;
            EXPECT_THAT(set.text("OfxParamPropHint"), HasSubstr(row.full_help()));
            EXPECT_THAT(set.text("OfxParamPropHint"), HasSubstr(row.unit));
            EXPECT_EQ(set.text("OfxParamPropParent"), "passes");
            const bool choice = row.type == ParameterType::choice || !row.allowed.empty();
            if (choice) {
                const auto& options = set.values.at("OfxParamPropChoiceOption");
                EXPECT_EQ(options.size(),
                          row.choices.size() + row.allowed.size() + size_t(row.optional));
                EXPECT_EQ(
                    std::get<std::string>(options[size_t(set.integer("OfxParamPropDefault"))]),
                    text_of(row.default_value))
                    << row.key;
            } else {
                EXPECT_EQ(effect.parameters.contains("use_" + row.key), row.optional) << row.key;
            }
            if (choice || row.type != ParameterType::number) continue;
            const auto expect = [&](const char* name, double limit) {
                ASSERT_EQ(set.values.contains(name), std::isfinite(limit)) << row.key << name;
                EXPECT_TRUE(!std::isfinite(limit) || set.number(name) == limit) << row.key << name;
            };
            expect("OfxParamPropMin", row.min);
            expect("OfxParamPropMax", row.max);
            expect("OfxParamPropDisplayMin", row.soft_min);
            expect("OfxParamPropDisplayMax", row.soft_max);
            EXPECT_TRUE(row.optional ||
                        ParameterValue(set.number("OfxParamPropDefault")) == row.default_value)
                << row.key;
        }
    }
    const EffectObject& chain = host.described(host.plugin("postchain.chain"));
    for (const Parameter& row : camera_parameters().rows())
        EXPECT_EQ(chain.parameters.contains(row.key), row.unit != "FILE") << row.key;
}

TEST(Describe, GroupsAndPages) {
    Host host;
    for (int i = 0; i < host.count(); ++i) {
        const EffectObject& effect = host.described(host.plugin(i));
        std::vector<std::string> listed;
        for (const Value& name :
             effect.parameters.at("page").properties.values.at("OfxParamPropPageChild"))
            listed.push_back(std::get<std::string>(name));
        listed.push_back("page");
        EXPECT_EQ(listed, effect.order);
        for (const auto& [name, parameter] : effect.parameters) {
            EXPECT_NE(parameter.properties.text("OfxPropLabel"), "") << name;
            const std::string parent = parameter.properties.text("OfxParamPropParent");
            EXPECT_TRUE(parent.empty() || effect.parameters.at(parent).properties.owner == kGroup)
                << name;
        }
    }
}

// Identifiers are stored in hosts' documents: this list may grow, and nothing of it may change. A
// choice is stored as its place: options are added at the end.
TEST(Describe, IdentifiersOfEarlierReleases) {
    Host host;
    std::ifstream file(POSTCHAIN_SOURCE_DIR "/tests/openfx/identifiers.txt");
    int count = 0;
    for (std::string effect; std::getline(file, effect, ':');) {
        std::string line, word;
        std::getline(file, line);
        const auto& parameters = host.described(host.plugin(effect)).parameters;
        for (std::istringstream words(line); std::getline(words, word, ';'); ++count) {
            std::string name, type, options;
            std::istringstream one(word);
            std::getline(one >> name >> type, options);
            const auto found = parameters.find(name);
            ASSERT_NE(found, parameters.end()) << effect << " " << name;
            const PropertyObject& set = found->second.properties;
            EXPECT_EQ("OfxParamType" + type, set.parameter->name) << effect << " " << name;
            if (type != "Choice") continue;
            std::string now;
            for (const Value& option : set.values.at("OfxParamPropChoiceOption"))
                now += " | " + std::get<std::string>(option);
            EXPECT_THAT(now, ::testing::StartsWith(options)) << effect << " " << name;
        }
    }
    EXPECT_GT(count, 200);
}

TEST(Load, EachSuiteIsRefused) {
    for (const char* suite : {"OfxPropertySuite", "OfxImageEffectSuite", "OfxParameterSuite"}) {
        Host host({suite});
        for (int i = 0; i < host.count(); ++i)
            EXPECT_EQ(host.load(host.plugin(i)), kStatErrMissingHostFeature) << suite;
    }
    Host host({"OfxMessageSuite"});
    Node node(host, "postchain.fxaa", 8, 8);
    EXPECT_EQ(node.render(1), kStatFailed);
    EXPECT_EQ(node.message(), "");
    EXPECT_EQ(node.changed("check"), kStatOK);
    EXPECT_THAT(node.status(), HasSubstr("Source: is not connected"));
}

TEST(Load, ActionsWithoutAnInstance) {
    Host host;
    OfxPlugin* plugin = host.plugin("postchain.chain");
    ASSERT_EQ(host.load(plugin), kStatOK);
    EXPECT_EQ(host.act(plugin, "OfxImageEffectActionRender"), kStatFailed);
    EffectObject none;
    none.properties.owner = kEffect;
    EXPECT_EQ(host.act(plugin, "OfxActionDestroyInstance", &none), kStatFailed);
    Node node(host, "postchain.chain", 8, 8);
    EXPECT_EQ(host.act(plugin, "OfxActionSyncPrivateData", &node.object()), kStatReplyDefault);
    EXPECT_EQ(host.act(plugin, "OfxActionPurgeCaches", &node.object()), kStatOK);
}

}  // namespace
}  // namespace postchain::openfx::test
