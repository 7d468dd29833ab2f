uniform sampler2D background_picture;  // Linear picture values, in the size of the target; row 0 is the top.

out vec4 color;

void main() {
  ivec2 size = textureSize(background_picture, 0), at = ivec2(gl_FragCoord.xy);
  color = vec4(texelFetch(background_picture, ivec2(at.x, size.y - 1 - at.y), 0).rgb, 0.0);
}
