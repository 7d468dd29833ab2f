// The finished picture on the window, in sRGB (IEC 61966-2-1).
uniform sampler2D background_picture;  // Row 0 is the bottom.
uniform vec2 window_size;

out vec4 color;

void main() {
  vec3 c = clamp(texture(background_picture, gl_FragCoord.xy / window_size).rgb, 0.0, 1.0);
  color = vec4(mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, greaterThan(c, vec3(0.0031308))), 1.0);
}
