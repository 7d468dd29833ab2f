in float depth;

void main() { gl_FragDepth = clamp(depth, 0.0, 0.9999); }
