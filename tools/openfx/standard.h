// Declarations of the OpenFX standard (version 1.5, openfx.readthedocs.io), as far as this plugin
// uses it: strings, status codes, and the order of function pointers in the structs that cross the
// border. Written from the standard's reference. Strings are the standard's own, names of C++ are
// ours.
//
// Hosts call and are called by these pointers: a wrong order crashes them. tests/openfx has a
// second table, with which every string and every offset is compared.
#pragma once

namespace postchain::openfx {

// "Status Codes".
using HostStatus = int;
inline constexpr HostStatus kOk = 0;
inline constexpr HostStatus kFailed = 1;
inline constexpr HostStatus kMissingHostFeature = 4;
inline constexpr HostStatus kOutOfMemory = 8;
inline constexpr HostStatus kReplyDefault = 14;

// "Generic Core API". Handles are the host's.
using PropertySet = struct PropertySetObject*;
using Effect = struct EffectObject*;
using ParameterSet = struct ParameterSetObject*;
using HostParameter = struct HostParameterObject*;
using ClipHandle = struct ClipObject*;
struct RectangleD {
    double x1, y1, x2, y2;
};

// "The OfxHost Struct".
struct HostEntry {
    PropertySet properties;
    const void* (*fetch_suite)(PropertySet host, const char* name, int version);
};

// "The OfxPlugin Struct".
struct PluginEntry {
    const char* api;
    int api_version;
    const char* identifier;
    unsigned major_version;
    unsigned minor_version;
    void (*set_host)(HostEntry* host);
    HostStatus (*main_entry)(const char* action, const void* handle, PropertySet in,
                             PropertySet out);
};

// "Property Suite", version 1.
struct PropertySuite {
    HostStatus (*set_pointer)(PropertySet, const char* name, int index, void* value);
    HostStatus (*set_string)(PropertySet, const char* name, int index, const char* value);
    HostStatus (*set_double)(PropertySet, const char* name, int index, double value);
    HostStatus (*set_int)(PropertySet, const char* name, int index, int value);
    HostStatus (*set_pointers)(PropertySet, const char* name, int count, void* const* values);
    HostStatus (*set_strings)(PropertySet, const char* name, int count, const char* const* values);
    HostStatus (*set_doubles)(PropertySet, const char* name, int count, const double* values);
    HostStatus (*set_ints)(PropertySet, const char* name, int count, const int* values);
    HostStatus (*get_pointer)(PropertySet, const char* name, int index, void** value);
    HostStatus (*get_string)(PropertySet, const char* name, int index, char** value);
    HostStatus (*get_double)(PropertySet, const char* name, int index, double* value);
    HostStatus (*get_int)(PropertySet, const char* name, int index, int* value);
    HostStatus (*get_pointers)(PropertySet, const char* name, int count, void** values);
    HostStatus (*get_strings)(PropertySet, const char* name, int count, char** values);
    HostStatus (*get_doubles)(PropertySet, const char* name, int count, double* values);
    HostStatus (*get_ints)(PropertySet, const char* name, int count, int* values);
    HostStatus (*reset)(PropertySet, const char* name);
    HostStatus (*get_dimension)(PropertySet, const char* name, int* count);
};

// "Image Effect Suite", version 1; without the functions for memory at its end.
struct EffectSuite {
    HostStatus (*get_property_set)(Effect, PropertySet* properties);
    HostStatus (*get_parameter_set)(Effect, ParameterSet* parameters);
    HostStatus (*define_clip)(Effect, const char* name, PropertySet* properties);
    HostStatus (*get_clip)(Effect, const char* name, ClipHandle* clip, PropertySet* properties);
    HostStatus (*get_clip_property_set)(ClipHandle, PropertySet* properties);
    HostStatus (*get_image)(ClipHandle, double time, const RectangleD* region, PropertySet* image);
    HostStatus (*release_image)(PropertySet image);
    HostStatus (*get_clip_region)(ClipHandle, double time, RectangleD* region);
    int (*abort)(Effect);
};

// "Parameter Suite", version 1; without the functions for keys, copies and edits at its end.
struct ParameterSuite {
    HostStatus (*define)(ParameterSet, const char* type, const char* name, PropertySet* properties);
    HostStatus (*get_handle)(ParameterSet, const char* name, HostParameter* parameter,
                             PropertySet* properties);
    HostStatus (*get_set_properties)(ParameterSet, PropertySet* properties);
    HostStatus (*get_properties)(HostParameter, PropertySet* properties);
    HostStatus (*get_value)(HostParameter, ...);
    HostStatus (*get_value_at_time)(HostParameter, double time, ...);
    HostStatus (*get_derivative)(HostParameter, double time, ...);
    HostStatus (*get_integral)(HostParameter, double from, double to, ...);
    HostStatus (*set_value)(HostParameter, ...);
};

// "Message Suite", version 2. Version 1 has the first function alone.
struct MessageSuite {
    HostStatus (*message)(void* effect, const char* type, const char* id, const char* format, ...);
    HostStatus (*set_persistent)(void* effect, const char* type, const char* id, const char* format,
                                 ...);
    HostStatus (*clear_persistent)(void* effect);
};

// "Suites".
inline constexpr const char* kPropertySuite = "OfxPropertySuite";
inline constexpr const char* kEffectSuite = "OfxImageEffectSuite";
inline constexpr const char* kParameterSuite = "OfxParameterSuite";
inline constexpr const char* kMessageSuite = "OfxMessageSuite";

// "Image Effect API".
inline constexpr const char* kEffectApi = "OfxImageEffectPluginAPI";
inline constexpr int kEffectApiVersion = 1;
inline constexpr const char* kOutputClip = "Output";
inline constexpr const char* kSourceClip = "Source";

// "Actions Passed to An Image Effect".
inline constexpr const char* kActionLoad = "OfxActionLoad";
inline constexpr const char* kActionUnload = "OfxActionUnload";
inline constexpr const char* kActionDescribe = "OfxActionDescribe";
inline constexpr const char* kActionDescribeInContext = "OfxImageEffectActionDescribeInContext";
inline constexpr const char* kActionCreateInstance = "OfxActionCreateInstance";
inline constexpr const char* kActionDestroyInstance = "OfxActionDestroyInstance";
inline constexpr const char* kActionInstanceChanged = "OfxActionInstanceChanged";
inline constexpr const char* kActionPurgeCaches = "OfxActionPurgeCaches";
inline constexpr const char* kActionGetRegionOfDefinition =
    "OfxImageEffectActionGetRegionOfDefinition";
inline constexpr const char* kActionGetRegionsOfInterest =
    "OfxImageEffectActionGetRegionsOfInterest";
inline constexpr const char* kActionGetFramesNeeded = "OfxImageEffectActionGetFramesNeeded";
inline constexpr const char* kActionGetClipPreferences = "OfxImageEffectActionGetClipPreferences";
inline constexpr const char* kActionIsIdentity = "OfxImageEffectActionIsIdentity";
inline constexpr const char* kActionRender = "OfxImageEffectActionRender";

// "Image Effect Contexts".
inline constexpr const char* kContextFilter = "OfxImageEffectContextFilter";
inline constexpr const char* kContextGeneral = "OfxImageEffectContextGeneral";
inline constexpr const char* kPropContext = "OfxImageEffectPropContext";
inline constexpr const char* kPropSupportedContexts = "OfxImageEffectPropSupportedContexts";

// "Properties": of plugins and all objects.
inline constexpr const char* kPropName = "OfxPropName";
inline constexpr const char* kPropLabel = "OfxPropLabel";
inline constexpr const char* kPropTime = "OfxPropTime";
inline constexpr const char* kPropDescription = "OfxPropPluginDescription";
inline constexpr const char* kPropInstanceData = "OfxPropInstanceData";
inline constexpr const char* kPropGrouping = "OfxImageEffectPluginPropGrouping";
inline constexpr const char* kPropThreadSafety = "OfxImageEffectPluginRenderThreadSafety";
inline constexpr const char* kInstanceSafe = "OfxImageEffectRenderInstanceSafe";
inline constexpr const char* kPropHostFrameThreading = "OfxImageEffectPluginPropHostFrameThreading";
inline constexpr const char* kPropSupportsTiles = "OfxImageEffectPropSupportsTiles";
inline constexpr const char* kPropSupportsMultiResolution =
    "OfxImageEffectPropSupportsMultiResolution";
inline constexpr const char* kPropTemporalClipAccess = "OfxImageEffectPropTemporalClipAccess";
inline constexpr const char* kPropMultipleClipDepths = "OfxImageEffectPropMultipleClipDepths";
inline constexpr const char* kPropSupportedPixelDepths = "OfxImageEffectPropSupportedPixelDepths";
inline constexpr const char* kPropSupportedComponents = "OfxImageEffectPropSupportedComponents";
inline constexpr const char* kPropClipPreferencesParameters =
    "OfxImageEffectPropClipPreferencesSlaveParam";
inline constexpr const char* kPropProjectSize = "OfxImageEffectPropProjectSize";
inline constexpr const char* kPropProjectOffset = "OfxImageEffectPropProjectOffset";

// Properties of clips and images.
inline constexpr const char* kPropOptional = "OfxImageClipPropOptional";
inline constexpr const char* kPropIsMask = "OfxImageClipPropIsMask";
inline constexpr const char* kPropConnected = "OfxImageClipPropConnected";
inline constexpr const char* kPropFrameRange = "OfxImageEffectPropFrameRange";
inline constexpr const char* kPropPixelAspect = "OfxImagePropPixelAspectRatio";
inline constexpr const char* kPropPremultiplication = "OfxImageEffectPropPreMultiplication";
inline constexpr const char* kUnpremultiplied = "OfxImageAlphaUnPremultiplied";
inline constexpr const char* kPropPixelDepth = "OfxImageEffectPropPixelDepth";
inline constexpr const char* kDepthFloat = "OfxBitDepthFloat";
inline constexpr const char* kDepthHalf = "OfxBitDepthHalf";
inline constexpr const char* kPropComponents = "OfxImageEffectPropComponents";
inline constexpr const char* kComponentsRgba = "OfxImageComponentRGBA";
inline constexpr const char* kComponentsRgb = "OfxImageComponentRGB";
inline constexpr const char* kComponentsAlpha = "OfxImageComponentAlpha";
inline constexpr const char* kPropData = "OfxImagePropData";
inline constexpr const char* kPropBounds = "OfxImagePropBounds";
inline constexpr const char* kPropRowBytes = "OfxImagePropRowBytes";

// Arguments of actions. The names of clips are appended to the last two.
inline constexpr const char* kPropRenderScale = "OfxImageEffectPropRenderScale";
inline constexpr const char* kPropRenderWindow = "OfxImageEffectPropRenderWindow";
inline constexpr const char* kPropFieldToRender = "OfxImageEffectPropFieldToRender";
inline constexpr const char* kFieldLower = "OfxFieldLower";
inline constexpr const char* kFieldUpper = "OfxFieldUpper";
inline constexpr const char* kPropRegionOfDefinition = "OfxImageEffectPropRegionOfDefinition";
inline constexpr const char* kPropFrameVarying = "OfxImageEffectFrameVarying";
inline constexpr const char* kPropFramesOfClip = "OfxImageClipPropFrameRange_";
inline constexpr const char* kPropRegionOfClip = "OfxImageClipPropRoI_";

// "Parameters": types and properties.
inline constexpr const char* kTypeBoolean = "OfxParamTypeBoolean";
inline constexpr const char* kTypeInteger = "OfxParamTypeInteger";
inline constexpr const char* kTypeDouble = "OfxParamTypeDouble";
inline constexpr const char* kTypeDouble2D = "OfxParamTypeDouble2D";
inline constexpr const char* kTypeChoice = "OfxParamTypeChoice";
inline constexpr const char* kTypeString = "OfxParamTypeString";
inline constexpr const char* kTypeGroup = "OfxParamTypeGroup";
inline constexpr const char* kTypePage = "OfxParamTypePage";
inline constexpr const char* kTypePushButton = "OfxParamTypePushButton";
inline constexpr const char* kParamDefault = "OfxParamPropDefault";
inline constexpr const char* kParamMin = "OfxParamPropMin";
inline constexpr const char* kParamMax = "OfxParamPropMax";
inline constexpr const char* kParamDisplayMin = "OfxParamPropDisplayMin";
inline constexpr const char* kParamDisplayMax = "OfxParamPropDisplayMax";
inline constexpr const char* kParamHint = "OfxParamPropHint";
inline constexpr const char* kParamParent = "OfxParamPropParent";
inline constexpr const char* kParamGroupOpen = "OfxParamPropGroupOpen";
inline constexpr const char* kParamPageChild = "OfxParamPropPageChild";
inline constexpr const char* kParamChoiceOption = "OfxParamPropChoiceOption";
inline constexpr const char* kParamAnimates = "OfxParamPropAnimates";
inline constexpr const char* kParamEnabled = "OfxParamPropEnabled";
inline constexpr const char* kParamEvaluateOnChange = "OfxParamPropEvaluateOnChange";
inline constexpr const char* kParamPersistent = "OfxParamPropPersistant";
inline constexpr const char* kParamDoubleType = "OfxParamPropDoubleType";
inline constexpr const char* kDoubleTypePosition = "OfxParamDoubleTypeXYAbsolute";
inline constexpr const char* kParamCoordinates = "OfxParamPropDefaultCoordinateSystem";
inline constexpr const char* kCoordinatesNormalized = "OfxParamCoordinatesNormalised";
inline constexpr const char* kParamCacheInvalidation = "OfxParamPropCacheInvalidation";
inline constexpr const char* kInvalidateAll = "OfxParamInvalidateAll";
inline constexpr const char* kParamStringMode = "OfxParamPropStringMode";
inline constexpr const char* kStringIsMultiLine = "OfxParamStringIsMultiLine";
inline constexpr const char* kStringIsFilePath = "OfxParamStringIsFilePath";
inline constexpr const char* kHostAnimatesBooleans = "OfxParamHostPropSupportsBooleanAnimation";
inline constexpr const char* kHostAnimatesChoices = "OfxParamHostPropSupportsChoiceAnimation";

// Types of messages.
inline constexpr const char* kMessageError = "OfxMessageError";
inline constexpr const char* kMessageWarning = "OfxMessageWarning";

}  // namespace postchain::openfx
