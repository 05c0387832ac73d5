// The only file that knows which API the shader is compiled for.
#ifdef VULKAN
#define BINDING(n) set = 0, binding = n
#define VERTEX_INDEX gl_VertexIndex
#else
#define BINDING(n) binding = n
#define VERTEX_INDEX gl_VertexID
#endif
