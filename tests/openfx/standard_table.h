// A second account of the OpenFX standard, written from its reference and not from
// tools/openfx/standard.h: the host's side of the structs, with the standard's own names, and the
// type, dimension and owners of each property. The test host is built on it.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

namespace postchain::openfx::test {

struct OfxRectD {
    double x1, y1, x2, y2;
};

// Reference, "The OfxHost Struct", "The OfxPlugin Struct".
struct OfxHost {
    void* host;
    const void* (*fetchSuite)(void* host, const char* suiteName, int suiteVersion);
};
struct OfxPlugin {
    const char* pluginApi;
    int apiVersion;
    const char* pluginIdentifier;
    unsigned pluginVersionMajor;
    unsigned pluginVersionMinor;
    void (*setHost)(OfxHost*);
    int (*mainEntry)(const char* action, const void* handle, void* inArgs, void* outArgs);
};

// Reference, "Property Suite".
struct OfxPropertySuiteV1 {
    int (*propSetPointer)(void* properties, const char* property, int index, void* value);
    int (*propSetString)(void* properties, const char* property, int index, const char* value);
    int (*propSetDouble)(void* properties, const char* property, int index, double value);
    int (*propSetInt)(void* properties, const char* property, int index, int value);
    int (*propSetPointerN)(void* properties, const char* property, int count, void* const* value);
    int (*propSetStringN)(void* properties, const char* property, int count,
                          const char* const* value);
    int (*propSetDoubleN)(void* properties, const char* property, int count, const double* value);
    int (*propSetIntN)(void* properties, const char* property, int count, const int* value);
    int (*propGetPointer)(void* properties, const char* property, int index, void** value);
    int (*propGetString)(void* properties, const char* property, int index, char** value);
    int (*propGetDouble)(void* properties, const char* property, int index, double* value);
    int (*propGetInt)(void* properties, const char* property, int index, int* value);
    int (*propGetPointerN)(void* properties, const char* property, int count, void** value);
    int (*propGetStringN)(void* properties, const char* property, int count, char** value);
    int (*propGetDoubleN)(void* properties, const char* property, int count, double* value);
    int (*propGetIntN)(void* properties, const char* property, int count, int* value);
    int (*propReset)(void* properties, const char* property);
    int (*propGetDimension)(void* properties, const char* property, int* count);
};

// Reference, "Image Effect Suite".
struct OfxImageEffectSuiteV1 {
    int (*getPropertySet)(void* imageEffect, void** propHandle);
    int (*getParamSet)(void* imageEffect, void** paramSet);
    int (*clipDefine)(void* imageEffect, const char* name, void** propertySet);
    int (*clipGetHandle)(void* imageEffect, const char* name, void** clip, void** propertySet);
    int (*clipGetPropertySet)(void* clip, void** propHandle);
    int (*clipGetImage)(void* clip, double time, const OfxRectD* region, void** imageHandle);
    int (*clipReleaseImage)(void* imageHandle);
    int (*clipGetRegionOfDefinition)(void* clip, double time, OfxRectD* bounds);
    int (*abort)(void* imageEffect);
    int (*imageMemoryAlloc)(void* instanceHandle, size_t nBytes, void** memoryHandle);
    int (*imageMemoryFree)(void* memoryHandle);
    int (*imageMemoryLock)(void* memoryHandle, void** returnedPtr);
    int (*imageMemoryUnlock)(void* memoryHandle);
};

// Reference, "Parameter Suite".
struct OfxParameterSuiteV1 {
    int (*paramDefine)(void* paramSet, const char* paramType, const char* name, void** propertySet);
    int (*paramGetHandle)(void* paramSet, const char* name, void** param, void** propertySet);
    int (*paramSetGetPropertySet)(void* paramSet, void** propHandle);
    int (*paramGetPropertySet)(void* param, void** propHandle);
    int (*paramGetValue)(void* paramHandle, ...);
    int (*paramGetValueAtTime)(void* paramHandle, double time, ...);
    int (*paramGetDerivative)(void* paramHandle, double time, ...);
    int (*paramGetIntegral)(void* paramHandle, double time1, double time2, ...);
    int (*paramSetValue)(void* paramHandle, ...);
    int (*paramSetValueAtTime)(void* paramHandle, double time, ...);
    int (*paramGetNumKeys)(void* paramHandle, unsigned* numberOfKeys);
    int (*paramGetKeyTime)(void* paramHandle, unsigned nthKey, double* time);
    int (*paramGetKeyIndex)(void* paramHandle, double time, int direction, int* index);
    int (*paramDeleteKey)(void* paramHandle, double time);
    int (*paramDeleteAllKeys)(void* paramHandle);
    int (*paramCopy)(void* paramTo, void* paramFrom, double dstOffset, const void* frameRange);
    int (*paramEditBegin)(void* paramSet, const char* name);
    int (*paramEditEnd)(void* paramSet);
};

// Reference, "Message Suite V2".
struct OfxMessageSuiteV2 {
    int (*message)(void* handle, const char* messageType, const char* messageId, const char* format,
                   ...);
    int (*setPersistentMessage)(void* handle, const char* messageType, const char* messageId,
                                const char* format, ...);
    int (*clearPersistentMessage)(void* handle);
};

enum Type { kString, kDouble, kInt, kPointer, kOfParameter };

// Owners of properties, as bits: Reference, "Property Sets Reference", and the arguments of
// actions.
enum Owner : unsigned {
    kHostItself = 1,
    kEffect = 2,  // its descriptor, and what an instance adds
    kClip = 4,
    kImage = 8,
    kGroup = 16,
    kPage = 32,
    kButton = 64,
    kBoolean = 128,
    kInteger = 256,
    kReal = 512,
    kPair = 1024,
    kChoice = 2048,
    kText = 4096,
    kIn = 8192,
    kOut = 16384,
    kValues = kBoolean | kInteger | kReal | kPair | kChoice | kText,
    kParameters = kValues | kGroup | kPage | kButton,
};

struct Property {
    std::string_view name;
    Type type;
    int dimension;  // 0: any
    unsigned owners;
};

// Reference, "Properties Reference".
inline const std::vector<Property>& properties() {
    static const std::vector<Property> table = {
        {"OfxPropAPIVersion", kInt, 0, kHostItself},
        {"OfxPropName", kString, 1, kHostItself | kClip | kParameters | kIn | kOut},
        {"OfxPropLabel", kString, 1, kEffect | kClip | kParameters},
        {"OfxPropTime", kDouble, 1, kIn | kOut},
        {"OfxPropPluginDescription", kString, 1, kEffect},
        {"OfxPropInstanceData", kPointer, 1, kEffect},
        {"OfxImageEffectPluginPropGrouping", kString, 1, kEffect},
        {"OfxImageEffectPropContext", kString, 1, kEffect | kIn},
        {"OfxImageEffectPropSupportedContexts", kString, 0, kEffect},
        {"OfxImageEffectPluginRenderThreadSafety", kString, 1, kEffect},
        {"OfxImageEffectPluginPropHostFrameThreading", kInt, 1, kEffect},
        {"OfxImageEffectPropSupportsTiles", kInt, 1, kEffect | kClip},
        {"OfxImageEffectPropSupportsMultiResolution", kInt, 1, kEffect},
        {"OfxImageEffectPropTemporalClipAccess", kInt, 1, kEffect | kClip},
        {"OfxImageEffectPropMultipleClipDepths", kInt, 1, kEffect},
        {"OfxImageEffectPropSupportedPixelDepths", kString, 0, kEffect},
        {"OfxImageEffectPropSupportedComponents", kString, 0, kClip},
        {"OfxImageEffectPropClipPreferencesSlaveParam", kString, 0, kEffect},
        {"OfxImageEffectPropProjectSize", kDouble, 2, kEffect},
        {"OfxImageEffectPropProjectOffset", kDouble, 2, kEffect},
        {"OfxImageClipPropOptional", kInt, 1, kClip},
        {"OfxImageClipPropIsMask", kInt, 1, kClip},
        {"OfxImageClipPropConnected", kInt, 1, kClip},
        {"OfxImageEffectPropFrameRange", kDouble, 2, kClip},
        {"OfxImagePropPixelAspectRatio", kDouble, 1, kClip | kImage},
        {"OfxImageEffectPropPreMultiplication", kString, 1, kClip | kImage},
        {"OfxImageEffectPropPixelDepth", kString, 1, kClip | kImage},
        {"OfxImageEffectPropComponents", kString, 1, kClip | kImage},
        {"OfxImagePropData", kPointer, 1, kImage},
        {"OfxImagePropBounds", kInt, 4, kImage},
        {"OfxImagePropRowBytes", kInt, 1, kImage},
        {"OfxImageEffectPropRenderScale", kDouble, 2, kImage | kIn},
        {"OfxImageEffectPropRenderWindow", kInt, 4, kIn},
        {"OfxImageEffectPropFieldToRender", kString, 1, kIn},
        {"OfxImageEffectPropRegionOfInterest", kDouble, 4, kIn},
        {"OfxImageEffectPropRegionOfDefinition", kDouble, 4, kOut},
        {"OfxImageEffectFrameVarying", kInt, 1, kOut},
        {"OfxPropType", kString, 1, kIn},
        {"OfxPropChangeReason", kString, 1, kIn},
        {"OfxParamPropDefault", kOfParameter, -1, kValues},
        {"OfxParamPropMin", kOfParameter, -1, kInteger | kReal | kPair},
        {"OfxParamPropMax", kOfParameter, -1, kInteger | kReal | kPair},
        {"OfxParamPropDisplayMin", kOfParameter, -1, kInteger | kReal | kPair},
        {"OfxParamPropDisplayMax", kOfParameter, -1, kInteger | kReal | kPair},
        {"OfxParamPropHint", kString, 1, kParameters},
        {"OfxParamPropParent", kString, 1, kParameters},
        {"OfxParamPropEnabled", kInt, 1, kParameters},
        {"OfxParamPropGroupOpen", kInt, 1, kGroup},
        {"OfxParamPropPageChild", kString, 0, kPage},
        {"OfxParamPropChoiceOption", kString, 0, kChoice},
        {"OfxParamPropAnimates", kInt, 1, kValues},
        {"OfxParamPropEvaluateOnChange", kInt, 1, kValues},
        {"OfxParamPropPersistant", kInt, 1, kValues},
        {"OfxParamPropCacheInvalidation", kString, 1, kValues},
        {"OfxParamPropDoubleType", kString, 1, kReal | kPair},
        {"OfxParamPropDefaultCoordinateSystem", kString, 1, kReal | kPair},
        {"OfxParamPropStringMode", kString, 1, kText},
        {"OfxParamHostPropSupportsBooleanAnimation", kInt, 1, kHostItself},
        {"OfxParamHostPropSupportsChoiceAnimation", kInt, 1, kHostItself},
        // With the name of a clip after them.
        {"OfxImageClipPropFrameRange_", kDouble, 0, kOut},
        {"OfxImageClipPropRoI_", kDouble, 4, kOut},
    };
    return table;
}

// Values that properties of type string may have, where the standard lists them.
inline const std::vector<std::string_view>& values_of(std::string_view property) {
    static const std::vector<std::pair<std::string_view, std::vector<std::string_view>>> table = {
        {"OfxImageEffectPropSupportedContexts",
         {"OfxImageEffectContextFilter", "OfxImageEffectContextGeneral",
          "OfxImageEffectContextGenerator", "OfxImageEffectContextPaint",
          "OfxImageEffectContextRetimer", "OfxImageEffectContextTransition"}},
        {"OfxImageEffectPluginRenderThreadSafety",
         {"OfxImageEffectRenderUnsafe", "OfxImageEffectRenderInstanceSafe",
          "OfxImageEffectRenderFullySafe"}},
        {"OfxImageEffectPropSupportedPixelDepths",
         {"OfxBitDepthNone", "OfxBitDepthByte", "OfxBitDepthShort", "OfxBitDepthHalf",
          "OfxBitDepthFloat"}},
        {"OfxImageEffectPropSupportedComponents",
         {"OfxImageComponentNone", "OfxImageComponentRGBA", "OfxImageComponentRGB",
          "OfxImageComponentAlpha"}},
        {"OfxParamPropCacheInvalidation",
         {"OfxParamInvalidateValueChange", "OfxParamInvalidateValueChangeToEnd",
          "OfxParamInvalidateAll"}},
        {"OfxParamPropDoubleType",
         {"OfxParamDoubleTypePlain", "OfxParamDoubleTypeAngle", "OfxParamDoubleTypeScale",
          "OfxParamDoubleTypeTime", "OfxParamDoubleTypeAbsoluteTime", "OfxParamDoubleTypeX",
          "OfxParamDoubleTypeXAbsolute", "OfxParamDoubleTypeY", "OfxParamDoubleTypeYAbsolute",
          "OfxParamDoubleTypeXY", "OfxParamDoubleTypeXYAbsolute"}},
        {"OfxParamPropDefaultCoordinateSystem",
         {"OfxParamCoordinatesCanonical", "OfxParamCoordinatesNormalised"}},
        {"OfxParamPropStringMode",
         {"OfxParamStringIsSingleLine", "OfxParamStringIsMultiLine", "OfxParamStringIsFilePath",
          "OfxParamStringIsDirectoryPath", "OfxParamStringIsLabel",
          "OfxParamStringIsRichTextFormat"}}};
    static const std::vector<std::string_view> none;
    for (const auto& [name, values] : table)
        if (name == property) return values;
    return none;
}

// Reference, "Parameter Types", with the owner of their properties.
struct ParameterKind {
    std::string_view name;
    Owner owner;
    Type type;      // of its values
    int dimension;  // 0: it has none
};
inline const std::vector<ParameterKind>& parameter_kinds() {
    static const std::vector<ParameterKind> table = {
        {"OfxParamTypeBoolean", kBoolean, kInt, 1},  {"OfxParamTypeInteger", kInteger, kInt, 1},
        {"OfxParamTypeDouble", kReal, kDouble, 1},   {"OfxParamTypeDouble2D", kPair, kDouble, 2},
        {"OfxParamTypeChoice", kChoice, kInt, 1},    {"OfxParamTypeString", kText, kString, 1},
        {"OfxParamTypeGroup", kGroup, kInt, 0},      {"OfxParamTypePage", kPage, kInt, 0},
        {"OfxParamTypePushButton", kButton, kInt, 0}};
    return table;
}

}  // namespace postchain::openfx::test
