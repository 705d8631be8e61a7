// Header attributes and enumerations of OpenEXR as text, for inspect.
#pragma once

#include <ImfAttribute.h>
#include <ImfCompression.h>

#include <string>

namespace postchain::io {

const char* compression_name(Imf::Compression compression);  // "none", "zip", "dwaa", ...

// The value where the type has a short text; "(type)" otherwise, "(WxH preview)" for a thumbnail.
std::string attribute_text(const Imf::Attribute& attribute);

}  // namespace postchain::io
