// The behavior `order` of gpu_like.cpp, which calls these beside the driver's functions. What a
// device might do in another order than llvmpipe ends the program.
#pragma once

#include <epoxy/gl.h>

#include <cstdint>
#include <string>

namespace postchain::test::order {

// Types of uniforms: glGet's name for the texture of a sampler, or GL_NONE, and whether it is an
// image.
GLenum texture_binding(GLint type);
bool is_image(GLint type);

void linked(GLuint program, const std::string& source);
void step_begins();  // dispatches of one step work on different pixels
void dispatches(GLuint program, bool indirect);
void passes_barrier(GLbitfield bits);

// By commands other than dispatches.
void writes_texture(GLuint texture);
void reads_texture(GLuint texture);
void writes_buffer(GLuint buffer);
void reads_buffer(GLuint buffer);
void deletes_texture(GLuint texture);
void deletes_buffer(GLuint buffer);

// Ranges of buffers that stay mapped. The device uses them until a later fence has passed.
void maps(GLuint buffer, void* memory);
void fills_range(GLuint buffer, GLintptr offset, GLsizeiptr bytes);
void takes_pixels(const void* place, GLsizeiptr bytes);
// The driver has put them there: they are taken away until then.
void brings_pixels(void* place, GLsizeiptr bytes);
void makes_fence();
void passes_fences(uint64_t count);  // all up to this one, from 1 on

}  // namespace postchain::test::order
