// One triangle that covers the picture.
void main() { gl_Position = vec4(vec2[](vec2(-1.0), vec2(3.0, -1.0), vec2(-1.0, 3.0))[gl_VertexID], 0.0, 1.0); }
