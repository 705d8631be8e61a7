/* The chain as a guest in a host's own OpenGL 4.5 context. C11 and C++20. */
/*                                                                         */
/*   pc_create()  pc_chain_create()  pc_prepare()      once                */
/*   pc_run()                                          every frame         */
/*                                                                         */
/* Introduction and the conventions of common engines: docs/integration.md. Guarantees for later
 * versions: docs/compatibility.md. */

/* Threads: an instance belongs to the GL context that was current when it was created. Calls marked
 * [GL] need that context current on the calling thread. With another context, or none, they return
 * PC_ERROR_CONTEXT and call no GL. Two threads cannot be in calls on one instance: the second one
 * gets PC_ERROR_ARGUMENT. Any thread may change a chain while another renders with it: a call on an
 * instance has the values that the chain had when it began. */

/* Structs: the host zeroes a struct and sets struct_size = sizeof. 0 is every member's default. A
 * host may be compiled with an older or a newer header than the library: members that a smaller
 * struct lacks are 0, and a larger struct, up to 65536 bytes, is accepted if the members that the
 * library does not know are 0. Otherwise, and if a flag or a reserved member is set that it does
 * not know, the call returns PC_ERROR_VERSION. pc_texture, pc_slice and pc_time have no struct_size
 * and never change. */

/* Errors: a result < 0 is a failure. pc_error() has its text, whichever call it was; that of a call
 * on an instance also goes to the log. No call throws, aborts or exits. A handle that is NULL,
 * foreign or destroyed is PC_ERROR_ARGUMENT, and one that a callback or another thread destroys
 * within a call on it is not destroyed. A failed pc_run() has dispatched nothing but the step of
 * `focus_at`, and has not written the output, except with PC_VALIDATE for PC_ERROR_GL, which is
 * found afterwards. Its result is the host's own color, or 0 if pc_frame cannot be read. */

/* A frame: once a kind of frame has run, pc_run() creates no GL object but a fence every fourth
 * frame, does not compile, allocate, plan or read back, and waits only if the device is eight
 * frames behind (with `focus_at` a fence every frame, and four frames). Sizes up to the largest,
 * lens, shutter, bounds, matrices and gain are values. It plans on the CPU, which allocates, if a
 * parameter of the chain, a format or a convention is new, or a pass that was skipped begins to
 * work. It creates textures only for a larger frame or another chain. Only pc_prepare() compiles
 * programs. */

/* GL state: pc_run() changes program, uniform buffer 0, storage buffers, images, textures
 * (GL_TEXTURE_2D, and GL_TEXTURE_2D_ARRAY for the debug view "fill", a mask, and arrays of the
 * host) and sampler objects of the first units (at most 16 of each), and the indirect buffer. It
 * leaves them as pc_state says. No call changes other state, such as framebuffer, vertex array or
 * pixel store. The error flag belongs to the host. The library reads it with PC_VALIDATE, and after
 * GL refused an allocation, so that this error does not stay set. libepoxy resolves GL from EGL or
 * GLX, whichever made the current context, on Windows from WGL. */
