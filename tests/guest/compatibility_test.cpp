// A host with a compatibility profile, as older engines and toolkits make it.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include "tests/guest/host.h"

namespace postchain::test::compatibility_test {
namespace {

class Compatibility : public ::testing::Test {
  protected:
    void SetUp() override {
        make_host_context();
        other_context_of_compatibility();
    }
    void TearDown() override { other_context_done(); }
};

// Mesa answers the query of a texture's target in core profiles alone.
TEST_F(Compatibility, TexturesAreValidated) {
    const auto host = canonical_frame(40, 24);
    const auto guest = instance(PC_VALIDATE);
    const auto made = chain("motion_blur,fxaa");
    GLint before = 0, after = 0;
    glGetIntegerv(GL_TEXTURE_BINDING_3D, &before);
    prepare_and_run(guest, made, host.frame);
    pc_frame frame = host.frame;
    frame.color_slice.target = GL_TEXTURE_2D_ARRAY;
    prepare(guest, made, frame);
    expect_error(pc_run(guest.get(), made.get(), &frame, nullptr), PC_ERROR_INPUT,
                 "is a GL_TEXTURE_2D; set color_slice.target to it");
    GLuint volume = 0;
    glCreateTextures(GL_TEXTURE_3D, 1, &volume);
    glTextureStorage3D(volume, 1, GL_RGBA32F, 40, 24, 2);
    frame = host.frame;
    frame.color.name = volume;
    expect_error(pc_run(guest.get(), made.get(), &frame, nullptr), PC_ERROR_INPUT,
                 "is a GL_TEXTURE_3D; only GL_TEXTURE_2D and");
    glDeleteTextures(1, &volume);
    EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR));
    glGetIntegerv(GL_TEXTURE_BINDING_3D, &after);
    EXPECT_EQ(after, before);
}

}  // namespace
}  // namespace postchain::test::compatibility_test
