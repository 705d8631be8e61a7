/* clang-format off: it runs the paragraphs below together. */
/* The chain as a guest in a host's own OpenGL 4.5 context. C11 and C++20.
 *
 *   pc_create()  pc_chain_create()  pc_prepare()      once
 *   pc_run()                                          every frame
 *
 * How to begin, and the conventions of common engines: docs/integration.md.
 *
 * Threads   An instance belongs to the GL context that was current when it was made. Calls marked
 *           [GL] need that context current on the calling thread; with another one, or none, they
 *           return PC_ERROR_CONTEXT and call no GL. Two calls on one object never at once.
 * Structs   The host zeroes a struct and sets struct_size = sizeof. 0 is every member's default.
 *           Another size is PC_ERROR_VERSION.
 * Errors    A result < 0 is a failure: the text is in pc_last_error() and goes to the log. Nothing
 *           throws, aborts or exits. pc_run() then has dispatched nothing, output is untouched, and
 *           the result is the host's own color.
 * A frame   Once a kind of frame has run, pc_run() makes no GL object, compiles, allocates, reads
 *           back and waits for nothing, as long as the values that its plan rests on stay: chain,
 *           sizes, formats, conventions, lens, bounds. Where these change, the plan is made again
 *           (on the CPU: it allocates), and its uniforms are filled in place; textures are made
 *           only for new sizes, and programs never: that is pc_prepare()'s.
 * GL state  Touched by pc_run(): program, uniform buffer 0, storage buffers, images, textures
 *           (GL_TEXTURE_2D) and sampler objects of the first units (at most 16 of each), the
 *           indirect buffer. Left as pc_state says. Nothing else, by any call; no framebuffer, no
 *           vertex array, no pixel store.
 * GL error  The flag is the host's. It is read with PC_VALIDATE, and where GL itself refused an
 *           allocation, so that this error is not left behind.
 * Loading   GL is resolved by libepoxy, from whichever of EGL and GLX made the current context.
 */
