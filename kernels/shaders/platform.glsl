// What differs between Vulkan and OpenGL, here and nowhere else.
#ifdef VULKAN
#define BINDING(n) set = 0, binding = n
#else
#define BINDING(n) binding = n
#endif

#ifdef VULKAN
#define VERTEX_INDEX gl_VertexIndex
#else
#define VERTEX_INDEX gl_VertexID
#endif
