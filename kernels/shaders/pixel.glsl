#ifndef PIXEL_GLSL
#define PIXEL_GLSL
// How a frame's shader learns which pixel it is of, and gives what it made of it: as a fragment, or as an invocation of
// a compute shader (BY_COMPUTE).
#ifdef BY_COMPUTE
layout(local_size_x = 8, local_size_y = 8) in;
#define PIXEL (vec2(gl_GlobalInvocationID.xy) + 0.5)
#define PIXEL_OUTPUT(place, format, type, name) layout(IMAGE_BINDING(place), format) uniform writeonly image2D name
#define PUT(name, value) imageStore(name, ivec2(gl_GlobalInvocationID.xy), vec4(value))
#else
#define PIXEL gl_FragCoord.xy
#define PIXEL_OUTPUT(place, format, type, name) layout(location = place) out type name
#define PUT(name, value) name = value
#endif
#endif