/* clang-format on */
#ifndef POSTCHAIN_POSTCHAIN_H
#define POSTCHAIN_POSTCHAIN_H
#include <stddef.h>
#include <stdint.h>
#ifndef PC_API
#define PC_API __attribute__((visibility("default")))
#endif
#ifdef __cplusplus
extern "C" {
#endif
#define PC_API_VERSION 0x00010000u /* major << 16 | minor; another major is PC_ERROR_VERSION */

typedef struct pc_instance pc_instance; /* programs, textures, timers of one context */
typedef struct pc_chain pc_chain;       /* passes and their values: no GL */

typedef int32_t pc_result;
enum {
    PC_OK = 0,
    PC_PENDING = 1, /* programs are still to be compiled, timings not there yet: ask again */
    PC_ERROR_ARGUMENT = -1, /* a call's argument */
    PC_ERROR_CHAIN = -2,    /* the chain or its values, or the camera they need */
    PC_ERROR_INPUT = -3,    /* a texture of the frame, or one that is missing */
    PC_ERROR_CONTEXT = -4,  /* none, another one, below 4.5, or lost */
    PC_ERROR_MEMORY = -5,   /* the budget, or GL's own */
    PC_ERROR_VERSION = -6,  /* api_version or struct_size */
    PC_ERROR_PREPARE = -7,  /* pc_prepare() has not seen a frame like this */
    PC_ERROR_GL = -8,       /* a program does not compile; with PC_VALIDATE any GL error */
    PC_ERROR_INTERNAL = -9  /* a defect of this library */
};
PC_API const char* pc_result_name(pc_result); /* "PC_OK"; never NULL */

enum { PC_LOG_ERROR = 0, PC_LOG_WARNING = 1, PC_LOG_INFO = 2 };

typedef uint32_t pc_state;
enum {
    PC_STATE_RESTORE = 0, /* read before, put back after */
    PC_STATE_RESET = 1, /* GL's initial values; a texture unit that was touched holds none at all */
    PC_STATE_LEAVE = 2  /* as the last step had it */
};

/* ------------------------------------------------------------------------------------ instance */
enum {
    PC_VALIDATE = 1,   /* for development: names, targets, sizes and formats of the host's textures,
                          and GL's error flag, are checked at every pc_run() */
    PC_LABELS = 2,     /* KHR_debug groups and labels */
    PC_OWN_CONTEXT = 4 /* makes an EGL context of its own, without a window, current on this thread;
                          PC_ERROR_CONTEXT where one is current already */
};
typedef struct pc_create_info {
    uint32_t struct_size;
    uint32_t api_version; /* PC_API_VERSION */
    uint32_t flags;       /* PC_VALIDATE ... */
    pc_state state;
    void* user; /* first argument of the callbacks */
    /* May be NULL. The library resolves GL itself; this one is asked at pc_create() whether it
     * leads to the same GL as the current context, and that is all. */
    void* (*get_proc_address)(void* user, const char* name);
    void (*log)(void* user, int level, const char* message); /* PC_LOG_*; no newline; may be NULL */
    uint64_t texture_budget; /* bytes; 0 = none; beyond it PC_ERROR_MEMORY */
    uint32_t keep_frames;    /* textures that so many pc_run() did not use are freed; 0 = 8 */
    uint32_t reserved;
} pc_create_info;
/* [GL] On failure *instance is NULL, and the text is in pc_create_error(). */
PC_API pc_result pc_create(const pc_create_info* info, pc_instance** instance);
PC_API const char* pc_create_error(void); /* of this thread's last pc_create(), pc_chain_create() or
                                             pc_chain_from_text(); "" = none */
PC_API void pc_destroy(pc_instance*);     /* [GL] with another context current, as pc_abandon() */
PC_API void pc_abandon(pc_instance*);     /* the context is gone: frees memory, calls no GL */
PC_API const char* pc_last_error(const pc_instance*); /* "" = none; until the next call */
typedef struct pc_capabilities {
    uint32_t struct_size, api_version;
    uint32_t software; /* a software renderer: its GL timers are wrong, pc_timings() waits there */
    uint32_t max_texture_px;
    uint32_t gl_version; /* 45, 46 */
    uint32_t reserved;
    char renderer[128], version[64]; /* GL's words; the library's */
} pc_capabilities;
PC_API pc_result pc_query(const pc_instance*, pc_capabilities*);

/* --------------------------------------------------------------------------------------- chain */
/* `passes`: names in the order they run, "motion_blur,fxaa,depth_of_field"; pc_pass() lists them.
 * From the text of a chain file: pc_chain_from_text(), config/chain_from_text.h. */
PC_API pc_result pc_chain_create(const char* passes, pc_chain** chain);
PC_API void pc_chain_destroy(pc_chain*);
PC_API const char* pc_chain_error(const pc_chain*); /* "" = none; until the next call */
/* Every pass that this library has, from 0; PC_ERROR_ARGUMENT = there are no more. `name` and
 * `help` live as long as the library. */
PC_API pc_result pc_pass(uint32_t index, const char** name, const char** help);

#define PC_CAMERA \
    0xffffffffu /* in place of a pass: lens, aperture and shutter that the chain sets */
enum { PC_COST_UNIFORM = 0, PC_COST_PROGRAM = 1, PC_COST_TEXTURE = 2 };
typedef struct pc_parameter { /* strings live until the chain is changed or destroyed */
    uint32_t struct_size;
    uint32_t pass; /* place in the chain, or PC_CAMERA */
    const char *pass_name, *key;
    const char* type;           /* "boolean", "integer", "number", "choice", "text", "point" */
    const char* unit;           /* "px", "frames", ...; "" = none */
    const char* help;           /* one line */
    const char* const* choices; /* of a choice */
    uint32_t choice_count;
    uint32_t is_set;                            /* 0: may be left unset, and is */
    double min, max, soft_min, soft_max, value; /* value: of boolean, integer, number */
    const char* text;                           /* the value as text, as a chain file has it */
    /* What another value may cost: a uniform, programs (pc_prepare() once more), textures too.
     * Found by planning a frame with values from the middle of the usual range; the ends, where a
     * pass may be off, can cost more. */
    uint32_t cost, reserved;
} pc_parameter;
/* All rows of all passes, then those of the camera; PC_ERROR_ARGUMENT = index is past the last. */
PC_API pc_result pc_chain_parameter(pc_chain*, uint32_t index, pc_parameter*);
/* PC_ERROR_CHAIN with the range where the value is out of it; the old one stays. */
PC_API pc_result pc_chain_set_number(pc_chain*, uint32_t pass, const char* key, double value);
PC_API pc_result pc_chain_set_text(pc_chain*, uint32_t pass, const char* key, const char* value);
PC_API pc_result pc_chain_set_point(pc_chain*, uint32_t pass, const char* key, double x, double y);
/* A picture of the aperture: 128 x 128 linear transmittances >= 0, rows from the top, as it is seen
 * in a highlight behind the focus. */
PC_API pc_result pc_chain_set_aperture(pc_chain*, const float* values);
PC_API pc_result pc_chain_unset(pc_chain*, uint32_t pass, const char* key);

/* --------------------------------------------------------------------------------------- frame */
typedef struct pc_texture { /* the host's; not kept beyond the call, never written but as output */
    uint32_t name;          /* of a GL_TEXTURE_2D; 0 = there is none */
    uint32_t internal_format; /* sized: GL_RGBA16F, GL_DEPTH_COMPONENT32F, ... */
    int32_t width, height;    /* of level 0 */
    int32_t x, y;             /* where the frame's rectangle begins, in texels as stored */
} pc_texture;

typedef uint32_t pc_depth;
enum {
    PC_DEPTH_LINEAR = 0,           /* distance along the view axis, scene units */
    PC_DEPTH_INVERSE = 1,          /* 1/distance */
    PC_DEPTH_FORWARD = 2,          /* 0 at near, 1 at far */
    PC_DEPTH_FORWARD_INFINITE = 3, /* far is at infinity */
    PC_DEPTH_REVERSE = 4,          /* 1 at near, 0 at far */
    PC_DEPTH_REVERSE_INFINITE = 5
};
enum {
    PC_CAMERA_CUT = 1,      /* the vectors lead across a cut: they are not used */
    PC_TOP_LEFT = 2,        /* row 0 of the textures is the top; else the bottom, GL's own */
    PC_MOTION_TO_NEXT = 4,  /* vectors point at the next frame; else they are this minus previous,
                               and the motion is taken to go on */
    PC_MOTION_JITTERED = 8, /* vectors hold the difference of jitter_px and other_jitter_px: it is
                               taken out */
    PC_HALF_PLANES = 16,    /* planes in between are stored as halves */
    PC_NO_ELISION = 32      /* every pass does its whole work; the picture is the same */
};
typedef struct pc_frame {
    uint32_t struct_size, flags;
    uint64_t frame_number; /* seeds; names the frame in pc_timings() */
    int32_t width, height; /* of the frame's rectangle; 0 = from color's x, y to its end */
    pc_texture color;      /* scene-linear, premultiplied; float, unorm or sRGB */
    pc_texture depth;      /* its first component; a depth format or float */
    pc_texture motion;     /* its first two components; float or norm */
    pc_texture exposure;   /* a factor in its texel (x, y): passes see color times this, the result
                              does not have it; optional, never read back */
    pc_texture output;     /* written by the last step; 0 = a texture of the library's own. May be
                              color. GL_RGBA8, GL_RGBA16, GL_RGBA16F, GL_RGBA32F, GL_RGB10_A2 or
                              GL_R11F_G11F_B10F */
    pc_depth depth_encoding;
    float near_clip, far_clip; /* scene units */
    /* (stored - motion_bias) * motion_scale = texels of this frame, y counted as rows are stored. 0
     * = 1. Of normalized device coordinates: {w/2, h/2}; of uv: {w, h}. */
    float motion_scale[2], motion_bias[2];
    /* Of this frame, and of the one that the vectors lead to or from; in the same texels. */
    float jitter_px[2], other_jitter_px[2];
    float pre_exposure; /* color is scene-linear times this, and so is the result; 0 = 1 */
    float focal_length_mm, sensor_width_mm, f_stop, focus_distance; /* 0 = not known */
    float meters_per_unit, shutter_frames; /* 0 = 1; 0 = 0.5. A closed shutter is a value < 0 */
    float max_speed_px, nearest, farthest; /* bounds that the host knows, of the whole frame, with
                                              distances in scene units; 0 = not known; must hold */
    /* World to clip space of this frame and of the one that the vectors lead to or from, columns
     * first, without jitter; y up. All 0 = not known. With both, pixels that are infinitely far and
     * have no vector get the camera's motion. */
    float view_projection[16], other_view_projection[16];
    uint32_t barriers; /* GL_*_BARRIER_BIT of the result's use besides texture fetches */
    uint32_t reserved;
    const char* debug_view; /* name of one of the plan's textures or work lists (pc_explain()),
                               "0.motion_blur.tile_max": drawn instead of the picture */
} pc_frame;

/* Sets depth_encoding, flags of rows and vectors, motion_scale and motion_bias as an engine has
 * them: "unity", "unreal", "bevy", "godot", "falcor", "g3d". frame->width and height must be set.
 * What each rests on: docs/integration.md. Check the result with pc_check_motion(). */
PC_API pc_result pc_use_conventions(const char* engine, pc_frame*);

/* [GL] Compiles the programs of every frame of this kind (textures, formats, conventions, size),
 * whatever its lens, shutter, bounds, cut, matrices and gain; makes this frame's textures. wait = 0:
 * compiles one program at most, and returns PC_PENDING until none is left. */
PC_API pc_result pc_prepare(pc_instance*, pc_chain*, const pc_frame*, int wait);
/* [GL] Filters one frame. *result (may be NULL) is the output, or a texture of the library's that
 * holds until the next pc_run(), or color itself where nothing had to be done and there is no
 * output; rows as in color. A closed or missing pass is no error. */
PC_API pc_result pc_run(pc_instance*, pc_chain*, const pc_frame*, pc_texture* result);

/* --------------------------------------------------------------------------------- what it did */
typedef struct pc_time {
    char name[48]; /* "motion_blur", at level 2 "motion_blur.gather"; "import" and "export" are the
                      conversion from and to the host's textures */
    float milliseconds;
} pc_time;
PC_API pc_result pc_set_timing(pc_instance*, int level); /* 0 off, 1 passes, 2 steps */
/* [GL] Of the newest frame that the device has finished; PC_PENDING = there is none. Never waits.
 * *count: in, room in times; out, how many there are. (On a software renderer, where GL's timers
 * are wrong, pc_run() waits for every interval while timing is on.) */
PC_API pc_result pc_timings(pc_instance*, pc_time* times, uint32_t* count, uint64_t* frame_number);
typedef struct pc_counters { /* since pc_create(), but for what is alive now */
    uint32_t struct_size, reserved;
    uint64_t frames, dispatches, barriers;
    uint64_t programs, plans_made, texture_allocations;
    uint64_t textures_alive, texture_bytes, texture_bytes_peak;
} pc_counters;
PC_API pc_result pc_count(const pc_instance*, pc_counters*);
/* The last frame's plan as JSON: steps, textures, what was left out and why. *size: in, room in
 * text; out, bytes with the final 0. PC_ERROR_ARGUMENT where the room is too small: nothing is
 * written. */
PC_API pc_result pc_explain(const pc_instance*, char* text, size_t* size);

/* [GL] For development: reads back, and waits. Warps the color of `frame` by its vectors, under
 * each sign of x and y, and compares with the color of the next frame (of the previous one without
 * PC_MOTION_TO_NEXT). The signs that fit best, 1 or -1, come out: {1, 1} = the conventions are
 * right. *margin: how much worse the second best is; below 1.1 nothing is decided (a frame without
 * motion, or with motion along one axis alone). */
PC_API pc_result pc_check_motion(pc_instance*, const pc_frame* frame, const pc_texture* other_color,
                                 int signs[2], float* margin);
#ifdef __cplusplus
}
#endif
#endif
