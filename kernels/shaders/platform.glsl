// What differs between Vulkan and OpenGL, here and nowhere else.
#ifdef VULKAN
#define BINDING(n) set = 0, binding = n
#define IMAGE_BINDING(n) set = 0, binding = 8 + n  // behind the samplers
#else
#define BINDING(n) binding = n
#define IMAGE_BINDING(n) binding = n  // units of their own
#endif

#ifdef VULKAN
#define VERTEX_INDEX gl_VertexIndex
#else
#define VERTEX_INDEX gl_VertexID
#endif
