// Header attributes and enumerations of OpenEXR as text, for inspect.
#pragma once

#include <ImfAttribute.h>
#include <ImfCompression.h>

#include <string>

namespace postchain::io {

const char* compression_name(Imf::Compression compression);  // "none", "zip", "dwaa", ...

// The value if its type has a short text, "(WxH preview)" for a thumbnail, otherwise "(type)".
std::string attribute_text(const Imf::Attribute& attribute);

}  // namespace postchain::io
