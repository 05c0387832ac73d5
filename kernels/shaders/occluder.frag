#version 450

// alpha: what is seen there (SeenObject in depth.h)
layout(location = 0) out vec4 out_color;

void main() { out_color = vec4(0.20, 0.20, 0.22, 252.0 / 255.0); }
