/* GL for the examples: a loader of its functions, and textures. */
#ifndef HOST_GL_H
#define HOST_GL_H
#include <GL/glcorearb.h>
#include <postchain/postchain.h>
#include <string.h>
#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

/* A host has a loader of its own for GL's functions; this is the smallest. */
typedef void (*function)(void);
#ifdef _WIN32
static function gl_function(const char* name) {
    return (function)wglGetProcAddress(name); /* of a later version than 1.1 */
}
#else
static function gl_function(const char* name) {
    typedef function (*get_proc_address)(const char*);
    get_proc_address get = 0;
    void* symbol = dlsym(dlopen("libEGL.so.1", RTLD_NOW), "eglGetProcAddress");
    memcpy(&get, &symbol, sizeof(get)); /* ISO C does not cast it to a function */
    return get(name);
}
#endif
#define GL_FUNCTION(type, name) ((type)gl_function(#name))

static pc_texture make_texture(GLenum format, GLenum components, int width, int height,
                               const float* values) {
    pc_texture texture = {0, format, width, height, 0, 0};
    GL_FUNCTION(PFNGLCREATETEXTURESPROC, glCreateTextures)(GL_TEXTURE_2D, 1, &texture.name);
    GL_FUNCTION(PFNGLTEXTURESTORAGE2DPROC, glTextureStorage2D)
    (texture.name, 1, format, width, height);
    GL_FUNCTION(PFNGLTEXTURESUBIMAGE2DPROC, glTextureSubImage2D)
    (texture.name, 0, 0, 0, width, height, components, GL_FLOAT, values);
    return texture;
}
#endif
