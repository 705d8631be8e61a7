// Fuzz targets: every reader of untrusted text and bytes.
//
// One function per reader, called by libFuzzer (fuzzer.cpp, preset "fuzz") and by the replay of the
// corpus in every build (replay_test.cpp). A function runs the reader and everything that can be
// done with its result; a broken guarantee aborts with a line on stderr. Documentation:
// docs/testing.md.
#pragma once

#include <string_view>
#include <vector>

namespace postchain::fuzz {

// Return true if the reader accepted the input: the corpus must contain both kinds.
bool chain(std::string_view bytes);     // text, then texts of --set, each after a zero byte
bool camera(std::string_view bytes);    // config/camera_file.h
bool profile(std::string_view bytes);   // config/profile.h
bool sequence(std::string_view bytes);  // tools/sequence/files/sequence.h: range, pattern and input
bool exr(std::string_view bytes);       // a whole file, tools/sequence/exr/exr_reader.h
bool picture(std::string_view bytes);   // a PNG, TIFF, DPX, JPEG or HDR, image/image_file.h
bool request(std::string_view bytes);   // one HTTP request, tools/service/http (request_target.cpp)

struct Target {
    const char* name;  // also the folder in corpus/
    bool (*run)(std::string_view bytes);
};
const std::vector<Target>& targets();

}  // namespace postchain::fuzz
