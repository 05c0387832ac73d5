#ifndef RAY_GLSL
#define RAY_GLSL
// How a ray falls: by 1 for each unit of t, from the top plate at t = 0 to the bottom one at t = 1. On a curved surface
// it may be bent instead (surface_frame.glsl), and then may leave through the top plate again. Macros, so that straight
// rays' shaders are what they would be if there were no others. RAY_SHARE is 1 at the end, less before.
#ifdef BENT_RAYS
#define IF_BENT(text) text
#define RAY_HEIGHT(ray, t) bent_height(ray, t)
#define RAY_LOWEST(ray, t, t_end) bent_lowest(ray, t, t_end)
#define RAY_AT_HEIGHT(ray, height) bent_at(ray, height)
#define RAY_END(ray) ray.end
#define RAY_SHARE(ray, t) (t < ray.end ? 0.0 : 1.0)
#else
#define IF_BENT(text)
#define RAY_HEIGHT(ray, t) (1.0 - t)
#define RAY_LOWEST(ray, t, t_end) (1.0 - t_end)
#define RAY_AT_HEIGHT(ray, height) (1.0 - height)
#define RAY_END(ray) 1.0
#define RAY_SHARE(ray, t) t
#endif
#endif