#ifndef POSTCHAIN_POSTCHAIN_H
#define POSTCHAIN_POSTCHAIN_H
#include <stddef.h>
#include <stdint.h>
/* On Windows a host that links the archives, not the DLLs, defines PC_STATIC. */
#ifndef PC_API
#if defined(_WIN32) && !defined(PC_STATIC)
#define PC_API __declspec(dllimport)
#elif defined(__GNUC__)
#define PC_API __attribute__((visibility("default")))
#else
#define PC_API
#endif
#endif
#ifdef __cplusplus
extern "C" {
#endif
#define PC_API_VERSION 0x00010003u /* major << 16 | minor; another major is PC_ERROR_VERSION */

PC_API const char* pc_version(void); /* of the library: "MAJOR.MINOR.PATCH" */

typedef struct pc_instance pc_instance; /* programs, textures, timers of one context */
typedef struct pc_chain pc_chain;       /* passes and their values; uses no GL */

typedef int32_t pc_result;
enum {
    PC_OK = 0,
    PC_PENDING = 1,         /* programs are not compiled or timings not available yet: call again */
    PC_ERROR_ARGUMENT = -1, /* an argument of the call */
    PC_ERROR_CHAIN = -2,    /* the chain, its values, or the camera that they need */
    PC_ERROR_INPUT = -3,    /* a texture of the frame, or a missing one */
    PC_ERROR_CONTEXT = -4,  /* no context, another one, one below 4.5, or a lost one */
    PC_ERROR_MEMORY = -5,   /* texture_budget is exceeded, or GL is out of memory */
    PC_ERROR_VERSION = -6,  /* api_version or struct_size */
    PC_ERROR_PREPARE = -7,  /* pc_prepare() was not called for a frame of this kind */
    PC_ERROR_GL = -8,       /* a program does not compile; with PC_VALIDATE any GL error */
    PC_ERROR_INTERNAL = -9  /* a defect of this library */
};
PC_API const char* pc_result_name(pc_result); /* "PC_OK"; never NULL */

enum { PC_LOG_ERROR = 0, PC_LOG_WARNING = 1, PC_LOG_INFO = 2 };

typedef uint32_t pc_state;
enum {
    PC_STATE_RESTORE = 0, /* read before and restored after: about 70 glGet a frame, each of which
                             waits for the driver's thread if it has one. Not kept: subroutine
                             uniforms, a program that was deleted while in use, and names that
                             another context has deleted, for which GL has an error */
    PC_STATE_RESET = 1,   /* GL's initial values; texture units that were used have no texture.
                             Recommended: reads nothing. A host that caches its state invalidates
                             what pc_run() changes (GL state, above) */
    PC_STATE_LEAVE = 2    /* as the last step left it */
};

/* ------------------------------------------------------------------------------------ instance */
typedef uint32_t pc_create_flags;
enum {
    PC_VALIDATE = 1,   /* for development: every pc_run() checks names, targets, sizes and formats
                          of the host's textures, bounds, lens and matrices of the frame, and GL's
                          error flag */
    PC_LABELS = 2,     /* KHR_debug groups and labels */
    PC_OWN_CONTEXT = 4 /* creates an EGL context without a window (on Windows one of WGL, with a
                          hidden window) and makes it current on this thread; PC_ERROR_CONTEXT if a
                          context is current already */
};
typedef struct pc_create_info {
    uint32_t struct_size;
    uint32_t api_version; /* PC_API_VERSION */
    pc_create_flags flags;
    pc_state state;
    void* user; /* first argument of the callbacks */
    /* May be NULL. The library resolves GL itself. pc_create() only checks that this function
     * leads to the same GL as the current context. */
    void* (*get_proc_address)(void* user, const char* name);
    void (*log)(void* user, int level, const char* message); /* PC_LOG_*; no newline; may be NULL */
    uint64_t texture_budget; /* bytes; 0 = no limit; beyond it PC_ERROR_MEMORY */
    uint32_t keep_frames;    /* a texture is freed after this many pc_run() without use; 0 = 8.
                                Give at least the number of chains that run in turn */
    uint32_t reserved;
    /* The largest frame: textures are made for it, and a smaller frame changes uniforms
     * alone. A larger one is filtered too, with new textures, for keep_frames frames. 0 = the
     * largest frame seen, if the host gives `output`; textures shrink after keep_frames frames of
     * half its sides at most. */
    uint32_t max_width, max_height;
    /* A cache of program binaries; each may be NULL. Called within [GL] calls. Instances and
     * processes may share it: keys tell devices, drivers and versions of a program apart, and bytes
     * that are damaged are not used. load_program() returns the size of the entry, 0 = none, and
     * copies it if `room` suffices. */
    size_t (*load_program)(void* user, const char* key, void* bytes, size_t room);
    void (*store_program)(void* user, const char* key, const void* bytes, size_t size);
} pc_create_info;
/* [GL] On failure *instance is NULL, and the text is in pc_error(). */
PC_API pc_result pc_create(const pc_create_info* info, pc_instance** instance);
/* The text of this thread's last call that returned a pc_result; "" = none. Valid until
 * this thread's next call. */
PC_API const char* pc_error(void);
PC_API const char* pc_create_error(void); /* pc_error() by its former name */
PC_API void pc_destroy(pc_instance*);     /* [GL] with another context current, as pc_abandon() */
PC_API void pc_abandon(pc_instance*);     /* for a lost context: frees memory, calls no GL */
/* The text of the instance's last call that may change it; "" = none; valid until the next one. */
PC_API const char* pc_last_error(const pc_instance*);
typedef struct pc_capabilities {
    uint32_t struct_size, api_version;
    uint32_t software; /* a software renderer, whose GL timers are wrong (pc_timings()) */
    uint32_t max_texture_px;
    uint32_t gl_version; /* 45, 46 */
    uint32_t reserved;
    char renderer[128], version[64]; /* GL_RENDERER; pc_version() */
} pc_capabilities;
/* The device of an instance. */
PC_API pc_result pc_query(const pc_instance*, pc_capabilities*);

/* --------------------------------------------------------------------------------------- chain */
/* `passes`: names in the order they run, "motion_blur,fxaa,depth_of_field"; pc_pass() lists them.
 * Or a tier: "tier:fast"; pc_tier() lists them. pc_chain_from_text() (config/chain_from_text.h)
 * reads the text of a chain file instead. PC_ERROR_CHAIN: an unknown pass or tier, whose closest
 * name the text has; no pass, an empty name, or more than PC_MAX_PASSES. On failure *chain is NULL.
 */
#define PC_MAX_PASSES 64
PC_API pc_result pc_chain_create(const char* passes, pc_chain** chain);
PC_API void pc_chain_destroy(pc_chain*);
/* "" = none; valid until the next call. If several threads use the chain, read pc_error(). */
PC_API const char* pc_chain_error(const pc_chain*);
/* Passes of this library, index from 0; PC_ERROR_ARGUMENT = index is past the last. `name` and
 * `help` stay valid as long as the library is loaded. */
PC_API pc_result pc_pass(uint32_t index, const char** name, const char** help);
/* Likewise tiers, the quickest first: passes with their values. */
PC_API pc_result pc_tier(uint32_t index, const char** name, const char** help);

#define PC_CAMERA 0xffffffffu /* instead of a pass: the chain's own lens, aperture and shutter */
enum { PC_COST_UNIFORM = 0, PC_COST_PROGRAM = 1, PC_COST_TEXTURE = 2 };
typedef struct pc_parameter { /* strings stay valid until the chain is changed or destroyed */
    uint32_t struct_size;
    uint32_t pass; /* index in the chain, or PC_CAMERA */
    const char *pass_name, *key;
    const char* type;           /* "boolean", "integer", "number", "choice", "text", "point" */
    const char* unit;           /* "px", "frames", ...; "" = none */
    const char* help;           /* one line */
    const char* const* choices; /* of a choice */
    uint32_t choice_count;
    uint32_t is_set;                     /* 0: an optional value that is not set */
    double min, max, soft_min, soft_max; /* allowed and usual range, in `unit` */
    double value;                        /* of boolean (0, 1), integer, number; otherwise 0 */
    const char* text;                    /* the value as a chain file has it */
    /* PC_COST_*: another value makes pc_run() plan again on the CPU and costs uniforms, or programs
     * (pc_prepare() again), or textures too. It is found by planning a frame with values from the
     * middle of the usual range. At the ends of the range, which may switch a pass off, the cost
     * can be higher. */
    uint32_t cost, reserved;
} pc_parameter;
/* Rows of all passes, then of the camera; PC_ERROR_ARGUMENT = index is past the last. */
PC_API pc_result pc_chain_parameter(pc_chain*, uint32_t index, pc_parameter*);
/* PC_ERROR_CHAIN: no such key, or a value outside its range; the text has the closest key or the
 * range, and the old value stays. PC_ERROR_ARGUMENT: no such pass. `value` of a boolean: 0 or 1. */
PC_API pc_result pc_chain_set_number(pc_chain*, uint32_t pass, const char* key, double value);
/* A choice by its name. Errors: the same. */
PC_API pc_result pc_chain_set_text(pc_chain*, uint32_t pass, const char* key, const char* value);
/* x, y: of a key such as "focus_at", 0 to 1: fractions of the frame from the top left. Errors: as
 * pc_chain_set_number(). */
PC_API pc_result pc_chain_set_point(pc_chain*, uint32_t pass, const char* key, double x, double y);
/* An image of the aperture: 128 * 128 floats, linear transmittances >= 0, rows from the top,
 * oriented as in a highlight behind the focus; copied. PC_ERROR_INPUT: a value is negative or not
 * finite, or all are 0. */
PC_API pc_result pc_chain_set_aperture(pc_chain*, const float* values);
/* The value counts as not given. PC_ERROR_CHAIN: it is not optional (pc_parameter.is_set). */
PC_API pc_result pc_chain_unset(pc_chain*, uint32_t pass, const char* key);

typedef uint32_t pc_mask_effect; /* on the object that pc_frame.mask covers; docs/layers.md */
enum {
    PC_MASK_UNBLURRED = 0, /* unchanged, and without a trace in its surroundings */
    PC_MASK_UNMOVED = 1,   /* no motion blur, but out of focus as all else; only for passes that
                              read motion */
    PC_MASK_IGNORED = 2
};
/* Initially PC_MASK_UNBLURRED for every pass. If a chain's text names mattes, passes with `matte:
 * mask` have the effect of their `matte_effect`, and the others PC_MASK_IGNORED. */
PC_API pc_result pc_chain_set_mask(pc_chain*, uint32_t pass, pc_mask_effect effect);

/* --------------------------------------------------------------------------------------- frame */
typedef struct pc_texture { /* the host's; not kept beyond the call, and written only as output */
    uint32_t name;          /* of a GL_TEXTURE_2D, if no pc_slice says otherwise; 0 = no texture */
    uint32_t internal_format; /* sized: GL_RGBA16F, GL_DEPTH_COMPONENT32F, ... */
    int32_t width, height;    /* of level 0, or of the level of the pc_slice */
    int32_t x, y;             /* first texel of the frame's rectangle, as stored */
} pc_texture;
typedef struct pc_slice { /* the image of a texture that counts, such as the layer of an eye */
    uint32_t target;      /* GL_TEXTURE_2D_ARRAY; 0 = GL_TEXTURE_2D */
    int32_t layer, level;
} pc_slice;

typedef uint32_t pc_depth;
enum {
    PC_DEPTH_LINEAR = 0,           /* distance along the view axis, scene units */
    PC_DEPTH_INVERSE = 1,          /* 1/distance */
    PC_DEPTH_FORWARD = 2,          /* 0 at near, 1 at far */
    PC_DEPTH_FORWARD_INFINITE = 3, /* far is at infinity */
    PC_DEPTH_REVERSE = 4,          /* 1 at near, 0 at far */
    PC_DEPTH_REVERSE_INFINITE = 5
};
typedef uint32_t pc_frame_flags;
enum {
    PC_CAMERA_CUT = 1,      /* the motion vectors cross a camera cut and are ignored. Set and clear
                               this bit alone: the others describe the textures */
    PC_TOP_LEFT = 2,        /* row 0 of the textures is the top. With neither PC_TOP_LEFT nor
                               PC_BOTTOM_LEFT it is the bottom in GL, the top in Vulkan */
    PC_MOTION_TO_NEXT = 4,  /* vectors point to the next frame; otherwise they are this minus
                               previous, and the motion is assumed to continue */
    PC_MOTION_JITTERED = 8, /* vectors contain the difference of jitter_px and other_jitter_px,
                               which is then subtracted */
    PC_HALF_PLANES = 16,    /* intermediate planes are stored as halves */
    PC_NO_ELISION = 32,     /* no pass skips work; the result is the same */
    PC_GIVEN_SHUTTER = 64,  /* shutter_frames counts as it is: 0 is a closed shutter */
    PC_HALF_RESOLUTION = 128, /* passes run on half the width and height, and what they do not blur
                                 keeps its detail; errors: docs/integration.md. Needs `output`, not
                                 over color */
    PC_FAST_MATH = 256,       /* the driver's compiler may contract and reorder arithmetic: less
                                 time on a GPU, and results that differ by rounding from program
                                 to program: docs/integration.md */
    PC_BOTTOM_LEFT = 512      /* row 0 of the textures is the bottom */
};
typedef struct pc_frame {
    uint32_t struct_size;
    pc_frame_flags flags;
    uint64_t frame_number; /* seed of random numbers; identifies the frame in pc_timings() */
    int32_t width, height; /* of the frame's rectangle; 0 = from color's x, y to its end */
    pc_texture color;      /* scene-linear, premultiplied; float, unorm or sRGB */
    pc_texture depth;      /* its first component; a depth format or float */
    pc_texture motion;     /* its first two components; float or norm */
    pc_texture exposure;   /* optional; its texel (x, y) is a factor: passes read color times this
                              factor, and the result is divided by it; never read back */
    pc_texture output;     /* written by the last step; 0 = a texture of the library. May be color.
                              GL_RGBA8, GL_RGBA16, GL_RGBA16F, GL_RGBA32F, GL_RGB10_A2 or
                              GL_R11F_G11F_B10F */
    pc_depth depth_encoding;
    float near_clip, far_clip; /* scene units */
    /* (stored - motion_bias) * motion_scale = texels of this frame, with y in the order of stored
     * rows. 0 = 1. For normalized device coordinates: {w/2, h/2}; for uv: {w, h}. */
    float motion_scale[2], motion_bias[2];
    /* Jitter of this frame, and of the frame that the vectors point to or come from; same texels.
     */
    float jitter_px[2], other_jitter_px[2];
    float pre_exposure; /* color is scene-linear times this, and so is the result; 0 = 1 */
    float focal_length_mm, sensor_width_mm, f_stop, focus_distance; /* 0 = unknown */
    float meters_per_unit, shutter_frames; /* 0 = 1; 0 = 0.5 without PC_GIVEN_SHUTTER;
                                              < 0 is a closed shutter */
    float max_speed_px, nearest, farthest; /* bounds of the whole frame, with distances in scene
                                              units; 0 = unknown; must hold */
    /* World to clip space of this frame, and of the frame that the vectors point to or come from:
     * columns first, without jitter, y up. All 0 = unknown. With both, pixels at infinity that have
     * no vector get the camera's motion. */
    float view_projection[16], other_view_projection[16];
    uint32_t barriers; /* GL_*_BARRIER_BIT for uses of the result other than texture fetches */
    uint32_t reserved;
    const char* debug_view; /* name of a texture or work list of the plan (pc_explain()), such as
                               "0.motion_blur.moving_blocks", or "fill", or a texture of the host,
                               such as "host.motion"; drawn instead of the result */
    float pixel_aspect;     /* width over height of a pixel on the display; 0 = 1 */
    uint32_t reserved_2;
    pc_slice color_slice, depth_slice, motion_slice, mask_slice, output_slice;
    pc_texture mask; /* optional: its first component is the share of each pixel, 0 to 1, of objects
                        that passes treat differently (pc_chain_set_mask()), such as a first-person
                        weapon or an interface in the world */
    /* Texels of the frame's rectangle in depth and in motion, such as {width/2, height/2}; {0, 0} =
     * width, height. Each pixel reads the texel that contains its center; of a motion plane with
     * fewer texels than depth, one of the four around its center, chosen by depth. motion_scale
     * still leads to pixels of this frame. */
    int32_t depth_size[2], motion_size[2];
    float depth_range[2]; /* GL's depth range, of a depth that has clip planes: stored depths at its
                             ends; {0, 0} = {0, 1}. What is stored beyond counts as the end */
    /* How the chain's `focus_at` follows the depth of its place, or of a disc around it. */
    float focus_radius;  /* of the disc, in frame heights; 0 = 5 x 5 pixels */
    float focus_seconds; /* after which 63 % of a change are done; 0 = at once */
    float frame_seconds; /* since the last frame; > 0 if focus_seconds is */
    uint32_t reserved_3[2];
    /* The frames before and after this one, as they were or will be given: their color
     * (unfiltered), depth, motion and exposure, and the values that describe these. Both optional;
     * passes take what this frame hides from them (parameter `neighbors`). Their other members are
     * ignored. They have exposure if this frame has it. One with PC_CAMERA_CUT or of another size
     * is not used, and neither is used with PC_CAMERA_CUT, PC_HALF_RESOLUTION, or by a pass with a
     * mask. */
    const struct pc_frame *before, *after;
} pc_frame;

/* Sets depth_encoding, the flags of rows and vectors, motion_scale and motion_bias to the
 * conventions of an engine: "unity", "unreal", "bevy", "godot", "falcor", "g3d". frame->width and
 * height must be set. docs/integration.md lists them. Check the result with pc_check_motion(). */
PC_API pc_result pc_use_conventions(const char* engine, pc_frame*);

/* [GL] Compiles the programs of every frame of this kind, and makes this frame's textures. A kind
 * is: the chain with its values; PC_HALF_PLANES; PC_NO_ELISION; PC_HALF_RESOLUTION; PC_FAST_MATH;
 * whether exposure is given; debug_view; depth, motion, mask, before and after if they are given (a
 * later frame may lack them); which textures are arrays. No other member of pc_frame selects a
 * program. Dispatches one work group of each program of this frame and of a cut, because a driver
 * may compile at the first dispatch; nothing of the host is written. wait = 0: compiles or
 * dispatches one program at most, and returns PC_PENDING until none is left.
 */
PC_API pc_result pc_prepare(pc_instance*, pc_chain*, const pc_frame*, int wait);
/* [GL] Filters one frame. *result (may be NULL) is the output, or a texture of the library that is
 * valid until the next pc_run() or pc_prepare(), or color itself if there was nothing to do and no
 * output was given. Its rows are ordered as in color. A chain in which no pass has work is not an
 * error. */
PC_API pc_result pc_run(pc_instance*, pc_chain*, const pc_frame*, pc_texture* result);

typedef struct pc_frame_needs {
    uint32_t struct_size;
    uint32_t textures;                      /* of the library */
    uint64_t texture_bytes;                 /* of all of them; compare with texture_budget */
    uint32_t programs, programs_to_compile; /* of the frame's kind; those not compiled yet */
} pc_frame_needs;
/* The needs of this frame on the device, or of one of max_width x max_height if these are stated.
 * Calls no GL; may be called before pc_prepare(). Errors: those of pc_run() that its arguments
 * cause. */
PC_API pc_result pc_query_frame(pc_instance*, pc_chain*, const pc_frame*, pc_frame_needs*);

/* --------------------------------------------------------------------------------- what it did */
typedef struct pc_time {
    char name[48]; /* "motion_blur", at level 2 "motion_blur.gather"; "import" and "export" convert
                      from and to the host's textures */
    float milliseconds;
} pc_time;
/* level: 0 off, 1 passes, 2 steps; of the frames from now on. */
PC_API pc_result pc_set_timing(pc_instance*, int level);
/* [GL] Times of the newest frame that the device has finished; PC_PENDING = none yet. Never waits.
 * *count: in, room in times; out, number of times. (The GL timers of a software renderer are wrong.
 * With one, pc_run() waits for every interval while timing is on.) */
PC_API pc_result pc_timings(pc_instance*, pc_time* times, uint32_t* count, uint64_t* frame_number);

/* A time that the frames of a chain may take on the device. This instance then filters with fewer
 * `samples` while they take longer, and with more again, up to the values that the host set, by
 * the times of frames that the device has finished; at most every half a second. The chain keeps
 * its values, for other instances too; pc_query_budget() tells the part that is used. A change
 * makes pc_run() plan again on the CPU, and make the texture of lens samples anew. With a mask or
 * PC_HALF_RESOLUTION other samples are other programs: call pc_prepare() after pc_set_budget(). */
typedef struct pc_budget {
    uint32_t struct_size, reserved;
    float milliseconds; /* 0 = no budget: the host's samples again */
    float least;        /* the smallest part of the samples, 0.25 to 1; 0 = 0.25 */
} pc_budget;
/* PC_ERROR_CHAIN: no pass reads a number of samples. Times are measured as by
 * pc_set_timing(instance, 1). */
PC_API pc_result pc_set_budget(pc_instance*, pc_chain*, const pc_budget*);
typedef struct pc_budget_state {
    uint32_t struct_size, reserved;
    float milliseconds; /* the budget; 0 = none */
    float part;         /* of the samples that the host set; 1 without a budget */
    float frame_ms;     /* the median of up to 8 frames since the last change; 0 = not known yet */
    uint32_t changes;   /* since the budget was set */
} pc_budget_state;
/* Without a budget: milliseconds 0, part 1. */
PC_API pc_result pc_query_budget(const pc_instance*, const pc_chain*, pc_budget_state*);

typedef struct pc_counters { /* since pc_create(); textures_alive and texture_bytes: now */
    uint32_t struct_size, reserved;
    uint64_t frames, dispatches, barriers;
    uint64_t programs, plans_made, texture_allocations;
    uint64_t textures_alive, texture_bytes, texture_bytes_peak;
    uint64_t programs_loaded; /* of `programs`, those that load_program() gave */
} pc_counters;
/* Calls no GL. */
PC_API pc_result pc_count(const pc_instance*, pc_counters*);
/* The last frame's plan as JSON: steps, textures, skipped work with its reasons. *size: in, room in
 * text; out, bytes with the final 0. PC_ERROR_ARGUMENT = the room is too small; the text is not
 * written. */
PC_API pc_result pc_explain(const pc_instance*, char* text, size_t* size);

/* [GL] For development: reads back, and waits. Warps the color of `frame` by its vectors, with each
 * sign of x and y, and compares it with the color of the next frame (the previous frame without
 * PC_MOTION_TO_NEXT). Returns the signs that fit best, 1 or -1: {1, 1} = the conventions are right.
 * *margin: error of the second best signs divided by the error of the best. Below 1.1 the result is
 * undecided (a frame without motion, or with motion along one axis only). other_color has the layer
 * and level of the frame's color. The textures are checked as with PC_VALIDATE; GL's error flag is
 * clear afterwards. */
PC_API pc_result pc_check_motion(pc_instance*, const pc_frame* frame, const pc_texture* other_color,
                                 int signs[2], float* margin);
#ifdef __cplusplus
}
#endif
#endif
