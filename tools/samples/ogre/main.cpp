// A sample engine: OGRE 1.12 with the chain as a pass of its compositor.
//
// ogre_host [FRAMES [IMAGE.png [CHAIN [weapon]]]]: ends after FRAMES frames (0 = when it is
// interrupted), and writes the last one. CHAIN is a list of passes, default "joint_blur,fxaa";
// `weapon`: the camera carries one, which a mask keeps sharp. Also builds on its own:
// CMakeLists.txt. Files:
//
//   postchain_pass.*   the chain as a pass of the compositor; copy this one
//   motion_vectors.*   each object's matrix in the previous frame, for the velocity
//   media/             the compositor's script, materials, shaders, the overlay
//   host.*  scene.*    start of OGRE, and a scene
#include <cstdio>
#include <cstdlib>
#include <string>

#include "host.h"

namespace {

int fail(const char* who, const std::string& why) {
    std::fprintf(stderr, "%s: %s\n", who, why.c_str());
    return 1;
}

int run(host::Host& host, int frames, const char* picture, const char* passes) {
    pc_chain* chain = nullptr;
    if (pc_chain_create(passes, &chain) != PC_OK) return fail("postchain", pc_error());
    host.postchain().set_chain(chain);
    for (int i = 0; frames == 0 || i < frames; ++i) {
        host.set_text("frame " + std::to_string(i) + "\n" + passes);
        host.draw(i);
        // The frame was shown as OGRE drew it.
        if (!host.postchain().error().empty()) return fail("postchain", host.postchain().error());
    }
    if (picture != nullptr) host.window().writeContentsToFile(picture);
    return 0;
}

}  // namespace

int main(int count, char** arguments) {
    try {
        host::HostSettings settings;
        settings.first_person = count > 4 && std::string(arguments[4]) == "weapon";
        host::Host host(settings);
        try {
            return run(host, count > 1 ? std::atoi(arguments[1]) : 0,
                       count > 2 ? arguments[2] : nullptr,
                       count > 3 ? arguments[3] : "joint_blur,fxaa");
        } catch (const Ogre::Exception& error) {
            return fail("OGRE", error.getDescription());
        }
    } catch (const std::exception& error) {
        return fail("OGRE", error.what());
    }
}
