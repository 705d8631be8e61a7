# cmake -DROOT=dir -DFILES=a;b -DOUTPUT=x.cpp -DFUNCTION=name -P embed.cmake
# Writes a C++ file that holds each file of ROOT as a string, found by its path under ROOT.
set(body "")
foreach(file IN LISTS FILES)
  file(READ ${ROOT}/${file} hex HEX)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
  string(APPEND body "    {static const unsigned char bytes[] = {${bytes}0};\n"
         "     files.push_back({\"${file}\", {reinterpret_cast<const char*>(bytes), sizeof(bytes) - 1}});}\n")
endforeach()
file(WRITE ${OUTPUT}.new
"// Made by shaders/embed.cmake.
#include \"shaders/embedded.h\"
namespace postchain {
const std::vector<EmbeddedFile>& ${FUNCTION}() {
  static const std::vector<EmbeddedFile> all = [] {
    std::vector<EmbeddedFile> files;
${body}    return files;
  }();
  return all;
}
}  // namespace postchain
")
file(COPY_FILE ${OUTPUT}.new ${OUTPUT} ONLY_IF_DIFFERENT)
